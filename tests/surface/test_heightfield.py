import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.surface import Heightfield, facet_normals, facet_slopes, mesh

# 2 rows (y), 3 columns (x).
TINY = np.array([[0.0, 1.0, 3.0], [10.0, 14.0, 20.0]])


def test_facet_slopes_by_hand_periodic():
    p, q = facet_slopes(Heightfield(TINY, spacing=2.0))
    assert p.shape == q.shape == (2, 2, 3)
    # Lower: (x,y) (x+1,y) (x+1,y+1). Upper: (x,y) (x+1,y+1) (x,y+1). Wrapped.
    assert np.array_equal(2 * p[0], [[1, 2, -3], [4, 6, -10]])
    assert np.array_equal(2 * p[1], [[4, 6, -10], [1, 2, -3]])
    assert np.array_equal(2 * q[0], [[13, 17, 10], [-13, -17, -10]])
    assert np.array_equal(2 * q[1], [[10, 13, 17], [-10, -13, -17]])


def test_facet_slopes_by_hand_mirrored():
    p, q = facet_slopes(Heightfield(TINY, spacing=2.0, boundary="mirror"))
    assert np.array_equal(2 * p, [[[1, 2]], [[4, 6]]])
    assert np.array_equal(2 * q, [[[13, 17]], [[10, 13]]])


def test_facet_normals_are_cross_products():
    rng = np.random.default_rng(1)
    h = Heightfield(rng.standard_normal((4, 5)), spacing=0.5, boundary="mirror")
    y, x = np.indices((4, 5)) * 0.5
    point = np.stack([x, y, h.heights], axis=-1)
    a, b, c, d = point[:-1, :-1], point[:-1, 1:], point[1:, 1:], point[1:, :-1]
    expected = np.stack([np.cross(b - a, c - a), np.cross(c - a, d - a)])
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    # A few roundings of unit vectors.
    np.testing.assert_allclose(facet_normals(h), expected, atol=1e-15)


def test_slopes_of_a_period_sum_to_zero():
    """Exact period: every edge occurs in two facets, and edges of a row telescope."""
    heights = np.random.default_rng(2).integers(-1000, 1000, (6, 9)).astype(float)
    p, q = facet_slopes(Heightfield(heights))
    assert np.all(p.sum(axis=2) == 0)
    assert np.all(q.sum(axis=1) == 0)


def test_periodic_mesh_is_heights_over_spacing_about_their_mean():
    m = mesh(Heightfield(TINY, spacing=2.0))
    assert np.array_equal(m.heights, TINY / 2 - 4)
    assert not m.flipped.any()


def test_mirrored_mesh_by_hand():
    heights = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    m = mesh(Heightfield(heights, boundary="mirror"))
    unfolded = np.array([[0, 1, 2, 1], [3, 4, 5, 4]])
    assert np.array_equal(m.heights, unfolded - unfolded.mean())
    # Cells, one row of originals then its mirror image; flipped if mirrored once, not twice.
    assert np.array_equal(m.flipped, [[False, False, True, True], [True, True, False, False]])


@pytest.mark.parametrize("shape", [(2, 2), (2, 5), (7, 2), (4, 6)])
def test_mirrored_mesh_is_symmetric_as_triangles(shape):
    """Every triangle's mirror image about an edge of the grid is a triangle of the mesh."""
    h = Heightfield(np.random.default_rng(3).standard_normal(shape), boundary="mirror")
    m = mesh(h)
    rows, columns = m.heights.shape
    assert (rows, columns) == (2 * (shape[0] - 1), 2 * (shape[1] - 1))

    def diagonal(y, x):
        y, x = y % rows, x % columns
        ends = [(y, x + 1), (y + 1, x)] if m.flipped[y, x] else [(y, x), (y + 1, x + 1)]
        return sorted(m.heights[a % rows, b % columns] for a, b in ends)

    for y in range(rows):
        for x in range(columns):
            assert diagonal(y, x) == diagonal(-1 - y, x) == diagonal(y, -1 - x)
            assert m.heights[y, x] == m.heights[-y, x] == m.heights[y, -x]


@pytest.mark.parametrize("boundary", ["periodic", "mirror"])
def test_unit_of_a_power_of_two_changes_no_bit(boundary):
    heights = np.random.default_rng(4).standard_normal((5, 8)) + 100
    one = Heightfield(heights, 0.3, boundary)
    for power in (-30, 7):
        other = Heightfield(heights * 2.0**power, 0.3 * 2.0**power, boundary)
        assert np.array_equal(mesh(one).heights, mesh(other).heights)
        assert np.array_equal(facet_slopes(one), facet_slopes(other))


def test_heights_are_a_frozen_copy():
    mine = TINY.copy()
    h = Heightfield(mine)
    mine[0, 0] = 99
    assert h.heights[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        h.heights[0, 0] = 1


@pytest.mark.parametrize(
    ("heights", "said"),
    [
        (np.zeros((1, 1)), r"\(1, 1\)"),
        (np.zeros((1, 4)), r"\(1, 4\)"),
        (np.zeros((2, 3, 4)), "two dimensions"),
        (np.zeros(5), "two dimensions"),
        (np.zeros((2, 2), complex), "real numbers"),
        (np.array([[1, None], [2, 3]], object), "real numbers"),
        (np.array([["a", "b"], ["c", "d"]]), "real numbers"),
        (np.zeros((2, 2), bool), "real numbers"),
        (np.array([[np.nan, 1, np.inf], [0, 0, -np.inf]]), "3 of 6 are NaN or infinite"),
        (np.broadcast_to(0.0, (2, 16385)), "16384"),
    ],
)
def test_bad_heights_are_refused(heights, said):
    with pytest.raises(InputError, match=said):
        Heightfield(heights)


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, np.inf, "wide", None])
def test_bad_spacing_is_refused(spacing):
    with pytest.raises(InputError, match="spacing"):
        Heightfield(TINY, spacing)


def test_bad_boundary_and_overflow_are_refused():
    with pytest.raises(InputError, match="periodic, mirror"):
        Heightfield(TINY, 1.0, "torus")
    with pytest.raises(InputError, match="check the units"):
        Heightfield(TINY * 1e300, 1e-300)
