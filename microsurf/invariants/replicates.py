"""Independent runs over one mesh: what z-tests of the tracer are made of."""

from collections.abc import Callable
from concurrent.futures import Executor

import numpy as np
from numpy.typing import NDArray

from ..results import datasets, detector
from ..results.layers import event_weights
from ..surface import Heightfield, Mesh, mesh
from ..trace.engine import AUTO, AnyTile, trace
from ..trace.engine import tile_of as engines_tile
from ..trace.wavefront import FacetOptics, Tally

Array = NDArray[np.float64]

RUNS = 16
"""Independent runs of a configuration: 15 degrees of freedom of its variance."""
FEATURES = (
    "order-1 specular", "order-1 body", "orders 2+", "cosine", "forward", "sideways",
)  # fmt: skip
"""What two lots of runs are compared by: albedos, and moments of all light that leaves."""


def tile_of(heights: Array, *, flipped: bool = False, engine: str = AUTO) -> AnyTile:
    """An engine's tile of one period of heights in cells; ``flipped``: by the other diagonals."""
    return engines_tile(engine, Mesh(heights, np.full(heights.shape, flipped), 1.0))


def heights_of(surface: Heightfield) -> Array:
    """One period in cells."""
    return mesh(surface).heights


def differing(a: Array, b: Array) -> int:
    """How many numbers are not the same bits; all of them if there are more in one of both."""
    if a.shape != b.shape:
        return max(a.size, b.size)
    return int((a != b).sum())


def runs(
    pool: Executor,
    tile: AnyTile,
    light: tuple[float, float],
    facet: FacetOptics,
    paths: int,
    seed_words: tuple[int, ...],
    of_one: Callable[[Tally], Array],
) -> Array:
    """What ``of_one`` makes of each of RUNS tallies, shape (RUNS, …); seeded by ``seed_words``."""

    def run(number: int) -> Array:
        rng = np.random.default_rng((*seed_words, number))
        return of_one(trace(tile, float(light[0]), float(light[1]), facet, paths, rng))

    return np.array(list(pool.map(run, range(RUNS))))


def weighted(tally: Tally, n: float, kd: float) -> Array:
    """Light by order, kind (specular, body), ring and sector, as parts of what was sent."""
    energy = tally.energy / tally.light
    events = energy.shape[1]
    layered = len(tally.inside) > 0
    weights = event_weights(events, kd) if layered else datasets.body_weights(events, n, kd)
    body = np.einsum("obrs,b->ors", energy[:, 1:], weights[1:])
    return np.stack([energy[:, 0], body], axis=1)


def features(tally: Tally, n: float, kd: float) -> Array:
    """The FEATURES of a tally."""
    light = weighted(tally, n, kd)
    whole = light.sum((0, 1))
    azimuth = np.radians((detector.SECTOR_EDGES[:-1] + detector.SECTOR_EDGES[1:]) / 2)
    cosine = np.cos(np.radians(detector.ring_centres()))
    return np.array(
        [
            light[0, 0].sum(),
            light[0, 1].sum(),
            light[1:].sum(),
            cosine @ whole.sum(1),
            whole.sum(0) @ np.cos(azimuth),
            whole.sum(0) @ np.sin(azimuth),
        ]
    )
