"""The incident beam: where paths start, in an order that keeps neighbours together."""

import numpy as np
from numpy.typing import NDArray

from .grid import MARGIN, Grid

_BITS = 26  # of each coordinate; what is finer is drawn uniformly
_MASKS = (
    (1, 0x3333333333333333),
    (2, 0x0F0F0F0F0F0F0F0F),
    (4, 0x00FF00FF00FF00FF),
    (8, 0x0000FFFF0000FFFF),
    (16, 0x00000000FFFFFFFF),
)


def light_direction(theta: float, phi: float) -> NDArray[np.float64]:
    """Unit vector towards the light, θ and φ in degrees, φ from +x."""
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def _even_bits(code: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Gather every second bit: one coordinate of a Morton code."""
    bits = code & np.uint64(0x5555555555555555)
    for shift, mask in _MASKS:
        bits = (bits | (bits >> np.uint64(shift))) & np.uint64(mask)
    return bits.astype(np.float64)


def stratified_points(
    paths: int, rng: np.random.Generator, part: int = 0, parts: int = 1
) -> NDArray[np.float64]:
    """Points of the unit square, shape (paths, 2): uniform, one in each 1/paths of a Morton curve.

    The curve preserves area, so any number of points is stratified, and neighbours
    on it are neighbours in the square: rays in this order find what they need in
    the cache. Of several ``parts`` each has its stretch of the curve.
    """
    along = (part + (np.arange(paths) + rng.random(paths)) / paths) / parts * 4.0**_BITS
    code = np.minimum(along, 4.0**_BITS - 1).astype(np.uint64)
    points = np.stack([_even_bits(code), _even_bits(code >> np.uint64(1))], axis=1)
    return np.asarray((points + rng.random((paths, 2))) * 0.5**_BITS)


def ray_origins(
    light: int, grid: Grid, rng: np.random.Generator, part: int, parts: int
) -> NDArray[np.float64]:
    """Where ``light`` rays start over one period, or one part of it, shape (light, 2)."""
    points = stratified_points(light, rng, part, parts) * (grid.columns, grid.rows)
    return np.add(points, (grid.x0 + MARGIN, grid.y0 + MARGIN))
