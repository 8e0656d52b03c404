import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.surface import Heightfield, from_array, level
from microsurf.surface.heightfield import facet_slopes, measured_facets, slopes_of_both_splits
from microsurf.surface.voids import fill, largest_rectangle, mend


def brute_rectangle(void):
    """Area of the largest rectangle without voids, by trying all."""
    rows, columns = void.shape
    return max(
        (i2 - i1) * (j2 - j1)
        for i1 in range(rows)
        for i2 in range(i1 + 1, rows + 1)
        for j1 in range(columns)
        for j2 in range(j1 + 1, columns + 1)
        if not void[i1:i2, j1:j2].any()
    )


def test_the_largest_rectangle_is_the_largest():
    rng = np.random.default_rng(41)
    for share in (0.02, 0.1, 0.3, 0.6):
        for shape in ((7, 9), (12, 5), (1, 8)):
            void = rng.random(shape) < share
            if void.all():
                continue
            rows, columns = largest_rectangle(void)
            cropped = void[rows, columns]
            assert not cropped.any()
            assert cropped.size == brute_rectangle(void)


@pytest.mark.parametrize("pixel", [(1.0, 1.0), (1.0, 1.5), (3e-9, 2e-9)])
def test_what_is_harmonic_is_filled_exactly(pixel):
    """x² − y² and xy are discretely harmonic on a grid, whatever its pixel."""
    y, x = np.mgrid[:30, :40].astype(float)
    x, y = x * pixel[0], y * pixel[1]
    heights = x**2 - y**2 + 0.3 * x * y + x - 2 * y
    void = np.zeros(x.shape, dtype=bool)
    void[5:20, 8:25] = True
    void[25, 3] = True
    found = fill(np.where(void, np.nan, heights), void, pixel)
    np.testing.assert_allclose(found, heights, atol=1e-12 * np.abs(heights).max())
    # Negative control: x² alone is not harmonic.
    bowl = np.where(void, np.nan, x**2)
    assert np.abs(fill(bowl, void, pixel) - x**2).max() > 0.01 * np.ptp(x**2)


def test_holes_at_the_edge_stay_between_their_rims():
    heights = np.random.default_rng(42).normal(size=(20, 20))
    void = np.zeros((20, 20), dtype=bool)
    void[:4] = void[:, 15:] = void[10:13, 2:8] = True
    found = fill(np.where(void, np.nan, heights), void, (1.0, 1.0))
    assert found.min() >= heights[~void].min()
    assert found.max() <= heights[~void].max()


def test_the_choice_that_nobody_made():
    heights = np.random.default_rng(43).normal(size=(50, 50))
    frame = heights.copy()
    frame[:2] = np.nan
    assert mend(frame, (1, 1)).report == {"share": 0.04, "treatment": "crop", "kept": 0.96}
    frame[:8] = np.nan
    assert mend(frame, (1, 1)).report["treatment"] == "fill"
    assert mend(frame, (1, 1), "crop").heights.shape == (42, 50)
    assert mend(heights, (1, 1), "refuse").report["treatment"] == "none"
    with pytest.raises(InputError, match=r"400 of 2500 points \(16\.00%\)"):
        mend(frame, (1, 1), "refuse")
    with pytest.raises(InputError, match="all 2500 points are voids"):
        mend(np.full((50, 50), np.nan), (1, 1))
    with pytest.raises(InputError, match="refuse, crop, fill"):
        mend(heights, (1, 1), "guess")
    # A part of a period is none.
    few = heights.copy()
    few[0] = np.nan
    assert mend(few, (1, 1), periodic=True).report["treatment"] == "fill"
    with pytest.raises(InputError, match="a part of a period"):
        mend(few, (1, 1), "crop", periodic=True)


def test_masks_and_nan_are_voids_in_python():
    plain = np.random.default_rng(44).normal(size=(30, 40))
    holes = plain.copy()
    holes[10:14, 20:30] = np.nan
    masked = np.ma.array(plain, mask=np.isnan(holes))
    masked.data[10:14, 20:30] = 1e20  # what is under a mask is not looked at
    by_nan, by_mask = from_array(holes, 0.5), from_array(masked, 0.5)
    assert np.array_equal(by_nan.heights, by_mask.heights)
    assert np.array_equal(by_nan.filled, np.isnan(holes))
    assert np.abs(by_nan.heights).max() < 10


@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
def test_facets_at_filled_points_are_told_apart(boundary):
    """Changing the filled heights changes the slopes of exactly those facets."""
    rng = np.random.default_rng(45)
    heights = rng.normal(size=(12, 15))
    filled = rng.random((12, 15)) < 0.2
    h = Heightfield(heights, 1.0, boundary, filled=filled)
    other = Heightfield(heights + filled * rng.normal(size=(12, 15)), 1.0, boundary)
    (p, q), (p2, q2) = facet_slopes(h), facet_slopes(other)
    # A facet has a corner whose height is in neither p nor q alone, but in one of both.
    assert np.array_equal(measured_facets(h), (p == p2) & (q == q2))
    assert measured_facets(other) is None
    (p, q, good), (p2, q2, _) = slopes_of_both_splits(h), slopes_of_both_splits(other)
    assert np.array_equal(good, (p == p2) & (q == q2))


@pytest.mark.parametrize("form", ["plane", "quadratic"])
def test_levelling_does_not_see_what_was_filled(form):
    y, x = np.mgrid[:40, :50] / 50.0
    trend = 3 * x - 2 * y + 1 + (x**2 - 4 * x * y + 2 * y**2 if form == "quadratic" else 0)
    filled = np.zeros((40, 50), dtype=bool)
    filled[:10, 30:] = True
    h = Heightfield(trend + 100 * filled, 0.1, "mirror", filled=filled)
    found = level(h, form)
    np.testing.assert_allclose(found.heights[~filled], 0, atol=1e-12)
    np.testing.assert_allclose(found.heights[filled], 100, atol=1e-10)
    assert found.filled is not None
    assert found.provenance["level"] == form
    # Negative control: without the mask it does.
    assert np.abs(level(Heightfield(h.heights, 0.1, "mirror"), form).heights[~filled]).max() > 1
