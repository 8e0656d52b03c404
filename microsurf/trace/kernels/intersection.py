"""Where a ray is after a call of Embree, compiled: on a facet, out above, or round the period.

The hit is recomputed in float64 from its triangle and (u, v); the next ray starts
off the facet by a distance that scales with float32's rounding of the coordinates,
and far enough inside the triangle that this step stays above it: a heightfield has
nothing above its own triangle, so the new origin is above the surface.
"""

import numpy as np

from ...jit import inlined
from ..grid import MARGIN
from .empty_space import MOST_WRAPS, OFFSET, advance
from .state import BEHIND, BELOW, ORDER, RETRIES, WRAPPED, WRAPS

ON_FACET, ESCAPED, CONTINUES = -1, -2, -3
"""Statuses of a ray beside those of `rays.ENDS`: on a facet, out above, to go on as it was."""

_PASSES = 8 * 2.0**-23  # of the ray's length: as near float32 may take it to pass an edge
_BACK = 1e-6  # float32 directions may meet a grazed triangle from behind by this cosine
_AGAIN = 3  # times a ray that fell through an edge is sent again, from a little above


@inlined
def classify_ray(r, rays, hits, grid, frame, goes_on):
    """Where the r-th ray is after a call of Embree.

    Returns its status (`rays.ENDS` by index if it is lost, else MET, OUT or ON), whether it
    grazed a ridge, how often it was sent again; the facet's normal and the cosine to it;
    where it starts next, times round the period. See `reconstruct_hit` for ``goes_on``.
    """
    again, wraps = rays.state[r, RETRIES], rays.state[r, WRAPS]
    grazed = False
    mx = my = mz = mu = facing = 0.0
    if hits.triangle[r] < 0:
        status, px, py, pz, wraps = _onward(r, rays, grid, frame)
    else:
        mx, my, mz, mu, facing, grazed, px, py, pz = reconstruct_hit(
            r, rays, hits, grid, frame, goes_on
        )
        status = ON_FACET
        if grazed:
            status = CONTINUES
        elif facing < -_BACK:
            status = BEHIND
    if status in (BELOW, BEHIND) and again < _AGAIN:
        # Embree lets a ray through an edge, once in 1e9: from a little above it does not.
        # Above a heightfield nothing is in the way; light from the zenith steps aside.
        again += 1
        lift = again * 2.0**-20 * frame.reach
        aside = lift if rays.state[r, ORDER] == 0 else 0.0
        px, py = rays.origins[r, 0] + aside, rays.origins[r, 1] + 0.7 * aside
        pz = rays.origins[r, 2] + lift
        wraps = rays.state[r, WRAPS]
        status = CONTINUES
    return status, grazed, again, mx, my, mz, mu, px, py, pz, wraps


@inlined
def _corners(cell_x, cell_y, side, heights, flipped):
    """Corners of a triangle in the order of `grid.triangles`, and its slopes p, q."""
    h00, h10 = float(heights[cell_y, cell_x]), float(heights[cell_y, cell_x + 1])
    h01, h11 = float(heights[cell_y + 1, cell_x]), float(heights[cell_y + 1, cell_x + 1])
    if flipped[cell_y, cell_x]:
        if side == 0:
            return 0, 0, h00, 1, 0, h10, 0, 1, h01, h10 - h00, h01 - h00
        return 1, 0, h10, 1, 1, h11, 0, 1, h01, h11 - h01, h11 - h10
    if side == 0:
        return 0, 0, h00, 1, 0, h10, 1, 1, h11, h10 - h00, h11 - h10
    return 0, 0, h00, 1, 1, h11, 0, 1, h01, h11 - h01, h01 - h00


@inlined
def _edge(x, y, z):
    return np.sqrt(x * x + y * y + z * z)


@inlined
def _onward(r, rays, grid, frame):
    """A ray that met no triangle: out above, lost, or round the period.

    Returns its status, where it is now, times round the period.
    """
    dx, dz = rays.directions[r, 0], rays.directions[r, 2]
    dy = rays.directions[r, 1] * grid.aspect
    px, py = float(rays.origins[r, 0]), float(rays.origins[r, 1])
    pz = float(rays.origins[r, 2])
    wraps = rays.state[r, WRAPS]
    tx = ty = np.inf
    if dx != 0:
        tx = (frame.x0 + grid.flipped.shape[1] - px) / dx if dx > 0 else (frame.x0 - px) / dx
    if dy != 0:
        ty = (frame.y0 + grid.flipped.shape[0] - py) / dy if dy > 0 else (frame.y0 - py) / dy
    t = min(tx, ty)
    z = pz + t * dz if t < np.inf else np.copysign(np.inf, dz)
    if dz > 0 and z >= frame.top:
        return ESCAPED, px, py, pz, wraps
    if dz <= 0 and z < grid.bottom:
        return BELOW, px, py, pz, wraps
    if wraps >= MOST_WRAPS:
        return WRAPPED, px, py, pz, wraps
    # A little back, so that rounding leaves no gap between the two parts.
    t = max(0.0, t - (2.0**-19 * frame.reach + 2.0**-20 * t))
    px, py, pz = px + t * dx, py + t * dy, pz + t * dz
    if tx <= ty:
        px -= np.copysign(float(grid.columns), dx)
    else:
        py -= np.copysign(float(grid.rows), dy)
    ahead, px, py, pz, more = advance(
        px, py, pz, dx, dy, dz, grid.tops, grid.levels,
        frame.x0 + MARGIN, frame.y0 + MARGIN, grid.columns, grid.rows, frame.top, frame.reach,
    )  # fmt: skip
    wraps += 1 + more
    if ahead == 1:
        return ESCAPED, px, py, pz, wraps
    return WRAPPED if wraps >= MOST_WRAPS else CONTINUES, px, py, pz, wraps


@inlined
def reconstruct_hit(r, rays, hits, grid, frame, goes_on):
    """The facet a ray met: normal, cosine of incidence, that in cells, whether grazed, next start.

    The start is only found for a ray that ``goes_on`` from here, or grazed.
    """
    width = grid.flipped.shape[1]
    triangle = hits.triangle[r]
    cell, side = triangle // 2, triangle % 2
    cell_y, cell_x = cell // width, cell % width
    ax, ay, az, bx, by, bz, ex, ey, ez, p, q = _corners(
        cell_x, cell_y, side, grid.heights, grid.flipped
    )
    # Light sees the facet with its true normal; where rays start is found in cells.
    dx, dy, dz = rays.directions[r, 0], rays.directions[r, 1], rays.directions[r, 2]
    slope_y = q * grid.aspect
    length = np.sqrt(1 + p * p + slope_y * slope_y)
    mx, my, mz = -p / length, -slope_y / length, 1 / length
    mu = -(dx * mx + dy * my + dz * mz)
    dy *= grid.aspect
    length = np.sqrt(1 + p * p + q * q)
    nx, ny, nz = -p / length, -q / length, 1 / length
    facing = -(dx * nx + dy * ny + dz * nz) / np.sqrt(dx * dx + dy * dy + dz * dz)
    wb, we = float(hits.u[r]), float(hits.v[r])
    wa = 1 - wb - we
    grazed = False
    if facing < -_BACK:
        # The far side of a ridge, met where the ray passes its edge: distances in the
        # plane across the ray are heights of the triangle times |facing|.
        ox, oy, oz = rays.origins[r, 0], rays.origins[r, 1], rays.origins[r, 2]
        cx, cy = cell_x + frame.x0, cell_y + frame.y0
        far = 2 + np.sqrt((cx - ox) ** 2 + (cy - oy) ** 2 + (az - oz) ** 2)
        far *= _PASSES / (length * -facing)
        grazed = (
            wa < far * _edge(bx - ex, by - ey, bz - ez)
            or wb < far * _edge(ax - ex, ay - ey, az - ez)
            or we < far * _edge(ax - bx, ay - by, az - bz)
        )
    px = py = pz = 0.0
    if goes_on or grazed:
        # See the module's text.
        step = OFFSET * frame.reach * (abs(nx) + abs(ny) + abs(nz))
        inset = min(0.25, 2 * step * np.hypot(nx, ny) + 2.0**-22 * frame.reach)
        wa, wb, we = max(wa, inset), max(wb, inset), max(we, inset)
        total = wa + wb + we
        wa, wb, we = wa / total, wb / total, we / total
        px = (cell_x - MARGIN) % grid.columns + MARGIN + frame.x0
        py = (cell_y - MARGIN) % grid.rows + MARGIN + frame.y0
        px += wa * ax + wb * bx + we * ex + step * nx
        py += wa * ay + wb * by + we * ey + step * ny
        pz = wa * az + wb * bz + we * ez + step * nz
    return mx, my, mz, mu, facing, grazed, px, py, pz
