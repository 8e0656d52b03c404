"""First facets of given rays by the exact walk, compiled."""

import numpy as np

from ...jit import compiled
from .exact_walk import sideways, walk
from .facet_scattering import mirror


@compiled
def first_facets(tile, origins, directions, facet, point):
    """Find what each ray meets first; rays start above the surface, anywhere, see `walk`.

    Fills the facets' numbers, 2c + side for cell c of the period, −1 for none, and the points
    where they are met, in the period.
    """
    for r in range(len(origins)):
        x, y, z = origins[r, 0], origins[r, 1], origins[r, 2]
        dx, dy, dz = sideways(directions[r, 0]), sideways(directions[r, 1]), directions[r, 2]
        ix, iy = int(np.floor(x)), int(np.floor(y))
        cx, cy = ix % tile.columns, iy % tile.rows
        side, cx, cy, fx, fy, _, _, height, _ = walk(
            tile, x - (ix - cx), y - (iy - cy), z, dx, dy, dz, 0.0, cx, cy, -1
        )
        facet[r] = -1 if side < 0 else 2 * (cy * tile.columns + cx) + side
        point[r, 0], point[r, 1], point[r, 2] = cx + fx, cy + fy, height


@compiled
def mirrored_light(tile, ray_origins, dx, dy, dz, facet, free):
    """Find what light meets first, and whether what a mirror there sends up meets nothing more.

    Rays start at ``ray_origins`` of the period, in the plane of the highest point.
    """
    dx, dy = sideways(dx), sideways(dy)
    for r in range(len(ray_origins)):
        x, y = ray_origins[r, 0], ray_origins[r, 1]
        cx, cy = min(int(x), tile.columns - 1), min(int(y), tile.rows - 1)
        side, cx, cy, fx, fy, p, q, z, _ = walk(tile, x, y, tile.top, dx, dy, dz, 0.0, cx, cy, -1)
        facet[r] = -1 if side < 0 else 2 * (cy * tile.columns + cx) + side
        free[r] = False
        length = np.sqrt(1 + p * p + q * q)
        mx, my, mz = -p / length, -q / length, 1 / length
        ox, oy, oz = mirror(dx, dy, dz, mx, my, mz, -(dx * mx + dy * my + dz * mz))
        if side >= 0 and oz > 0:
            side = walk(
                tile, cx + fx, cy + fy, z, sideways(ox), sideways(oy), oz, 0.0, cx, cy, side
            )[0]
            free[r] = side < 0


@compiled
def unblocked(tile, facets, points, dx, dy, dz, free):
    """Which rays from ``points`` on facets that look their way, all along one, meet nothing."""
    dx, dy = sideways(dx), sideways(dy)
    for r in range(len(points)):
        cell = facets[r] >> 1
        cx, cy = cell % tile.columns, cell // tile.columns
        x, y, z = points[r, 0], points[r, 1], points[r, 2]
        free[r] = walk(tile, x, y, z, dx, dy, dz, 0.0, cx, cy, facets[r] & 1)[0] < 0
