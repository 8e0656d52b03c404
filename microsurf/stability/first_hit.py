"""First triangle a ray meets, in float64 and by trying them all: what engines are held against."""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import closest_point

from ..trace.embree import EmbreeTile
from ..trace.exact import exact_tile
from ..trace.grid import MARGIN, Grid, from_heights, triangles
from ..trace.kernels.exact_first_hits import first_facets

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]

ROUNDINGS = 16
"""A ray moved by so many roundings of the tile's largest coordinate may meet another facet."""
FAR = 8.0
"""Cells between a ray's start and its target, at most."""
_CHUNK = 64  # rays at a time


def unexplained(
    engine: str, heights: Array, count: int, rng: np.random.Generator
) -> tuple[int, int]:
    """Of ``count`` rays: on how many an engine and float64 differ, and how many stay so.

    Rays go down to a point of a facet, every second one to its edge, from up to FAR cells
    away, at all angles; ``heights`` are of one period in cells. The exact engine knows no
    surface from below, nor where a period ends: its rays start above the surface, more than
    FAR cells from the period's border. Rays stay different if, moved by up to ROUNDINGS of the
    engine's precision along each axis, float64 never meets what the engine does, or a point
    as near to it as that: the back of a ridge's other side is met by float32 where float64
    meets the front.
    """
    grid = from_heights(heights, np.zeros(heights.shape, np.bool_))
    vertices, faces = triangles(grid)
    corners = vertices.astype(np.float64)[faces]
    exact = engine == "exact"
    origins, directions = _rays(grid, corners, count, rng, FAR + 1 if exact else 0.0)
    if exact:
        above = origins[:, 2] > _height_at(grid, origins)
        origins, directions = origins[above], directions[above]
    named = (by_exact if exact else by_embree)(grid, origins, directions)
    precision = 53 if exact else 24
    shift = ROUNDINGS * 2.0**-precision * grid.reach
    differ = np.flatnonzero(first_hit(corners, origins, directions)[0] != named)
    left = differ
    for move in product((0, 1, -1), repeat=3):
        moved = origins[left] + shift * np.array(move)
        facet, t = first_hit(corners, moved, directions[left])
        explained = facet == named[left]
        near = np.flatnonzero((facet >= 0) & (named[left] >= 0))
        point = moved[near] + t[near, None] * directions[left[near]]
        nearest = closest_point(corners[named[left[near]]], point)
        explained[near] |= np.linalg.norm(nearest - point, axis=1) <= 2 * shift
        left = left[~explained]
    return len(differ), len(left)


def by_embree(grid: Grid, origins: Array, directions: Array) -> Triangles:
    """Triangles that Embree meets."""
    rays = origins.astype(np.float32), directions.astype(np.float32)
    return EmbreeTile(grid).intersect(*rays).triangle.astype(np.int64)


def by_exact(grid: Grid, origins: Array, directions: Array) -> Triangles:
    """Triangles of the mesh that the exact walk meets; −1 for one beyond its margin."""
    inner = slice(MARGIN, -MARGIN)
    period = grid.heights[inner, inner][:-1, :-1].astype(np.float64)
    tile = exact_tile(period, np.ascontiguousarray(grid.flipped[inner, inner]))
    facet, point = np.empty(len(origins), np.int64), np.empty(origins.shape)
    corner = np.array([grid.x0 + MARGIN, grid.y0 + MARGIN, 0.0])
    first_facets(tile, origins - corner, directions, facet, point)
    cell, side = np.divmod(facet, 2)
    y, x = np.divmod(cell, grid.columns)
    t = (point[:, 2] - origins[:, 2]) / directions[:, 2]
    offset = origins + t[:, None] * directions - corner
    around = np.rint((offset - point)[:, :2] / [grid.columns, grid.rows]).astype(np.int64)
    i, j = x + around[:, 0] * grid.columns + MARGIN, y + around[:, 1] * grid.rows + MARGIN
    rows, columns = grid.flipped.shape
    here = (np.minimum(i, j) >= 0) & (i < columns) & (j < rows) & (facet >= 0)
    return np.where(here, 2 * (j * columns + i) + side, -1)


def _rays(
    grid: Grid, corners: Array, count: int, rng: np.random.Generator, inside: float
) -> tuple[Array, Array]:
    """Origins and directions that float32 holds, to points so far inside of the period."""
    y, x = np.divmod(np.arange(len(corners)) // 2, grid.flipped.shape[1])
    least = MARGIN + inside
    inner = (np.minimum(x, y) >= least) & (
        np.maximum(x - grid.columns, y - grid.rows) < 2 * MARGIN - least
    )
    chosen = corners[rng.choice(np.flatnonzero(inner), count)]
    share = rng.dirichlet(np.ones(3), count)
    share[::2, 1] += share[::2, 0]
    share[::2, 0] = 0
    target = np.einsum("rk,rkc->rc", share, chosen)
    cosine, azimuth = rng.random(count), 2 * np.pi * rng.random(count)
    sine = np.sqrt(1 - cosine**2)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -cosine], axis=1)
    origin = target - direction * (FAR * rng.random((count, 1)))
    return origin.astype(np.float32).astype(float), direction.astype(np.float32).astype(float)


def _height_at(grid: Grid, points: Array) -> Array:
    """Height of the surface under or over points of the mesh."""
    u, v = points[:, 0] - grid.x0, points[:, 1] - grid.y0
    i, j = u.astype(int), v.astype(int)
    u, v = u - i, v - j
    h = grid.heights.astype(np.float64)
    low, high = h[j, i], h[j + 1, i + 1]
    middle = np.where(u > v, h[j, i + 1], h[j + 1, i])
    return np.asarray(low + np.maximum(u, v) * (middle - low) + np.minimum(u, v) * (high - middle))


def first_hit(corners: Array, origins: Array, directions: Array) -> tuple[Triangles, Array]:
    """Triangle of shape (3, 3) each ray meets first, −1 for none, and the ray's parameter there.

    By Möller and Trumbore's formulas (1997).
    """
    first = corners[:, 0]
    edge_1, edge_2 = corners[:, 1] - first, corners[:, 2] - first
    triangles_hit, at = np.full(len(origins), -1, np.int64), np.full(len(origins), np.inf)
    for start in range(0, len(origins), _CHUNK):
        rows = slice(start, start + _CHUNK)
        d = directions[rows, None]
        normal = np.cross(d, edge_2)
        with np.errstate(divide="ignore", invalid="ignore"):  # of a ray along the triangle
            inverse = 1 / np.sum(normal * edge_1, axis=-1)
            away = origins[rows, None] - first
            u = np.sum(away * normal, axis=-1) * inverse
            across = np.cross(away, edge_1)
            v = np.sum(d * across, axis=-1) * inverse
            t = np.sum(edge_2 * across, axis=-1) * inverse
            met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)
        t = np.where(met, t, np.inf)
        at[rows] = np.min(t, axis=1)
        triangles_hit[rows] = np.where(np.isfinite(at[rows]), np.argmin(t, axis=1), -1)
    return triangles_hit, at
