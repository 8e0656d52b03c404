"""First triangle a ray meets, in float64 and by trying them all: what float32 is held against."""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import closest_point

from ..trace.embree import EmbreeTile
from ..trace.grid import MARGIN, Grid, triangles

Array = NDArray[np.float64]

ROUNDINGS = 16
"""A ray moved by so many roundings of the tile's largest coordinate may meet another facet."""
_CHUNK = 64  # rays at a time


def unexplained(grid: Grid, count: int, rng: np.random.Generator) -> tuple[int, int]:
    """Of ``count`` rays: on how many Embree and float64 differ, and how many stay so.

    Rays go down to a point of a facet of the period, every second one to its edge, from a
    few cells away, at all angles. They stay different if, moved by up to ROUNDINGS along
    each axis, float64 never meets what Embree does, or a point as near to it as that: the
    back of a ridge's other side is met by float32 where float64 meets the front.
    """
    vertices, faces = triangles(grid)
    corners = vertices.astype(np.float64)[faces]
    rays = _rays(grid, corners, count, rng)
    embree_triangles = EmbreeTile(grid).intersect(*rays).triangle
    origins, directions = (part.astype(np.float64) for part in rays)
    differ = np.flatnonzero(first_hit(corners, origins, directions)[0] != embree_triangles)
    shift = ROUNDINGS * 2.0**-24 * grid.reach
    left = differ
    for move in product((0, 1, -1), repeat=3):
        moved = origins[left] + shift * np.array(move)
        facet, t = first_hit(corners, moved, directions[left])
        explained = facet == embree_triangles[left]
        near = np.flatnonzero((facet >= 0) & (embree_triangles[left] >= 0))
        point = moved[near] + t[near, None] * directions[left[near]]
        nearest = closest_point(corners[embree_triangles[left[near]]], point)
        explained[near] |= np.linalg.norm(nearest - point, axis=1) <= 2 * shift
        left = left[~explained]
    return len(differ), len(left)


def _rays(
    grid: Grid, corners: Array, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    y, x = np.divmod(np.arange(len(corners)) // 2, grid.flipped.shape[1])
    inner = (np.minimum(x, y) >= MARGIN) & (x < grid.columns + MARGIN) & (y < grid.rows + MARGIN)
    chosen = corners[rng.choice(np.flatnonzero(inner), count)]
    share = rng.dirichlet(np.ones(3), count)
    share[::2, 1] += share[::2, 0]
    share[::2, 0] = 0
    target = np.einsum("rk,rkc->rc", share, chosen)
    cosine, azimuth = rng.random(count), 2 * np.pi * rng.random(count)
    sine = np.sqrt(1 - cosine**2)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -cosine], axis=1)
    origin = target - direction * (8 * rng.random((count, 1)))
    return origin.astype(np.float32), direction.astype(np.float32)


def first_hit(corners: Array, origins: Array, directions: Array) -> tuple[NDArray[np.int32], Array]:
    """Triangle of shape (3, 3) each ray meets first, −1 for none, and the ray's parameter there.

    By Möller and Trumbore's formulas (1997).
    """
    first = corners[:, 0]
    edge_1, edge_2 = corners[:, 1] - first, corners[:, 2] - first
    triangles_hit, at = np.full(len(origins), -1, np.int32), np.full(len(origins), np.inf)
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
