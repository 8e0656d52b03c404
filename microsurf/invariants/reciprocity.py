"""Helmholtz reciprocity of an explicit surface: f(i, o) = f(o, i), tested without bias.

A detector bin is not a direction. But if light comes from all of patch A of the
hemisphere with density ∝ cosθ_i dω_i, and patch B is where it is detected,

    Ω(A) · flux(A → B) = ∫_A ∫_B f(i, o) cosθ_i cosθ_o dω_i dω_o = Ω(B) · flux(B → A),

with Ω = ∫ cosθ dω of a patch, exactly, for patches of any size. So nothing is said
about finite bins: patches are whole bins of the detector, in fixed azimuths, and each run
draws directions of light in its patch (scrambled Sobol points: unbiased, run by run).
"""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..results import detector
from ..surface import generate_surface
from ..trace.engine import AUTO, AnyTile, trace
from ..trace.wavefront import FacetOptics
from . import false_alarms
from .invariant import Invariant
from .replicates import RUNS, heights_of, tile_of, weighted

Array = NDArray[np.float64]

IL = FacetOptics(1.5, interface=True, substrate=True, multiple_scattering=True)
KD = 0.8
QUANTITIES = ("order-1 specular", "order-1 body", "orders 2+", "all")
DIRECTIONS = 16
PATHS = 2500
"""Of each direction: RUNS · DIRECTIONS · PATHS = 6.4e5 for each patch."""
WIDTH = 9
"""Sectors of a patch."""


@dataclass(frozen=True)
class Patch:
    """Rings ``first`` … ``last`` − 1 and nine sectors, a quadrant, about ``middle``."""

    first: int
    last: int
    middle: int

    @property
    def sectors(self) -> list[int]:
        """Numbers of its sectors."""
        return [(self.middle + k) % detector.SECTORS for k in range(-4, 5)]

    @property
    def size(self) -> float:
        """∫ cosθ dω in sr."""
        return float(detector.projected_solid_angles()[self.first : self.last].sum()) * WIDTH

    @property
    def name(self) -> str:
        """Where it is, in degrees."""
        low, high = detector.RING_EDGES[[self.first, self.last]]
        return f"θ {low:g}–{high:g}, φ {self.middle * 360 // detector.SECTORS}"

    def directions(self, rng: np.random.Generator) -> Array:
        """Directions (θ, φ) in degrees of density ∝ cosθ dω, shape (DIRECTIONS, 2)."""
        from scipy.stats import qmc  # noqa: PLC0415 - late: it takes 0.2 s to load

        points = qmc.Sobol(2, seed=rng).random(DIRECTIONS)
        low, high = np.sin(np.radians(detector.RING_EDGES[[self.first, self.last]])) ** 2
        theta = np.degrees(np.arcsin(np.sqrt(low + points[:, 0] * (high - low))))
        return np.stack([theta, (self.middle + (points[:, 1] - 0.5) * WIDTH) * 10.0], axis=1)


PATCHES = (Patch(5, 13, 0), Patch(15, 23, 31), Patch(24, 32, 13), Patch(36, 41, 22))
"""From steep to flat, so that what favours one of both adds up over pairs."""


def skewed(seed: int) -> Array:
    """Heights in cells of an anisotropic surface that no turn or mirror leaves as it is."""
    heights = heights_of(generate_surface(2.0, 0.4, 0.8, cells=64, seed=seed))
    return np.asarray(heights + 0.2 * heights**2 / heights.std())


def fluxes(
    pool: Executor,
    tile: AnyTile,
    facet: FacetOptics,
    seed_words: tuple[int, ...],
    paths: int = PATHS,
) -> Array:
    """Ω(A) · flux(A → B) by run, patch A, patch B and quantity."""

    def run(job: tuple[int, int]) -> Array:
        number, of = job
        rng = np.random.default_rng((*seed_words, number, of))
        light = np.zeros((len(detector.ORDERS), 2, detector.RINGS, detector.SECTORS))
        for theta, phi in PATCHES[of].directions(rng):
            tally = trace(tile, theta, phi, facet, paths, rng, azimuth=0.0)
            light += weighted(tally, facet.n, KD) / DIRECTIONS
        flux = np.array(
            [
                light[:, :, patch.first : patch.last][..., patch.sectors].sum((2, 3))
                for patch in PATCHES
            ]
        )
        parts = [flux[:, 0, 0], flux[:, 0, 1], flux[:, 1:].sum((1, 2)), flux.sum((1, 2))]
        return PATCHES[of].size * np.stack(parts, axis=-1)

    jobs = [(number, of) for number in range(RUNS) for of in range(len(PATCHES))]
    shape = (RUNS, len(PATCHES), len(PATCHES), len(QUANTITIES))
    return np.array(list(pool.map(run, jobs))).reshape(shape)


def judge(fluxes_by_pair: Array) -> Invariant:
    """Compare there and back for every pair of patches and every quantity."""
    pairs = list(combinations(range(len(PATCHES)), 2))
    there = _with_sum(np.stack([fluxes_by_pair[:, a, b] for a, b in pairs], axis=1))
    back = _with_sum(np.stack([fluxes_by_pair[:, b, a] for a, b in pairs], axis=1))
    return false_alarms.by_chance(
        "reciprocity of an explicit surface",
        "f(i, o) = f(o, i): light from one patch of the hemisphere to another, over their "
        "projected solid angles, is the same in both directions",
        false_alarms.between(there, back),
        f"{len(pairs)} pairs of patches and all together by {', '.join(QUANTITIES)}; n = 1.5, "
        f"Kd = {KD}, a skewed anisotropic surface (γ = 2, σ = 0.4 and 0.8); exact for finite "
        "patches",
        _figures(there, back),
    )


def _with_sum(fluxes: Array) -> Array:
    """Pairs, and all of them together as one more."""
    return np.concatenate([fluxes, fluxes.sum(axis=1, keepdims=True)], axis=1)


def _figures(there: Array, back: Array) -> Mapping[str, float]:
    """Relative difference of each pair and of all, with its standard error, in %."""
    figures = {}
    names = [f"{a.name} ↔ {b.name}" for a, b in combinations(PATCHES, 2)]
    mean = (there.mean(axis=0) + back.mean(axis=0)) / 2
    gap = 100 * (there.mean(axis=0) - back.mean(axis=0)) / mean
    error = 100 * np.sqrt((there.var(axis=0, ddof=1) + back.var(axis=0, ddof=1)) / len(there))
    for q, quantity in enumerate(QUANTITIES):
        for k, name in enumerate([*names, "all pairs"]):
            figures[f"{quantity}, {name}: difference in %"] = float(gap[k, q])
            figures[f"{quantity}, {name}: standard error in %"] = float(error[k, q] / mean[k, q])
    return figures


def reciprocity(pool: Executor, seed: int, engine: str = AUTO) -> list[Invariant]:
    """Trace from each patch and judge."""
    return [judge(fluxes(pool, tile_of(skewed(seed), engine=engine), IL, (seed, 1)))]
