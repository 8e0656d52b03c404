"""The first facet a ray meets, by walking over the heights in float64, compiled.

Above the ray's projection the surface is piecewise linear, broken where the projection
crosses a side or the diagonal of a cell. At each break the ray's height is compared, once,
with the height on the crossed edge: a ray that was above and is not any more has met the
triangle in between. Nothing can fall between two triangles, whatever the rounding, and no
epsilon is needed: a ray that starts on a facet can't meet that facet, only the cell's other
triangle, across the diagonal, and all other cells.

Most cells are skipped by their greatest height, and most of the tile by a pyramid of
greatest heights: each block of 2^k × 2^k cells knows the greatest height of the 2 × 2 blocks
that lie ahead of a ray in it, for the four quadrants of its direction. Indices go round the
period, coordinates do not: t is the distance from the ray's start however often it went round.
"""

import numpy as np

from ...jit import compiled, inlined

LEAST = 1e-150
"""Least |dx| and |dy|: a vertical ray then leaves its cell 1e150 cells below, which is finite."""
ROUNDS = 100_000
"""Periods after which a ray that met nothing counts as out: it is level, and in a furrow."""
_PATIENCE = 3  # cells between two looks at the pyramid


@inlined
def around(cell, cells):
    """Bring a cell back into the period; after a jump it is never far out, so no division."""
    while cell >= cells:
        cell -= cells
    while cell < 0:
        cell += cells
    return cell


@inlined
def far_side(block, power, forward, cells):
    """Where the block ahead of ``block`` ends, in cells from the start of the block's period."""
    size = 1 << power
    if forward:
        if (block + 1) << power >= cells:
            return cells + min(size, cells)
        return min((block + 2) << power, cells)
    if block == 0:
        return (((cells - 1) >> power) << power) - cells
    return (block - 1) << power


@inlined
def greatest_ahead(tile, level, cx, cy, quadrant):
    """Greatest height in the level's block of a cell and the three ahead of it."""
    across, down = tile.levels[level, 1], tile.levels[level, 2]
    bx, by = cx >> (level + 1), cy >> (level + 1)
    return tile.ahead[tile.levels[level, 0] + (quadrant * down + by) * across + bx]


@inlined
def beside(flip, fx, fy):
    """Positive in triangle 0 of a cell, negative in triangle 1, zero on the diagonal."""
    return 1 - fx - fy if flip else fx - fy


@inlined
def unit(share):
    """Clip a place in a cell to 0 … 1."""
    return min(max(share, 0.0), 1.0)


@inlined
def sideways(component):
    """Keep a ray from being exactly vertical, see LEAST."""
    return component if abs(component) >= LEAST else np.copysign(LEAST, component)


@inlined
def facet_plane(tile, cx, cy, side):
    """Slopes p, q of a facet, and the height of its plane at the cell's corner (0, 0)."""
    h00, h10 = np.float64(tile.heights[cy, cx]), np.float64(tile.heights[cy, cx + 1])
    h01 = np.float64(tile.heights[cy + 1, cx])
    h11 = np.float64(tile.heights[cy + 1, cx + 1])
    if tile.flipped[cy, cx]:
        if side == 0:
            return h10 - h00, h01 - h00, h00
        return h11 - h01, h11 - h10, h01 + (h10 - h11)
    if side == 0:
        return h10 - h00, h11 - h10, h00
    return h11 - h01, h01 - h00, h00


@compiled
def walk(tile, x, y, z, dx, dy, dz, t, cx, cy, start_side):
    """Follow a ray from t on until it meets a facet or is above everything for good.

    The ray is (x, y, z) + t (dx, aspect · dy, dz) in cells, |dx| and |dy| ≥ LEAST; x, y at t
    lie in cell (cx, cy) of the period, counted from where the ray's coordinates start. ``own``
    is the side of that cell whose facet the ray leaves, −1 for none.

    Returns the side that was met, −1 if the ray is out; its cell; the place in it; slopes p, q
    of the facet, the height of the point, and t there.
    """
    dy *= tile.aspect
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    ahead_x, ahead_y = int(dx > 0), int(dy > 0)
    quadrant = (1 - ahead_x) + 2 * (1 - ahead_y)
    ix, iy = cx, cy  # the same cell, not brought back into the period
    tx, ty = (ix + ahead_x - x) / dx, (iy + ahead_y - y) / dy
    until = ROUNDS * float(tile.columns + tile.rows)
    level, highest = (-1 if start_side >= 0 else 0), len(tile.levels) - 1
    wait = _PATIENCE  # on a facet nothing is clear yet
    far_x = far_y = 0
    met = -1
    fx = fy = p = q = height = 0.0
    while True:
        z_in = z + t * dz
        if level >= 0:
            clear = -1.0
            if dz >= 0:
                # A ray that rises clears a block where it enters it: one block is enough to jump.
                lowest = level
                while level <= highest and z_in > greatest_ahead(tile, level, cx, cy, quadrant):
                    level += 1
                if level > highest:
                    break
                if level > lowest:
                    far_x = far_side(cx >> level, level, ahead_x, tile.columns) + (ix - cx)
                    far_y = far_side(cy >> level, level, ahead_y, tile.rows) + (iy - cy)
                    clear = min((far_x - x) / dx, (far_y - y) / dy)
            else:
                while level <= highest:
                    greatest = greatest_ahead(tile, level, cx, cy, quadrant)
                    if not z_in > greatest:
                        break
                    k = level + 1
                    fore_x = far_side(cx >> k, k, ahead_x, tile.columns) + (ix - cx)
                    fore_y = far_side(cy >> k, k, ahead_y, tile.rows) + (iy - cy)
                    end = min((fore_x - x) / dx, (fore_y - y) / dy)
                    if not z + end * dz > greatest:
                        break
                    clear, far_x, far_y = end, fore_x, fore_y
                    level += 1
            if t > until and abs(dz) * until < tile.top - tile.bottom:
                break
            level -= 1
            if clear <= t:
                if clear >= 0:
                    level = -1  # a block's edge: rounding leaves nothing to jump
                wait = _PATIENCE
                continue
            old_x, old_y = ix, iy
            if (far_x - x) / dx <= (far_y - y) / dy:
                ix = far_x - 1 + ahead_x
                low, high = (iy, far_y - 1) if ahead_y else (far_y, iy)
                iy = min(max(int(np.floor(y + clear * dy)), low), high)
            else:
                iy = far_y - 1 + ahead_y
                low, high = (ix, far_x - 1) if ahead_x else (far_x, ix)
                ix = min(max(int(np.floor(x + clear * dx)), low), high)
            cx = around(cx + (ix - old_x), tile.columns)
            cy = around(cy + (iy - old_y), tile.rows)
            t = clear
            tx, ty = (ix + ahead_x - x) / dx, (iy + ahead_y - y) / dy
            start_side = -1
            continue
        wait -= 1
        if wait == 0:
            level = 0
        out = max(min(tx, ty), t)
        z_out = z + out * dz
        if start_side >= 0 or not min(z_in, z_out) > tile.tops[cy, cx]:
            # Places where the ray comes in and goes out, and the height of the edge there.
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
            begin, end = t, out
            below = z_out <= edge
            side = int(before + after < 0)
            if start_side >= 0:
                side = 1 - start_side
                below = below and (after < 0 if start_side == 0 else after > 0)
                if below:
                    share = unit(before / (before - after)) if before != after else 1.0
                    begin = t + share * (out - t)
            elif before * after < 0:
                share = before / (before - after)
                middle = t + share * (out - t)
                mx = fx + share * (gx - fx)
                j, k = (cy + 1, cy) if flip else (cy, cy + 1)
                on = (1 - mx) * tile.heights[j, cx] + mx * tile.heights[k, cx + 1]
                if z + middle * dz <= on:
                    below, side, end = True, int(before < 0), middle
                else:
                    side, begin = int(after < 0), middle
            if below:
                met = side
                p, q, corner = facet_plane(tile, cx, cy, side)
                # From the edge down to the plane; rounding may not take it past the next edge.
                above = (
                    z
                    + begin * dz
                    - (corner + p * (x + begin * dx - ix) + q * (y + begin * dy - iy))
                )
                rate = dz - p * dx - q * dy
                t = min(max(begin - above / rate, begin), end) if rate < 0 else begin
                fx, fy = unit(x + t * dx - ix), unit(y + t * dy - iy)
                height = corner + p * fx + q * fy
                break
            start_side = -1
        t = out
        if tx <= ty:
            ix += step_x
            tx = (ix + ahead_x - x) / dx
            cx += step_x
            if cx == tile.columns:
                cx = 0
            elif cx < 0:
                cx = tile.columns - 1
        else:
            iy += step_y
            ty = (iy + ahead_y - y) / dy
            cy += step_y
            if cy == tile.rows:
                cy = 0
            elif cy < 0:
                cy = tile.rows - 1
    return met, cx, cy, fx, fy, p, q * tile.aspect, height, t
