"""First facet met by a ray, by walking over the grid in float64: Embree's independent peer.

Above its projection on the plane the surface is a continuous, piecewise linear function
s(t) of the ray's parameter, broken where the projection crosses a side or the diagonal of
a cell. The walk visits these breaks one after the other and takes the *clearance*
g(t) = o_z + t d_z − s(t) at each, once, from the two heights at the ends of the crossed
edge. Both neighbours of the edge use that number: where g changes its sign between two
breaks the ray is in that triangle, and a ray that was above and is below has changed it
somewhere. So nothing can fall between two triangles, whatever the rounding.

A ray that starts below meets the back of a triangle, where g rises to zero, as in Embree;
the tracer calls such a path lost ("behind") unless it is a graze. Touching is hitting:
g = 0 at a break or at the start is a hit there, also for a ray that lies in the facet,
which Embree passes by. A ray that comes in from the tile's side below the surface is below.

Slow and simple on purpose; nothing is shared with `trace` but the layout of `Grid`.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from microsurf.trace.embree import Hits
from microsurf.trace.grid import Grid

Array = NDArray[np.float64]
Rays = NDArray[np.float64] | NDArray[np.float32]


@dataclass(frozen=True)
class ExactHits:
    """First triangle met by each ray in float64, each array of shape (rays,).

    Its number as in `grid.triangles`, −1 for none; the ray's parameter t, ∞ for none; the
    weights u, v of the triangle's second and third vertex.
    """

    triangle: NDArray[np.int32]
    t: Array
    u: Array
    v: Array


class GridWalk:
    """A tile for `trace.wavefront.trace`, in the place of `EmbreeTile`."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._heights = grid.heights.astype(np.float64)

    def first_hits(self, origins: Rays, directions: Rays) -> ExactHits:
        """Find the first hit of each ray, t ≥ 0; shapes (rays, 3), directions not zero."""
        count = len(origins)
        found = ExactHits(
            np.empty(count, np.int32), np.empty(count), np.empty(count), np.empty(count)
        )
        _first_hits(
            self._heights, self.grid.flipped, self.grid.x0, self.grid.y0,
            np.asarray(origins, np.float64), np.asarray(directions, np.float64),
            found.triangle, found.t, found.u, found.v,
        )  # fmt: skip
        return found

    def intersect(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> Hits:
        """Answer as `EmbreeTile.intersect` does: the same rays, only u and v rounded."""
        found = self.first_hits(origins, directions)
        return Hits(found.triangle, found.u.astype(np.float32), found.v.astype(np.float32))


@njit(cache=True, nogil=True)
def _first_hits(heights, flipped, x0, y0, origins, directions, triangle, t, u, v):  # noqa: ANN001, ANN202
    """Fill the last four arrays, ray by ray."""
    for r in range(len(origins)):
        cx, cy, side, t[r], fx, fy = _walk(
            heights, flipped, origins[r, 0] - x0, origins[r, 1] - y0, origins[r, 2],
            directions[r, 0], directions[r, 1], directions[r, 2],
        )  # fmt: skip
        triangle[r], u[r], v[r] = -1, 0.0, 0.0
        if side >= 0:
            triangle[r] = 2 * (cy * flipped.shape[1] + cx) + side
            u[r], v[r] = _weights(flipped[cy, cx], side, fx, fy)


@njit(cache=True, nogil=True)
def _walk(heights, flipped, x, y, z, dx, dy, dz):  # noqa: ANN001, ANN202
    """Cell, side (−1 for none), t and place in the cell of the first hit.

    x and y count cells from the first vertex. In a cell the place is (fx, fy), each 0 … 1.
    """
    rows, columns = flipped.shape
    begin_x, end_x = _inside(x, dx, columns)
    begin_y, end_y = _inside(y, dy, rows)
    t = max(0.0, begin_x, begin_y)
    if t > min(end_x, end_y):
        return 0, 0, -1, np.inf, 0.0, 0.0
    fx, fy = min(max(x + t * dx, 0.0), columns), min(max(y + t * dy, 0.0), rows)
    cx, cy = min(int(fx), columns - 1), min(int(fy), rows - 1)
    fx, fy = fx - cx, fy - cy
    side = int(_beside(flipped[cy, cx], fx, fy) < 0)
    g = z + t * dz - _plane(heights, flipped[cy, cx], side, cx, cy, fx, fy)
    if g == 0 or (dx == 0 and dy == 0):
        meets = g == 0 or g * dz < 0
        t = t - g / dz if g != 0 else t
        return cx, cy, side if meets else -1, t if meets else np.inf, fx, fy
    while 0 <= cx < columns and 0 <= cy < rows:
        out, gx, gy, s, step_x, step_y = _way_out(heights, x, y, dx, dy, cx, cy, t)
        g_out = z + out * dz - s
        before, after = _beside(flipped[cy, cx], fx, fy), _beside(flipped[cy, cx], gx, gy)
        side = int(before + after < 0)
        if before * after < 0:
            share = before / (before - after)
            middle = t + share * (out - t)
            mx, my = fx + share * (gx - fx), fy + share * (gy - fy)
            g_middle = z + middle * dz - _diagonal(heights, flipped[cy, cx], cx, cy, mx)
            if g * g_middle <= 0:
                share = g / (g - g_middle)
                t += share * (middle - t)
                return cx, cy, int(before < 0), t, fx + share * (mx - fx), fy + share * (my - fy)
            t, g, fx, fy, side = middle, g_middle, mx, my, int(after < 0)
        if g * g_out <= 0:
            share = g / (g - g_out)
            t += share * (out - t)
            return cx, cy, side, t, fx + share * (gx - fx), fy + share * (gy - fy)
        t, g = out, g_out
        fx, fy = gx - step_x, gy - step_y
        cx, cy = cx + step_x, cy + step_y
    return 0, 0, -1, np.inf, 0.0, 0.0


@njit(cache=True, nogil=True)
def _way_out(heights, x, y, dx, dy, cx, cy, t):  # noqa: ANN001, ANN202
    """t, place and height of the surface where the ray leaves the cell, and the step it takes."""
    tx = (cx + (dx > 0) - x) / dx if dx != 0 else np.inf
    ty = (cy + (dy > 0) - y) / dy if dy != 0 else np.inf
    out = max(min(tx, ty), t)
    if tx <= ty:
        i = cx + (dx > 0)
        gy = min(max(y + out * dy - cy, 0.0), 1.0)
        s = _between(heights[cy, i], heights[cy + 1, i], gy)
        return out, (1.0 if dx > 0 else 0.0), gy, s, (1 if dx > 0 else -1), 0
    j = cy + (dy > 0)
    gx = min(max(x + out * dx - cx, 0.0), 1.0)
    s = _between(heights[j, cx], heights[j, cx + 1], gx)
    return out, gx, (1.0 if dy > 0 else 0.0), s, 0, (1 if dy > 0 else -1)


@njit(cache=True, nogil=True)
def _diagonal(heights, flip, cx, cy, fx):  # noqa: ANN001, ANN202
    """Height on the diagonal of a cell."""
    if flip:
        return _between(heights[cy + 1, cx], heights[cy, cx + 1], fx)
    return _between(heights[cy, cx], heights[cy + 1, cx + 1], fx)


@njit(cache=True, nogil=True)
def _inside(x, dx, cells):  # noqa: ANN001, ANN202
    """First and last t at which 0 ≤ x + t dx ≤ cells."""
    if dx == 0:
        return (-np.inf, np.inf) if 0 <= x <= cells else (np.inf, -np.inf)
    a, b = -x / dx, (cells - x) / dx
    return min(a, b), max(a, b)


@njit(cache=True, nogil=True)
def _between(a, b, share):  # noqa: ANN001, ANN202
    """Height on an edge; exactly a at 0 and b at 1."""
    return (1 - share) * a + share * b


@njit(cache=True, nogil=True)
def _beside(flip, fx, fy):  # noqa: ANN001, ANN202
    """Positive in triangle 0, negative in triangle 1, zero on the diagonal."""
    return 1 - fx - fy if flip else fx - fy


@njit(cache=True, nogil=True)
def _weights(flip, side, fx, fy):  # noqa: ANN001, ANN202
    """Weights of the second and third vertex, in the order of `grid.triangles`."""
    if flip:
        return (fx, fy) if side == 0 else (fx + fy - 1, 1 - fx)
    return (fx - fy, fy) if side == 0 else (fx, fy - fx)


@njit(cache=True, nogil=True)
def _plane(heights, flip, side, cx, cy, fx, fy):  # noqa: ANN001, ANN202
    """Height of a triangle's plane."""
    h00, h10 = heights[cy, cx], heights[cy, cx + 1]
    h01, h11 = heights[cy + 1, cx], heights[cy + 1, cx + 1]
    if flip:
        if side == 0:
            return h00 + fx * (h10 - h00) + fy * (h01 - h00)
        return h11 + (1 - fx) * (h01 - h11) + (1 - fy) * (h10 - h11)
    if side == 0:
        return h00 + fx * (h10 - h00) + fy * (h11 - h10)
    return h00 + fx * (h11 - h01) + fy * (h01 - h00)
