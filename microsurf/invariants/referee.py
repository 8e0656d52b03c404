"""The same scene by a second engine: independent code, another precision, other traps.

Both trace the first realisation in independent runs, at each incidence. Albedos by order and
kind are compared by Welch's t. Lobes of order 1 are cut into regions of about equal light and
compared by Hotelling's T² of all regions together: their light is correlated, within a fan as
within a chain of mirrors, and the covariance of the runs knows that.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import special

from .. import memory, seeds
from ..errors import InputError
from ..results import detector
from ..scene import Scene
from ..stats import intervals
from ..surface import Heightfield
from ..trace import embree, engine, work_items
from ..trace.engine import AnyTile
from ..trace.kernels.state import ENDS, LOST
from ..trace.wavefront import FacetOptics, Tally
from . import false_alarms
from .invariant import Invariant
from .replicates import weighted

Array = NDArray[np.float64]

NAME = "second engine"
STATEMENT = "two engines that share no traversal see the same light on the first realisation"
RUNS = 32
"""Independent runs of each engine at each incidence: 62 degrees of freedom of a difference."""
PATHS = 2048
"""Of each run."""
RATE = 1e-6
"""Chance that engines that agree are said to differ, of one scene."""
_DARK = 1 / 16
"""At three drawn paths a run a twentieth of all runs have none, and their sum is near normal."""
_RINGS, _SIDES = 4, 3  # regions of a lobe: sets of rings, and of sectors

Beam = Callable[[float, float, int, np.random.Generator], Tally]
"""Traces so many paths from (θ, φ) in degrees."""


def second_engine(
    scene: Scene, surface: Heightfield | None, *, seed: int = 0, workers: int | None = None
) -> Invariant:
    """Trace a rough scene's first realisation by its own engine and by the other one.

    ``surface`` is that realisation, made from the scene if it is None; of two layers the interface.

    The other one is Embree, or the exact engine if the scene names Embree. Where it can't
    run the invariant holds, and its ``detail`` says that the second engine is absent and why.
    """
    chosen, other = pair(scene)
    facet = work_items.facet_optics(scene)
    try:
        if other == "embree" and not embree.installed():
            return _absent("embreex is not installed, which has no wheel for every machine")
        tiles = [_tile(scene, name, seed, surface) for name in (chosen, other)]
    except InputError as error:
        return _absent(str(error))
    beams = [beam_of(tile, facet) for tile in tiles]
    with ThreadPoolExecutor(workers or memory.cores()) as pool:
        return compare(
            (chosen, other),
            [_runs(pool, scene, beam, seed, k) for k, beam in enumerate(beams)],
            scene,
        )


def pair(scene: Scene) -> tuple[str, str]:
    """A scene's own engine, and its referee."""
    chosen = engine.engine_of(scene)
    return chosen, "exact" if chosen == "embree" else "embree"


def beam_of(tile: AnyTile, facet: FacetOptics) -> Beam:
    """Light on a tile."""
    return lambda theta, phi, paths, rng: engine.trace(tile, theta, phi, facet, paths, rng)


def _tile(scene: Scene, name: str, seed: int, surface: Heightfield | None) -> AnyTile:
    scene = replace(scene, accuracy=replace(scene.accuracy, engine=name))
    work_items.compiled(name, layered=scene.layers is not None)
    return work_items.Realisation(scene, seed, 0, surface).tile()


def _absent(why: str) -> Invariant:
    return Invariant(NAME, STATEMENT, 0.0, 0.0, "not compared", detail=f"absent: {why}")


def _runs(
    pool: ThreadPoolExecutor, scene: Scene, beam: Beam, seed: int, number: int
) -> dict[tuple[float, float], list[Tally]]:
    """Tallies of RUNS independent runs by incidence."""
    angles = list(product(scene.light.theta, scene.light.phi))

    def one(job: tuple[int, int]) -> Tally:
        angle, run = job
        rng = seeds.generator(seed, seeds.SECOND_ENGINE, number, angle, run)
        return beam(*angles[angle], PATHS, rng)

    jobs = list(product(range(len(angles)), range(RUNS)))
    tallies = list(pool.map(one, jobs))
    return {angle: tallies[k * RUNS : (k + 1) * RUNS] for k, angle in enumerate(angles)}


def compare(
    names: tuple[str, str],
    tallies: list[dict[tuple[float, float], list[Tally]]],
    scene: Scene,
) -> Invariant:
    """Decide from the runs of both engines."""
    n, kd = scene.material.n, max(scene.material.kd)
    z: list[float] = []
    figures: dict[str, float] = {}
    for angle in tallies[0]:
        where = f"θ = {angle[0]:g}°" + (f", φ = {angle[1]:g}°" * (len(scene.light.phi) > 1))
        light = [np.array([weighted(t, n, kd) for t in of[angle]]) for of in tallies]
        for name, of_quantity in _quantities(*light):
            z.append(of_quantity[0])
            key = f"{where}, {name}"
            values = dict(zip(names, of_quantity[1:], strict=False))
            figures |= {f"{key}: {engine}": value for engine, value in values.items()}
            figures[f"{key}: z"] = of_quantity[0]
        for engine_name, of in zip(names, tallies, strict=True):
            for cause in LOST:
                lost = sum(float(t.ended[ENDS.index(cause)]) for t in of[angle])
                sent = sum(t.light for t in of[angle])
                figures[f"{where}, lost, {cause}: {engine_name}"] = lost / sent
    if not z:
        return Invariant(NAME, STATEMENT, 0.0, 0.0, "neither engine sees any light", figures)
    return false_alarms.by_chance(
        NAME,
        STATEMENT,
        z,
        f"{names[0]} and {names[1]}, {RUNS} runs of {PATHS} paths each at each incidence: albedos "
        f"by order and kind at Kd = {kd:g} (Welch's t), lobes of order 1 in regions (Hotelling's "
        "T²)",
        figures,
        rate=RATE,
        among=f"one scene of {1 / RATE:.0e}",
    )


def _quantities(a: Array, b: Array) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Names; z and the values of both engines, for lobes z alone.

    ``a`` and ``b`` are light by run, order, kind, ring and sector.
    """
    albedos = [x.sum(axis=(3, 4)) for x in (a, b)]
    for first, last, kind in _compared_orders(*albedos):
        x, y = (of[:, first : last + 1, kind].sum(axis=1) for of in albedos)
        later = "+" if last + 1 == albedos[0].shape[1] else f" to {last + 1}" * (last > first)
        name = f"order {first + 1}{later} {detector.KINDS[kind]}"
        yield name, (float(false_alarms.between(x, y)), float(x.mean()), float(y.mean()))
    for kind, name in enumerate(detector.KINDS):
        if a[:, 0, kind].any() and b[:, 0, kind].any():
            yield f"order-1 {name} lobe", (lobes_apart(a[:, 0, kind], b[:, 0, kind]),)


def _compared_orders(a: Array, b: Array) -> list[tuple[int, int, int]]:
    """First and last order, and kind, of what is compared of albedos by run, order and kind.

    An order that one engine leaves dark in more than _DARK of its runs is compared together with
    the one before: one engine may draw rare paths where the other carries their weight, and
    from a few of them Welch's t does not know the variance.
    """
    compared = []
    for kind in range(a.shape[2]):
        bright_orders = np.flatnonzero((a + b)[:, :, kind].any(axis=0))
        last = int(bright_orders.max(initial=0))
        for first in reversed(range(last + 1)):
            light = [x[:, first : last + 1, kind].any(axis=1) for x in (a, b)]
            bright = min(np.count_nonzero(x) for x in light) >= (1 - _DARK) * len(a)
            if bright or (first == 0 and any(x.any() for x in light)):
                compared.append((first, last, kind))
                last = first - 1
    return sorted(compared)


def lobes_apart(a: Array, b: Array) -> float:
    """|z| of two lobes, each of shape (runs, rings, sectors), by Hotelling's T² of their regions.

    Rings are put together until each set holds an equal part of the light, sectors into
    forward, sideways and backward; regions that some run of both left dark are left out.
    """
    both = np.concatenate([a, b])
    along = both.sum(axis=(0, 2)).cumsum()
    ring = np.minimum((along / along[-1] * _RINGS * (1 - 1e-12)).astype(int), _RINGS - 1)
    middle = (detector.SECTOR_EDGES[:-1] + detector.SECTOR_EDGES[1:]) / 2 % 360
    side = (np.minimum(middle, 360 - middle) / 180 * _SIDES).astype(int)
    regions = np.zeros((len(both), _RINGS, _SIDES))
    for r, s in product(range(_RINGS), range(_SIDES)):
        regions[:, r, s] = both[:, ring == r][:, :, side == s].sum(axis=(1, 2))
    values = regions.reshape(len(both), -1)
    values = values[:, np.count_nonzero(values, axis=0) >= len(both) // 2]
    return hotelling(values[: len(a)], values[len(a) :])


def hotelling(a: Array, b: Array) -> float:
    """|z| as unlikely as Hotelling's T² of two samples, each of shape (runs, quantities)."""
    if a.shape[1] == 0:
        return 0.0
    dof = len(a) + len(b) - 2
    pooled = (np.cov(a.T) * (len(a) - 1) + np.cov(b.T) * (len(b) - 1)) / dof
    # Quantities that no run varies, such as a flat facet's, say nothing; nor do sums of others.
    values, vectors = np.linalg.eigh(np.atleast_2d(pooled))
    kept = values > 1e-12 * max(values.max(), 1e-300)
    count = int(kept.sum())
    if count == 0:
        return 0.0
    apart = (a.mean(axis=0) - b.mean(axis=0)) @ vectors[:, kept]
    t2 = float((apart**2 / values[kept]).sum() * len(a) * len(b) / (len(a) + len(b)))
    f = t2 * (dof - count + 1) / (dof * count)
    p = max(float(special.fdtrc(count, dof - count + 1, f)), 1e-300)
    return min(intervals.normal_of_tails(p), false_alarms.MOST)
