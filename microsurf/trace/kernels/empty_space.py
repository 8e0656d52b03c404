"""Rays are carried through what is empty, compiled: blocks that they pass above, round the period.

Cliffs can be a thousand cells high. A ray that starts above all of them at 80° would
go round the period dozens of times before Embree found anything; over a pyramid of
greatest heights it gets near the surface in a few steps.
"""

import numpy as np

from ...jit import compiled, inlined
from ..grid import LEVEL_STEP, MARGIN
from .state import BATCH, BODY, FAN_RING, ORDER, RETRIES, WRAPS

MOST_WRAPS = 100_000
OFFSET = 4 * 2.0**-23  # of the coordinates' reach: from a facet, or above everything


@compiled
def advance(px, py, pz, dx, dy, dz, tops, levels, left, front, columns, rows, top, reach):
    """Carry a ray through blocks that it passes above, round the period as often as need be.

    Returns 1 if it leaves for good, 2 after MOST_WRAPS rounds, else 0; the new
    origin; and how often it went round.
    """
    clear = 2.0**-20 * reach  # float32 must not see the ray lower than the block's top
    nudge = 2.0**-40 * reach  # past the border, into the next block
    nudge_x, nudge_y = np.copysign(nudge, dx), np.copysign(nudge, dy)
    per_x = 1 / dx if dx != 0 else np.inf
    per_y = 1 / dy if dy != 0 else np.inf
    x, y = px - left, py - front
    wraps = 0
    coarsest = len(levels) - 1
    level = coarsest
    parent_x = parent_y = 0
    while wraps < MOST_WRAPS:
        if dz > 0 and pz >= top:
            return 1, x + left, y + front, pz, wraps
        if x < 0 or x >= columns:
            x -= np.floor(x / columns) * columns
            wraps += 1
        if y < 0 or y >= rows:
            y -= np.floor(y / rows) * rows
            wraps += 1
        power, start, across = levels[level, 0], levels[level, 1], levels[level, 2]
        # Rounding can leave the coordinate on the far edge, which belongs to no block.
        bx = min(int(x) >> power, across - 1)
        by = min(int(y) >> power, levels[level, 3] - 1)
        if level < coarsest and (bx >> LEVEL_STEP != parent_x or by >> LEVEL_STEP != parent_y):
            # Out of the larger block that was not clear as a whole: try its neighbour so.
            level += 1
            parent_x >>= LEVEL_STEP
            parent_y >>= LEVEL_STEP
            continue
        tx = ty = np.inf
        if dx > 0:
            tx = (min((bx + 1) << power, columns) - x) * per_x
        elif dx < 0:
            tx = ((bx << power) - x) * per_x
        if dy > 0:
            ty = (min((by + 1) << power, rows) - y) * per_y
        elif dy < 0:
            ty = ((by << power) - y) * per_y
        t = max(min(tx, ty), 0.0)
        lowest = pz + t * dz if dz < 0 else pz
        if lowest > tops[start + by * across + bx] + clear:
            if t == np.inf:
                return 1, x + left, y + front, pz, wraps
            x, y, pz = x + t * dx, y + t * dy, pz + t * dz
            if tx <= ty:
                x += nudge_x
            else:
                y += nudge_y
        elif level > 0:
            level -= 1
            parent_x, parent_y = bx, by
        else:
            return 0, x + left, y + front, pz, wraps
    return 2, x + left, y + front, pz, wraps


@compiled
def launch(first, ray_origins, begin, end, dx, dy, dz, batches, rays, grid, frame):
    """Put light rays into the batch from ``first`` on, brought near the surface.

    They are those from ``begin`` to ``end`` of ``ray_origins``, points in the plane above
    everything, in cells; (dx, dy, dz) is not in cells, see `Grid.aspect`.
    """
    for k in range(begin, end):
        _, px, py, pz, wraps = advance(
            ray_origins[k, 0], ray_origins[k, 1], frame.top, dx, dy * grid.aspect, dz,
            grid.tops, grid.levels, frame.x0 + MARGIN, frame.y0 + MARGIN,
            grid.columns, grid.rows, frame.top, frame.reach,
        )  # fmt: skip
        push_ray(rays, first + k - begin, px, py, pz, dx, dy, dz, 1.0, 0, 0, wraps, k % batches)


@inlined
def push_ray(rays, r, px, py, pz, dx, dy, dz, weight, order, body, wraps, batch):
    """Make one ray the batch's r-th."""
    rays.origins[r, 0], rays.origins[r, 1], rays.origins[r, 2] = px, py, pz
    rays.embree_directions[r, 0], rays.embree_directions[r, 1], rays.embree_directions[r, 2] = (
        dx,
        dy * rays.aspect,
        dz,
    )
    rays.directions[r, 0], rays.directions[r, 1], rays.directions[r, 2] = dx, dy, dz
    rays.weight[r] = weight
    rays.state[r, ORDER], rays.state[r, BODY] = order, body
    rays.state[r, WRAPS], rays.state[r, BATCH] = wraps, batch
    rays.state[r, FAN_RING], rays.state[r, RETRIES] = -1, 0
