"""Which part of a fan is blocked, in one march along its azimuth; light's free way from above.

The march raises a line over all that it meets: what the surface blocks of an azimuth is
all that is flatter than the line when nothing ahead can reach it any more. Lines have the
slopes of a fan's rays, one for each ring of the detector, so the march ends as soon as
the first blocked ring is certain, and says the same as a ray sent along each.
"""

import numpy as np

from ...jit import compiled, inlined
from .exact_lobe_fans import steeper
from .exact_near_horizon import NEAR, near_horizon
from .exact_walk import LEAST, around, beside, far_side, greatest_ahead, unit

_PATIENCE = 3  # cells between two looks at the pyramid


@inlined
def first_blocked(
    tile, x, y, z, cx, cy, side, across_x, across_y, mz, mt, last, chance, high, rings, nodes
):
    """First ring of a fan that is blocked; at most ``high``, from which on all are.

    The fan starts at (x, y, z) on a facet, ``side`` of cell (cx, cy), and goes along the
    unit vector (across_x, across_y); see `lobe_fans` for the others.
    """
    dx = across_x if abs(across_x) > LEAST else LEAST
    dy = tile.aspect * (across_y if abs(across_y) > LEAST else LEAST)
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    ahead_x, ahead_y = int(dx > 0), int(dy > 0)
    quadrant = (1 - ahead_x) + 2 * (1 - ahead_y)
    per_x, per_y = 1 / dx, 1 / dy
    ix, iy = cx, cy
    tx, ty = (ix + ahead_x - x) * per_x, (iy + ahead_y - y) * per_y
    t = needed = 0.0
    level, highest = -1, len(tile.levels) - 1
    wait = _PATIENCE
    start_side = side
    if tile.plain and min(tile.columns, tile.rows) > 2 * NEAR:
        if abs(dx) > abs(dy):
            ix += NEAR * step_x
            t = (ix - step_x + ahead_x - x) * per_x
            iy = int(np.floor(y + t * dy))
        else:
            iy += NEAR * step_y
            t = (iy - step_y + ahead_y - y) * per_y
            ix = int(np.floor(x + t * dx))
        counts = abs(ix - cx), abs(iy - cy), t
        # The outermost cells are left to the case that looks whether a cell is in the period.
        inside = (
            min(cx, cy, ix, iy) > 0
            and max(cx, ix) < tile.columns - 1
            and max(cy, iy) < tile.rows - 1
        )
        if inside:
            needed = near_horizon(tile, x, y, z, cx, cy, side, dx, dy, per_x, per_y, counts, False)
        else:
            needed = near_horizon(tile, x, y, z, cx, cy, side, dx, dy, per_x, per_y, counts, True)
        cx, cy = around(ix, tile.columns), around(iy, tile.rows)
        tx, ty = (ix + ahead_x - x) * per_x, (iy + ahead_y - y) * per_y
        level, start_side = 0, -1
    ring, slope = steeper(high + 1, -1.0, needed, mz, mt, last, chance, rings, nodes)
    while ring > 0:
        z_in = z + t * slope
        if level >= 0:
            if not z_in > greatest_ahead(tile, level, cx, cy, quadrant):
                level -= 1
                wait = _PATIENCE
                continue
            while level < highest and z_in > greatest_ahead(tile, level + 1, cx, cy, quadrant):
                level += 1
            if level == highest:
                break
            k = level + 1
            far_x = far_side(cx >> k, k, ahead_x, tile.columns) + (ix - cx)
            far_y = far_side(cy >> k, k, ahead_y, tile.rows) + (iy - cy)
            tx, ty = (far_x - x) * per_x, (far_y - y) * per_y
            t = max(min(tx, ty), t)
            old_x, old_y = ix, iy
            if tx <= ty:
                ix = far_x - 1 + ahead_x
                low, most = (iy, far_y - 1) if ahead_y else (far_y, iy)
                iy = min(max(int(np.floor(y + t * dy)), low), most)
            else:
                iy = far_y - 1 + ahead_y
                low, most = (ix, far_x - 1) if ahead_x else (far_x, ix)
                ix = min(max(int(np.floor(x + t * dx)), low), most)
            cx = around(cx + (ix - old_x), tile.columns)
            cy = around(cy + (iy - old_y), tile.rows)
            tx, ty = (ix + ahead_x - x) * per_x, (iy + ahead_y - y) * per_y
            continue
        wait -= 1
        if wait == 0:
            level = 0
        out = max(min(tx, ty), t)
        if start_side >= 0 or not z_in > tile.tops[cy, cx]:
            fx, fy = unit(x + t * dx - ix), unit(y + t * dy - iy)
            if tx <= ty:
                gx, gy = float(ahead_x), unit(y + out * dy - iy)
                i = cx + ahead_x
                edge = (1 - gy) * tile.heights[cy, i] + gy * tile.heights[cy + 1, i]
            else:
                gx, gy = unit(x + out * dx - ix), float(ahead_y)
                j = cy + ahead_y
                edge = (1 - gx) * tile.heights[j, cx] + gx * tile.heights[j, cx + 1]
            flip = tile.flipped[cy, cx]
            before, after = beside(flip, fx, fy), beside(flip, gx, gy)
            if start_side >= 0:
                # The own facet blocks nothing that it sends out itself.
                if (after < 0 if start_side == 0 else after > 0) and edge >= z + out * slope:
                    ring, slope = steeper(
                        ring, slope, (edge - z) / out, mz, mt, last, chance, rings, nodes
                    )
                start_side = -1
            else:
                if before * after < 0:
                    share = before / (before - after)
                    middle = t + share * (out - t)
                    mx = fx + share * (gx - fx)
                    j, k = (cy + 1, cy) if flip else (cy, cy + 1)
                    on = (1 - mx) * tile.heights[j, cx] + mx * tile.heights[k, cx + 1]
                    if on >= z + middle * slope:
                        ring, slope = steeper(
                            ring, slope, (on - z) / middle, mz, mt, last, chance, rings, nodes
                        )
                if edge >= z + out * slope:
                    ring, slope = steeper(
                        ring, slope, (edge - z) / out, mz, mt, last, chance, rings, nodes
                    )
        t = out
        if tx <= ty:
            ix += step_x
            tx = (ix + ahead_x - x) * per_x
            cx += step_x
            if cx == tile.columns:
                cx = 0
            elif cx < 0:
                cx = tile.columns - 1
        else:
            iy += step_y
            ty = (iy + ahead_y - y) * per_y
            cy += step_y
            if cy == tile.rows:
                cy = 0
            elif cy < 0:
                cy = tile.rows - 1
    return ring


FOOTPRINT = 8
"""Cells a side of a block of light that is brought near the surface as a whole."""
_WIDE = 3  # the first level whose blocks are wider than that


@compiled
def free_flight(tile, bx, by, dx, dy, dz):
    """How far light that starts above everything in a block of FOOTPRINT² cells surely flies.

    The block's first cell is (bx, by), light comes down along (dx, aspect · dy, dz) in cells.
    """
    dy *= tile.aspect
    ahead_x, ahead_y = int(dx > 0), int(dy > 0)
    quadrant = (1 - ahead_x) + 2 * (1 - ahead_y)
    # The block's rear corner, and the one that is foremost.
    x, y = bx + (1 - ahead_x) * FOOTPRINT, by + (1 - ahead_y) * FOOTPRINT
    fore_x = x + (FOOTPRINT if ahead_x else -FOOTPRINT)
    fore_y = y + (FOOTPRINT if ahead_y else -FOOTPRINT)
    t = 0.0
    while True:
        ix, iy = int(np.floor(x + t * dx)), int(np.floor(y + t * dy))
        # At t = 0 a corner on the far side belongs to the cells before it.
        ix, iy = (ix if ahead_x else ix - 1), (iy if ahead_y else iy - 1)
        cx, cy = ix % tile.columns, iy % tile.rows
        level = _WIDE
        jump = -1.0
        while level < len(tile.levels):
            k = level + 1
            far_x = far_side(cx >> k, k, ahead_x, tile.columns) + (ix - cx)
            far_y = far_side(cy >> k, k, ahead_y, tile.rows) + (iy - cy)
            end = min((far_x - fore_x) / dx, (far_y - fore_y) / dy)
            if not tile.top + end * dz > greatest_ahead(tile, level, cx, cy, quadrant):
                break
            jump = end
            level += 1
        if jump <= t:
            return t
        t = jump
