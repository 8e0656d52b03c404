"""How two layers approach both of their limits: IL facets when thin, a closed albedo when thick.

    python -m validation.layers.limits     # goes on where it was stopped

Writes reports/layers: thin.csv (same relief over itself: how fast body light approaches that of IL
facets as the gap closes), thick.csv (how far from the closed thick limit pairs stay, registered
ones among them), limits.md and the figure.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import optimize
from tqdm import tqdm

from microsurf import measure
from microsurf.cli.save import rounded, save
from microsurf.physics.thick_layers import thick_albedo
from microsurf.scene import Accuracy, Layers, Light, Material, Roughness, Scene, Substrate, Surface
from microsurf.stats import intervals
from microsurf.surface import Heightfield, layered_mesh

from ..checkpoint import once
from . import figures, text
from .cases import CELLS, KEPT, LENGTH, REALISATIONS, SEED, Pair, possible
from .measures import relative

Array = NDArray[np.float64]
Row = dict[str, Any]

OUT = Path(__file__).parents[2] / "reports" / "layers"
N = 1.5

THIN_GAPS = tuple(2.0**-k for k in range(6, 0, -1))
"""In correlation lengths."""
ASYMPTOTIC = 1 / 8
"""Gaps up to it are fitted."""
RESOLVED = 6.0
"""Standard errors that the difference at the last of them must have, half at the one before."""
THIN_THETAS, THIN_KDS = (75.0,), (0.1, 0.3, 0.8)
ALONE_PATHS = 4
"""Paths over IL facets for each of two layers: their noise is the same at every gap."""


@dataclass(frozen=True)
class Relief:
    """An interface over itself; ``length`` is L in cells, ``paths`` those of each realisation."""

    gamma: float
    sigma: float
    length: float = LENGTH
    paths: int = 96_000

    def scene(self, gap: float) -> Scene:
        """The scene at a gap in correlation lengths."""
        return Scene(
            material=Material(N, THIN_KDS),
            roughness=Roughness(self.gamma, (self.sigma,)),
            surface=Surface(
                cells=round(CELLS * self.length / LENGTH),
                correlation=self.length,
                realisations=REALISATIONS,
            ),
            light=Light(THIN_THETAS),
            accuracy=Accuracy(self.paths, engine="exact"),
            layers=Layers(gap * self.length, Substrate(shape="same")),
        )

    @property
    def key(self) -> str:
        """Of files."""
        return f"{self.gamma:g}-{self.sigma:g}-{self.length:g}-{self.paths}"


MANY_PATHS = 4_608_000
"""Where an exponent is fitted."""
RELIEFS = (
    Relief(8.0, 0.5, paths=MANY_PATHS),
    Relief(8.0, 0.25),
    Relief(2.0, 0.5, paths=MANY_PATHS),
    Relief(8.0, 0.5, 16.0),
)


def body(scene: Scene, name: str) -> Array:
    """Body light by realisation, θ_i and Kd, of all orders."""

    def trace() -> Any:
        measured = _measured(scene).microsurf
        by_kd = [measured.albedo(None, "body", kd=kd).isel(phi_i=0) for kd in THIN_KDS]
        return np.round(np.stack(by_kd, -1), 8).tolist()

    return np.array(once(KEPT / f"thin-{name}.json", trace))


def thin_light(relief: Relief) -> tuple[Array, Array]:
    """Body light of all gaps, of shape (gaps, realisations, θ_i, Kd), and of IL facets."""
    scene = relief.scene(1.0)
    facets = replace(
        scene, layers=None, accuracy=Accuracy(ALONE_PATHS * relief.paths, engine="exact")
    )
    layers = [body(relief.scene(gap), f"{relief.key}-{gap:g}") for gap in THIN_GAPS]
    return np.stack(layers), body(facets, f"{relief.key}-alone")


def fitted(layers: Array, facets: Array) -> tuple[float, float]:
    """Coefficient and exponent of the relative difference a xᵖ from gaps x ≤ ASYMPTOTIC.

    ``layers`` is of shape (gaps, realisations), ``facets`` (realisations,).
    """
    gaps = np.array([gap for gap in THIN_GAPS if gap <= ASYMPTOTIC])
    apart = layers[: len(gaps)].mean(1) / facets.mean() - 1

    def rest(parameters: Array) -> Array:
        return np.asarray(parameters[0] * gaps ** parameters[1] - apart)

    start = (apart[-1] / gaps[-1], 1.0)
    return tuple(float(x) for x in optimize.least_squares(rest, start).x)  # type: ignore[return-value]


def with_interval(layers: Array, facets: Array) -> tuple[Array, Array]:
    """Coefficient and exponent, and half of their 95 % intervals by the jackknife of surfaces."""
    count = len(facets)
    without = np.array(
        [fitted(np.delete(layers, k, 1), np.delete(facets, k)) for k in range(count)]
    )
    variance = (count - 1) / count * ((without - without.mean(0)) ** 2).sum(0)
    return np.array(fitted(layers, facets)), intervals.student(count - 1) * np.sqrt(variance)


def power_fit(layers: Array, facets: Array) -> Row:
    """`with_interval`, where the differences at the largest gaps are resolved, else nothing."""
    largest = THIN_GAPS.index(ASYMPTOTIC)
    for gap, least in ((largest, RESOLVED), (largest - 1, RESOLVED / 2)):
        percent, error = relative(layers[gap], facets)
        if abs(percent) <= least * error:
            return {"fitted": False}
    (a, p), (a_half, p_half) = with_interval(layers, facets)
    return {
        "fitted": True, "coefficient": float(a), "coefficient_half": float(a_half),
        "exponent": float(p), "exponent_half": float(p_half),
    }  # fmt: skip


def thin_rows() -> Iterator[Row]:
    """Of each relief, angle and Kd: differences by gap, and the power that fits the small ones."""
    for relief in tqdm(RELIEFS, "thin", disable=None):
        layers, facets = thin_light(relief)
        for (t, theta), (k, kd) in product(enumerate(THIN_THETAS), enumerate(THIN_KDS)):
            ones, other = layers[:, :, t, k], facets[:, t, k]
            row = {
                "gamma": relief.gamma, "sigma": relief.sigma, "length": relief.length,
                "theta_i": theta, "kd": kd,
            }  # fmt: skip
            for gap, one in zip(THIN_GAPS, ones, strict=True):
                row[f"gap_{gap:g}_percent"], row[f"gap_{gap:g}_se"] = relative(one, other)
            yield row | power_fit(ones, other)


THICK_GAPS = (2.0, 5.0, 10.0, 20.0, 50.0)
THICK_THETAS, KD = (0.0, 60.0, 80.0), 0.8
THICK_PATHS, NODE_PATHS, NODES = 48_000, 2_000, 24
INDEPENDENT = Pair(8.0, 0.5, 1.0, 0.0)
THICK_PAIRS = (
    INDEPENDENT,
    Pair(8.0, 0.5, 1.0, 1.0),
    Pair(8.0, 0.5, 0.5, 1.0),
    Pair(2.0, 0.5, 1.0, 1.0),
    Pair(2.0, 0.5, 0.5, 1.0),
)
FAR = 100.0


def _thick_scene(pair: Pair, gap: float, thetas: tuple[float, ...], paths: int) -> Scene:
    scene = replace(pair.scene(N, gap), material=Material(N, (KD,)))
    return replace(scene, light=Light(thetas), accuracy=Accuracy(paths, engine="exact"))


def hemisphere() -> tuple[float, ...]:
    """θ_i of equal parts of Lambertian light, at their middles."""
    middles = (np.arange(NODES) + 0.5) / NODES
    return tuple(np.degrees(np.arcsin(np.sqrt(middles))))


def _measured(scene: Scene) -> xr.Dataset:
    measured: xr.Dataset = measure(scene, seed=SEED, workers=1)
    return measured


def _albedo(measured: xr.Dataset, kd: float) -> Array:
    return np.asarray(measured.microsurf.albedo(kd=kd).isel(phi_i=0))


@cache
def interface(gamma: float) -> tuple[Array, Array]:
    """R by realisation and θ_i, and r_e′: light that a substrate far below never met."""
    pair = replace(INDEPENDENT, gamma=gamma)

    def trace(thetas: tuple[float, ...], paths: int) -> Any:
        return _albedo(_measured(_thick_scene(pair, FAR, thetas, paths)), 0.0).tolist()

    beams = [
        once(KEPT / f"interface-{gamma:g}-{theta:g}.json", partial(trace, (theta,), THICK_PATHS))
        for theta in THICK_THETAS
    ]
    diffuse = once(
        KEPT / f"interface-{gamma:g}-diffuse.json", partial(trace, hemisphere(), NODE_PATHS)
    )
    return np.concatenate(beams, 1), np.mean(diffuse, 1, keepdims=True)


@cache
def closed(pair: Pair) -> Array:
    """The thick limit of a pair by realisation and θ_i, from either of its surfaces alone."""

    def trace() -> Any:
        scene, whole = _thick_scene(pair, FAR, hemisphere(), NODE_PATHS), pair.scene(N, FAR)
        below = [
            Heightfield(layered_mesh(whole, SEED, k).substrate.heights, 1.0, "periodic")
            for k in range(REALISATIONS)
        ]
        facets = replace(scene, layers=None, material=Material(1.0, (KD,)))
        return _albedo(measure(facets, below, seed=SEED, workers=1), KD).mean(1).tolist()

    alone = np.array(once(KEPT / f"alone-{pair.key}.json", trace))[:, None]
    return np.asarray(thick_albedo(*interface(pair.gamma), alone, N))


def _thick(pair: Pair, gap: float, theta: float) -> Array:
    def trace() -> Any:
        scene = _thick_scene(pair, gap, (theta,), THICK_PATHS)
        return _albedo(_measured(scene), KD)[:, 0].tolist()

    return np.array(once(KEPT / f"thick-{pair.key}-{gap:g}-{theta:g}.json", trace))


def thick_rows() -> Iterator[Row]:
    """How far the total is from the thick limit."""
    far = [(pair, gap) for pair in THICK_PAIRS for gap in THICK_GAPS if possible(pair, gap)]
    for (pair, gap), (t, theta) in product(
        tqdm(far, "thick", disable=None), enumerate(THICK_THETAS)
    ):
        limit = closed(pair)[:, t]
        percent, error = relative(_thick(pair, gap, theta), limit)
        yield {
            "gamma": pair.gamma, "substrate_over_interface": pair.ratio,
            "correlation": pair.correlation, "gap_over_length": gap, "theta_i": theta, "kd": KD,
            "limit": float(limit.mean()), "percent": percent, "se": error,
        }  # fmt: skip


def main() -> None:
    """Trace what is not traced yet, then write."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    thin, thick = list(thin_rows()), list(thick_rows())
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {
        "thin.csv": rounded(thin, 3),
        "thick.csv": rounded(thick, 3),
        "limits.md": text.limits(thin, thick),
        "limits.png": figures.limits(thin, thick, 0.3),
    })  # fmt: skip


if __name__ == "__main__":
    main()
