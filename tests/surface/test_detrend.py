import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.surface import Heightfield, level


def rough(rows=30, columns=47):
    return np.random.default_rng(5).standard_normal((rows, columns))


@pytest.mark.parametrize(("form", "degree"), [("plane", 1), ("quadratic", 2)])
def test_agrees_with_a_dense_least_squares_fit(form, degree):
    heights = rough()
    y, x = np.indices(heights.shape)
    heights = heights + 0.3 * x - 2 * y + 0.01 * x * y - 0.02 * y**2
    terms = [x**i * y**j for i in range(3) for j in range(3) if i + j <= degree]
    design = np.stack([t.ravel() for t in terms], axis=1).astype(float)
    fitted = design @ np.linalg.lstsq(design, heights.ravel(), rcond=None)[0]
    levelled = level(Heightfield(heights, 0.5, "mirror"), form)
    # lstsq on raw powers up to 46²: condition 1e4 times rounding of heights up to 100.
    np.testing.assert_allclose(levelled.heights, heights - fitted.reshape(heights.shape), atol=1e-9)
    assert (levelled.spacing, levelled.boundary) == (0.5, "mirror")


def test_takes_out_the_form_and_nothing_else():
    form = np.add.outer(0.1 * np.arange(20.0) ** 2, 3 * np.arange(33.0))
    assert np.abs(level(Heightfield(form), "quadratic").heights).max() < 1e-11
    # Negative control: a plane cannot take out the parabola.
    assert np.abs(level(Heightfield(form), "plane").heights).max() > 1
    once = level(Heightfield(rough()), "quadratic")
    np.testing.assert_allclose(level(once, "quadratic").heights, once.heights, atol=1e-14)


def test_none_is_the_same_surface():
    h = Heightfield(rough())
    assert level(h, "none") is h


def test_a_levelled_surface_has_no_recipe():
    assert level(Heightfield(rough(), recipe={"seed": 1}), "plane").recipe == {}


@pytest.mark.parametrize("shape", [(2, 2), (2, 7), (3, 2)])
def test_smallest_grids(shape):
    assert np.isfinite(level(Heightfield(rough(*shape)), "quadratic").heights).all()


def test_unknown_form_is_refused():
    with pytest.raises(InputError, match="none, plane, quadratic"):
        level(Heightfield(rough()), "cubic")
