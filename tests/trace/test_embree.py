import numpy as np
import pytest
import trimesh

from microsurf.trace.embree import EmbreeTile
from microsurf.trace.grid import from_heights, triangles


def rough(rows, columns, seed=0, scale=1.0):
    return np.random.default_rng(seed).standard_normal((rows, columns)) * scale


def plain(heights):
    return from_heights(heights, np.zeros(heights.shape, bool))


@pytest.fixture(scope="module")
def tile():
    return EmbreeTile(plain(rough(6, 9)))


def rays(count=2):
    return np.tile(np.float32([0.1, 0.2, 5]), (count, 1)), np.tile(
        np.float32([0, 0, -1]), (count, 1)
    )


def test_hits_are_those_of_an_independent_float64_engine():
    heights = rough(7, 5, seed=3)
    flipped = np.random.default_rng(4).random(heights.shape) < 0.5
    grid = from_heights(heights, flipped)
    vertices, faces = triangles(grid)
    mesh = trimesh.Trimesh(vertices.astype(float), faces, process=False)
    rng = np.random.default_rng(5)
    origins = np.column_stack([rng.uniform(-3, 3, (400, 2)), np.full(400, grid.top + 1)])
    directions = np.column_stack([rng.uniform(-1, 1, (400, 2)), np.full(400, -1.0)])
    origins, directions = origins.astype(np.float32), directions.astype(np.float32)
    found = EmbreeTile(grid).intersect(origins, directions)
    corners = vertices[faces].astype(float)
    expected = first_hits(corners, origins.astype(float), directions.astype(float))
    np.testing.assert_array_equal(found.triangle, expected)
    hit = found.triangle >= 0
    assert hit.sum() > 200
    a, b, c = (corners[found.triangle[hit], k] for k in range(3))
    point = a + found.u[hit, None] * (b - a) + found.v[hit, None] * (c - a)
    away = np.cross(point - origins[hit], directions[hit])
    assert np.abs(away).max() < 1e-4  # (u, v) belong to the second and third vertex
    assert mesh.face_normals[:, 2].min() > 0  # every triangle looks up


def first_hits(corners, origins, directions):
    """Möller and Trumbore over every pair, nothing clever."""
    a, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    hits = []
    for o, d in zip(origins, directions, strict=True):
        p = np.cross(d, e2)
        det = np.sum(e1 * p, axis=1)
        s = o - a
        u = np.sum(s * p, axis=1) / det
        q = np.cross(s, e1)
        v = q @ d / det
        t = np.sum(e2 * q, axis=1) / det
        t[(u < 0) | (v < 0) | (u + v > 1) | (t < 0)] = np.inf
        hits.append(int(np.argmin(t)) if np.isfinite(t.min()) else -1)
    return hits


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda o, d: (o.astype(float), d), "float32"),
        (lambda o, d: (o, d[:1]), "2 origins and 1 directions"),
        (lambda o, d: (o, np.full_like(d, np.nan)), "finite"),
        (lambda o, d: (np.full_like(o, np.inf), d), "finite"),
        (lambda o, d: (o, np.zeros_like(d)), "not zero"),
        (lambda o, d: (o[:, :2], d), r"\(rays, 3\)"),
        (lambda o, d: (np.asfortranarray(o), d), "contiguous"),
    ],
)
def test_what_embree_would_read_out_of_bounds_or_miss_in_silence_is_refused(tile, spoil, message):
    with pytest.raises(ValueError, match=message):
        tile.intersect(*spoil(*rays()))


def test_margin_repeats_the_period():
    heights = rough(4, 6)
    grid = plain(heights)
    np.testing.assert_array_equal(grid.heights[1:5, 1:7], heights.astype(np.float32))
    np.testing.assert_array_equal(grid.heights[0], grid.heights[4])
    np.testing.assert_array_equal(grid.heights[1], grid.heights[5])
    np.testing.assert_array_equal(grid.heights[:, 0], grid.heights[:, 6])


def test_diagonals_run_as_stated():
    heights = np.zeros((2, 2))
    flipped = np.array([[False, True], [False, False]])
    vertices, faces = triangles(from_heights(heights, flipped))
    width = 4
    cell = (1 * width + 1, 1 * width + 2)  # the period begins after the margin

    def corners(number, side):
        return {
            tuple(v[:2] - vertices[faces[2 * number, 0]][:2])
            for v in vertices[faces[2 * number + side]]
        }

    assert corners(cell[0], 0) == {(0, 0), (1, 0), (1, 1)}
    assert corners(cell[0], 1) == {(0, 0), (1, 1), (0, 1)}
    assert corners(cell[1], 0) == {(0, 0), (1, 0), (0, 1)}
    assert corners(cell[1], 1) == {(1, 0), (1, 1), (0, 1)}


def test_a_relief_that_float32_cannot_hold_is_refused():
    heights = np.zeros((4, 4))
    heights[1, 1] = 2e6
    with pytest.raises(ValueError, match="relief of 2e\\+06 cells"):
        plain(heights)
