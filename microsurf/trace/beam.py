"""The incident beam: where paths start, in an order that keeps neighbours together."""

import numpy as np
from numpy.typing import NDArray

from .grid import MARGIN, Grid
from .wave import BATCHES

_BITS = 26  # of each coordinate; what is finer is drawn uniformly
_MASKS = (
    (1, 0x3333333333333333),
    (2, 0x0F0F0F0F0F0F0F0F),
    (4, 0x00FF00FF00FF00FF),
    (8, 0x0000FFFF0000FFFF),
    (16, 0x00000000FFFFFFFF),
)


def direction(theta: float, phi: float) -> NDArray[np.float64]:
    """Unit vector towards the light, θ and φ in degrees, φ from +x."""
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def _even_bits(code: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Gather every second bit: one coordinate of a Morton code."""
    bits = code & np.uint64(0x5555555555555555)
    for shift, mask in _MASKS:
        bits = (bits | (bits >> np.uint64(shift))) & np.uint64(mask)
    return bits.astype(np.float64)


def stratified_points(paths: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Points of the unit square, shape (paths, 2): uniform, one in each 1/paths of a Morton curve.

    The curve preserves area, so any number of points is stratified, and neighbours
    on it are neighbours in the square: rays in this order find what they need in
    the cache.
    """
    along = (np.arange(paths) + rng.random(paths)) / paths * 4.0**_BITS
    code = np.minimum(along, 4.0**_BITS - 1).astype(np.uint64)
    points = np.stack([_even_bits(code), _even_bits(code >> np.uint64(1))], axis=1)
    return np.asarray((points + rng.random((paths, 2))) * 0.5**_BITS)


def beam(
    theta: float, phi: float, light: int, grid: Grid, rng: np.random.Generator, *, turn: bool
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Where ``light`` rays start over one period, and from where they come.

    They come in BATCHES, each stratified over all of the period and independent of the
    others. With ``turn`` each has its own azimuth, φ degrees from one that is drawn at
    random within its share of the circle.

    Returns
    -------
    starts : ndarray, shape (light, 2)
        Points in the plane above the tile.
    batch : ndarray of int, shape (light,)
        Which batch each belongs to.
    incident : ndarray, shape (BATCHES, 3)
        Directions down, one for each batch.
    azimuths : ndarray, shape (BATCHES,)
        φ of each in degrees.

    """
    starts = stratified_points(light, rng) * (grid.columns, grid.rows)
    starts += (grid.x0 + MARGIN, grid.y0 + MARGIN)
    azimuths = np.full(BATCHES, phi)
    if turn:
        azimuths += (np.arange(BATCHES) + rng.random(BATCHES)) * 360 / BATCHES
    incident = np.stack([-direction(theta, azimuth) for azimuth in azimuths])
    return starts, np.arange(light) % BATCHES, incident, azimuths
