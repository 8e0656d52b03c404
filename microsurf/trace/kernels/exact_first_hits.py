"""First facets of given rays by the exact walk, compiled."""

import numpy as np

from ...jit import compiled
from .exact_walk import sideways, walk


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
