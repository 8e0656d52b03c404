"""Pairs of surfaces of the atlas of the IL assumption, and what is kept of each trace."""

from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microsurf import measure
from microsurf.model import walk
from microsurf.results import detector
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface
from microsurf.surface.layers import layered_mesh

from ..checkpoint import LATEST, once

Array = NDArray[np.float64]

GAMMAS = (8.0, 2.0)
SIGMAS, INDICES = (0.5, 0.25), (1.5, 1.33, 2.0)
RATIOS = (0.0, 0.5, 1.0, 2.0)
"""σ of the substrate over that of the interface; 0 is a plane."""
CORRELATIONS = (1.0, 0.5, 0.0, -1.0)
GAPS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""In correlation lengths L of the interface."""
FAR_GAPS = (*GAPS[GAPS.index(1.0) :], 30.0)
"""Of independent pairs, against the theory of such pairs."""
THETAS, KDS = (0.0, 60.0, 80.0), (0.2, 0.5, 0.8, 1.0)
CELLS, LENGTH = 128, 8.0
REALISATIONS, SEED = 8, 19
PATHS, ALONE_PATHS = 24_000, 96_000
"""Paths of each angle and realisation: of two layers, and of the interface alone."""
WALK_RUNS, WALKS = 8, 100_000
"""Runs of the theory of two layers, and walks of each at an angle."""
KEPT = LATEST / "layers"

SUMS = ("total", "body_1", "back")
"""Albedo, its order-1 body, and body light sent back: θ_o > 45°, within 25° of the light's
azimuth. After them come the bins of the body lobe."""
_RINGS = np.searchsorted(detector.RING_EDGES, (0, 15, 31, 45, 61, 75))
_SECTORS = (0, 3, 6, 9, 12, 15)
_BACK = slice(3, 6), 0


@dataclass(frozen=True)
class Pair:
    """An interface of γ and σ, and a substrate of the same γ, ``ratio`` times its σ."""

    gamma: float
    sigma: float
    ratio: float
    correlation: float

    def scene(self, n: float, gap: float) -> Scene:
        """The scene at a gap in correlation lengths."""
        below = Substrate(
            self.gamma, (self.ratio * self.sigma,), correlation_with_interface=self.correlation
        )
        return Scene(
            material=Material(n, KDS),
            roughness=Roughness(self.gamma, (self.sigma,)),
            surface=Surface(cells=CELLS, correlation=LENGTH, realisations=REALISATIONS),
            light=Light(THETAS),
            accuracy=Accuracy(PATHS, engine="exact"),
            layers=Layers(gap * LENGTH, Substrate(shape="flat") if self.ratio == 0 else below),
        )

    @property
    def key(self) -> str:
        """Of files."""
        return f"{self.gamma:g}-{self.sigma:g}-{self.ratio:g}-{self.correlation:g}"


PAIRS = tuple(
    Pair(gamma, sigma, ratio, correlation)
    for sigma, gamma, ratio, correlation in product(SIGMAS, GAMMAS, RATIOS, CORRELATIONS)
    if ratio > 0 or correlation == 0
)


def statistics_of(pair: Pair) -> dict[str, Any]:
    """Gap that the surfaces need so as not to cross, and their correlations, by realisation."""
    return dict(once(KEPT / f"pair-{pair.key}.json", partial(_statistics, pair)))


def _statistics(pair: Pair) -> dict[str, list[float]]:
    far = 1e4
    rows = [layered_mesh(pair.scene(1.5, far), SEED, k).report() for k in range(REALISATIONS)]
    return {
        "needed_gap": [far - row["least_distance"] / LENGTH for row in rows],
        "height_correlation": [row["height_correlation"] for row in rows],
        "slope_correlation": [row["slope_correlation"] for row in rows],
    }


def possible(pair: Pair, gap: float) -> bool:
    """Whether no realisation's surfaces cross at this gap, in correlation lengths."""
    return bool(max(statistics_of(pair)["needed_gap"]) < gap - 1e-9)


def two_layers(pair: Pair, n: float, gap: float) -> Array:
    """What `kept` keeps of two layers."""
    return _traced(f"{pair.key}-{n:g}-{gap:g}", pair.scene(n, gap))


@cache
def alone(gamma: float, sigma: float, n: float) -> Array:
    """What `kept` keeps of IL facets on the interfaces of the same realisations."""
    scene = Pair(gamma, sigma, 1.0, 1.0).scene(n, 1.0)
    scene = replace(scene, layers=None, accuracy=replace(scene.accuracy, paths=ALONE_PATHS))
    return _traced(f"alone-{gamma:g}-{sigma:g}-{n:g}", scene)


@cache
def walked(pair: Pair, n: float) -> Array:
    """What `kept` keeps of walks in layers that know nothing of each other, WALK_RUNS of them."""

    def run() -> Any:
        scene = pair.scene(n, FAR_GAPS[-1])
        runs = [
            kept(walk(scene, "layered-walk", walks=WALKS, seed=k, workers=1))
            for k in range(WALK_RUNS)
        ]
        return np.round(np.concatenate(runs), 8).tolist()

    return np.array(once(KEPT / f"walk-{pair.key}-{n:g}.json", run))


def _traced(name: str, scene: Scene) -> Array:
    def trace() -> Any:
        return np.round(kept(measure(scene, seed=SEED, workers=1)), 8).tolist()

    return np.array(once(KEPT / f"{name}.json", trace))


def kept(measured: xr.Dataset) -> Array:
    """Light by realisation, θ_i, Kd, and SUMS before the coarse bins of the body lobe."""
    return np.stack([_of_kd(measured, kd) for kd in KDS], axis=2)


def _of_kd(measured: xr.Dataset, kd: float) -> Array:
    result = measured.microsurf
    albedos = [
        np.asarray(result.albedo(order, kind, kd=kd).isel(phi_i=0))
        for order, kind in ((None, None), (1, "body"))
    ]
    lobe = coarse(np.asarray(result.lobe(None, "body", kd=kd).isel(phi_i=0)))
    back = lobe[..., *_BACK].sum(-1)
    return np.concatenate(
        [np.stack([*albedos, back], -1), lobe.reshape(*lobe.shape[:-2], -1)], axis=-1
    )


def coarse(bins: Array) -> Array:
    """Sums over six rings and, both sides of the plane of incidence together, six sectors."""
    half = detector.SECTORS // 2
    folded = bins[..., : half + 1].copy()
    folded[..., 1:half] += bins[..., :half:-1]
    return np.add.reduceat(np.add.reduceat(folded, _RINGS, axis=-2), _SECTORS, axis=-1)


def projected_solid_angles() -> Array:
    """Of the coarse bins, in sr, one after the other."""
    bins = np.broadcast_to(detector.projected_solid_angles(), (detector.RINGS, detector.SECTORS))
    return coarse(bins).ravel()
