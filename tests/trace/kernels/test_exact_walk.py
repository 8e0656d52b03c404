"""The exact walk against the float64 walk over the mesh's grid, which shares nothing with it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from microsurf.surface import generate_surface
from microsurf.surface.heightfield import mesh
from microsurf.trace.exact import exact_tile
from microsurf.trace.grid import MARGIN, from_heights
from microsurf.trace.kernels.exact_first_hits import first_facets
from microsurf.trace.kernels.exact_walk import around
from validation.gridwalk.walk import GridWalk

COUNT = 20_000


@given(st.integers(1, 4096), st.integers(-1000, 1000), st.integers(0, 4095))
def test_a_cell_comes_back_into_the_period(cells, periods, cell):
    """From up to a thousand periods outside, and from its edges."""
    for inside in (cell % cells, 0, cells - 1):
        assert around(inside + periods * cells, cells) == inside


def hit(tile, origins, directions):
    facet, point = np.empty(len(origins), np.int64), np.empty((len(origins), 3))
    first_facets(tile, origins, directions, facet, point)
    return facet, point


def walked(heights, flipped, origins, directions):
    """Facets of the period by the grid walk, over so many periods that no ray leaves them.

    Origins lie in the period; what it meets in the margin is named by its image.
    """
    rows, columns = heights.shape
    times = 9
    grid = from_heights(np.tile(heights, (times, times)), np.tile(flipped, (times, times)))
    shift = np.array([grid.x0 + MARGIN + 4 * columns, grid.y0 + MARGIN + 4 * rows, 0])
    found = GridWalk(grid).first_hits(origins + shift, directions)
    cell, side = np.divmod(found.triangle.astype(np.int64), 2)
    y, x = np.divmod(cell, grid.flipped.shape[1])
    y, x = (y - MARGIN) % rows, (x - MARGIN) % columns
    return np.where(found.triangle < 0, -1, 2 * (y * columns + x) + side), found.t


def surfaces():
    rng = np.random.default_rng(3)
    made = mesh(generate_surface(2.0, 0.5, cells=32, seed=1))
    needles = 0.3 * rng.standard_normal((24, 40))
    needles[rng.integers(0, 24, 5), rng.integers(0, 40, 5)] += 1000
    return {
        "GGX": (made.heights, made.flipped),
        "not a power of two": (3 * rng.standard_normal((13, 21)), rng.random((13, 21)) < 0.5),
        "needles": (needles, rng.random((24, 40)) < 0.5),
        "two cells": (rng.standard_normal((2, 3)), rng.random((2, 3)) < 0.5),
        "plateaus": (
            np.floor(3 * rng.random((8, 8))).repeat(4, axis=0).repeat(4, axis=1),
            rng.random((32, 32)) < 0.5,
        ),
    }


def rays(heights, kind, rng):
    """From above the surface, down or up; ``aimed`` ones at vertices and along grid lines."""
    rows, columns = heights.shape
    top = heights.astype(np.float32).max() + 0.5
    origins = np.column_stack(
        [rng.uniform(0, columns, COUNT), rng.uniform(0, rows, COUNT), np.full(COUNT, top)]
    )
    slope = rng.uniform(0.05, 3, COUNT) * max(1.0, np.ptp(heights) / min(rows, columns))
    turn = rng.uniform(0, 2 * np.pi, COUNT)
    directions = np.column_stack([np.cos(turn), np.sin(turn), -slope])
    if kind == "vertical":
        directions[:, :2] = 0
    elif kind == "along x":
        directions[:, 1] = 0
    elif kind == "diagonal":
        directions[:, 1] = directions[:, 0]
    return origins, directions


@pytest.mark.parametrize("name", surfaces())
@pytest.mark.parametrize("kind", ["any", "vertical", "along x", "diagonal"])
def test_meets_the_facet_that_the_grid_walk_meets(name, kind):
    heights, flipped = surfaces()[name]
    origins, directions = rays(heights, kind, np.random.default_rng(5))
    tile = exact_tile(heights, flipped)
    seen, point = hit(tile, origins, directions)
    true, t = walked(heights, flipped, origins, directions)
    inside = true >= 0  # others left the periods of the grid walk
    assert inside.mean() > 0.5
    assert (seen >= 0).all()
    assert (seen[inside] == true[inside]).all()
    # The same point, as well as float64 knows it where the ray grazes the facet.
    height = origins[inside, 2] + t[inside] * directions[inside, 2]
    assert np.median(np.abs(point[inside, 2] - height)) < 1e-12 * max(1, np.ptp(heights))


def test_a_ray_to_a_vertex_meets_a_facet_of_it():
    """Aimed exactly: heights of few bits, directions in 1024ths; no hole in the surface."""
    rng = np.random.default_rng(7)
    heights = np.round(4 * rng.standard_normal((16, 16))) / 4
    flipped = rng.random((16, 16)) < 0.5
    y, x = rng.integers(0, 16, (2, COUNT))
    directions = np.round(rng.uniform(-1, 1, (COUNT, 3)) * 1024) / 1024
    directions[:, 2] = -4.0
    origins = np.column_stack([x, y, heights[y, x]]) - 8 * directions
    seen, point = hit(exact_tile(heights, flipped), origins, directions)
    start = origins % [16, 16, 1e9]
    true, t = walked(heights, flipped, start, directions)
    assert (seen >= 0).all()
    # A vertex belongs to all its facets: where the walks name two, both say the same point.
    gap = np.abs((point - (start + t[:, None] * directions) + 8) % [16, 16, 1e9] - 8).max(axis=1)
    assert (gap[seen != true] < 1e-12).all()
    assert (seen == true).mean() > 0.99


@pytest.mark.parametrize("slope", [0.0, 1e-14, -1e-14])
def test_a_level_ray_in_a_groove_ends(slope):
    heights = np.tile([0.0, 3.0], (8, 4))
    tile = exact_tile(heights, np.zeros(heights.shape, bool))
    seen, _ = hit(tile, np.array([[0.0, 0.5, 1.0]]), np.array([[0.0, 1.0, slope]]))
    assert seen[0] == -1


def test_light_from_far_above_comes_down():
    """Ten thousand cells up at 89.9°: 90 000 periods of the tile, and still the right facet."""
    tile = exact_tile(np.zeros((64, 64)), np.zeros((64, 64), bool))
    down = np.radians(89.9)
    direction = np.array([[np.sin(down), 0.0, -np.cos(down)]])
    seen, point = hit(tile, np.array([[0.25, 0.5, 1e4]]), direction)
    assert seen[0] >= 0
    assert abs(point[0, 0] - (0.25 + 1e4 * np.tan(down)) % 64) < 1e-6
