"""First hits of light, and ways out from a surface, with Embree: what `engine` asks of it.

Rays are carried round the period, and sent again where they fell through an edge, as in
`wavefront.trace`.
"""

import numpy as np
from numpy.typing import NDArray

from ..surface import Mesh
from .beam import light_direction, ray_origins
from .grid import MARGIN, Grid
from .kernels.empty_space import OFFSET, launch
from .kernels.first_hits import record_first_hits
from .kernels.state import Frame, empty_ray_batch
from .wavefront import BATCH_SIZE, FirstHits, Tile

Array = NDArray[np.float64]


def first_hits(
    tile: Tile, theta: float, phi: float, rays: int, rng: np.random.Generator
) -> FirstHits:
    """Send light from (θ, φ), in degrees, and mirrored light from what it meets."""
    grid = tile.grid
    frame = Frame(grid.x0, grid.y0, grid.top + OFFSET * grid.reach, grid.reach)
    points = ray_origins(rays, grid, rng, 0, 1)
    dx, dy, dz = -light_direction(theta, phi)
    hit, free = np.full(rays, -1, np.int32), np.zeros(rays, np.bool_)
    ray_batch, next_batch = (empty_ray_batch(BATCH_SIZE, grid.aspect) for _ in range(2))
    active = started = lost = 0
    while True:
        fresh = min(BATCH_SIZE - active, rays - started)
        if fresh:
            # A batch for each ray: its number.
            launch(
                active, points, started, started + fresh, dx, dy, dz, rays, ray_batch, grid, frame
            )
            active, started = active + fresh, started + fresh
        if not active:
            return FirstHits(_of_period(hit, grid), free, lost)
        hits = tile.intersect(ray_batch.origins[:active], ray_batch.embree_directions[:active])
        active, more = record_first_hits(
            active, ray_batch, next_batch, hits, grid, frame, hit, free
        )
        ray_batch, next_batch = next_batch, ray_batch
        lost += more


def _of_period(triangle: NDArray[np.int32], grid: Grid) -> NDArray[np.int64]:
    """Number of the facet of the period that a triangle, maybe of the margin, is an image of."""
    cell, side = np.divmod(triangle.astype(np.int64), 2)
    y, x = np.divmod(cell, grid.flipped.shape[1])
    y, x = (y - MARGIN) % grid.rows, (x - MARGIN) % grid.columns
    return np.where(triangle < 0, -1, 2 * (y * grid.columns + x) + side)


def ways_out(
    tile: Tile, facets: NDArray[np.int64], points: Array, normals: Array, w: Array
) -> NDArray[np.bool_]:
    """Which rays from facets along ``w``, in cells, meet no triangle.

    Their starts are moved off the facets, as the tracer's rays are, by a part of 5e−7 of the
    coordinates: an estimate from them is biased by about as little.
    """
    del facets  # the offset keeps a ray off its own
    grid = tile.grid
    period = np.array([grid.columns, grid.rows])
    low = np.array([grid.x0, grid.y0])
    high = low + period + 2 * MARGIN
    step = OFFSET * grid.reach * np.abs(normals).sum(axis=1, keepdims=True)
    position = points + [grid.x0 + MARGIN, grid.y0 + MARGIN, 0.0] + step * normals
    out = np.zeros(len(points), bool)
    pending = np.arange(len(points))
    while len(pending):
        rays = np.tile(w.astype(np.float32), (len(pending), 1))
        hits = tile.intersect(position[pending].astype(np.float32), rays).triangle
        pending = pending[hits < 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            wall = np.where(w[:2] > 0, high, low)
            t = np.where(w[:2] != 0, (wall - position[pending, :2]) / w[:2], np.inf)
        last = t.min(axis=1)
        above = position[pending, 2] + last * w[2] >= grid.top
        out[pending[above]] = True
        pending, axis, last = pending[~above], np.argmin(t, axis=1)[~above], last[~above]
        # A little back, so that rounding leaves no gap between the two parts.
        position[pending] += (last - 2.0**-18 * grid.reach)[:, None] * w
        position[pending, axis] -= np.sign(w[axis]) * period[axis]
    return out


def period_of(tile: Tile) -> Mesh:
    """Heights as rays meet them, see `engine.period_of`."""
    inner, grid = slice(MARGIN, -MARGIN), tile.grid
    heights = grid.heights[inner, inner].astype(np.float64)
    return Mesh(heights, grid.flipped[inner, inner], grid.aspect)
