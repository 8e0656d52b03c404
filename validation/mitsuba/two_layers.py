"""Two explicit layers by Mitsuba, held against the exact engine.

    python -m validation.mitsuba.two_layers [--paths N]

Four pairs of surfaces, three incidences from φ = 0, Kd = 0.8, n = 1.5. Mitsuba has meshes of its
own, a `dielectric` over a `diffuse` one, Embree in float32, its own loop and random numbers; what
both share is the detector. Writes mitsuba.csv to reports/layers: by pair, incidence and figure
both albedos with their standard errors over BATCHES, the z of their difference, and the z where
Mitsuba's interface has n = 1.52, which must be seen. Wants what `renderer` wants; three minutes.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from microsurf.cli.save import rounded, save
from microsurf.results import detector
from microsurf.scene import Layers, Roughness, Scene, Substrate, Surface
from microsurf.stats.hypothesis_tests import sidak
from microsurf.stats.intervals import two_sided_p
from microsurf.surface.layers import LayeredMesh, layered_mesh
from microsurf.trace import layers
from microsurf.trace.wavefront import FacetOptics

from . import renderer

Array = NDArray[np.float64]

OUT = Path(__file__).parents[2] / "reports" / "layers"
N, KD, WRONG_N = 1.5, 0.8, 1.52
THETAS = (0.0, 60.0, 80.0)
BATCHES, PATHS = 16, 2**17
FIGURES = ("albedo", "order-1 specular", "rest")


def _scene(gamma: float, sigma: float, gap: float, substrate: Substrate) -> Scene:
    return Scene(
        roughness=Roughness(gamma, (sigma,)),
        surface=Surface(cells=128),
        layers=Layers(gap, substrate),
    )


PAIRS = {
    "γ 8, σ 0.5 over a plane": _scene(8.0, 0.5, 12.0, Substrate(shape="flat")),
    "the same surface twice, close": _scene(8.0, 0.5, 0.3, Substrate(shape="same")),
    "independent, γ 8 over γ 3": _scene(8.0, 0.5, 16.0, Substrate(3.0, (0.3,))),
    "γ 2, σ 0.3 over half as rough, ρ = 0.7": _scene(2.0, 0.3, 36.0, Substrate(2.0, (0.15,), 0.7)),
}


def pair_of(name: str) -> LayeredMesh:
    """Both surfaces of one of PAIRS, each pair with a seed of its own."""
    return layered_mesh(PAIRS[name], seed=1 + list(PAIRS).index(name), realisation=0)


def by_microsurf(pair: LayeredMesh) -> Callable[[float, int, int], Array]:
    """FIGURES of one batch by the exact engine: of θ in degrees, paths and a seed."""
    tile = layers.layered_tile(pair)
    optics = FacetOptics(N, interface=True, substrate=True, multiple_scattering=True, survival=KD)

    def batch(theta: float, paths: int, seed: int) -> Array:
        tally = layers.trace(tile, theta, 0.0, optics, paths, np.random.default_rng(seed))
        events = np.maximum(detector.BODY_EVENTS[: tally.energy.shape[1]] - 1, 0)
        light = tally.batches.sum(axis=0) / tally.light
        return _figures(float((light @ KD**events).sum()), float(light[0, 0]))

    return batch


def by_mitsuba(pair: LayeredMesh, n: float) -> Callable[[float, int, int], Array]:
    """FIGURES of one batch by Mitsuba, with an interface of index n."""
    tile = renderer.MitsubaTile.layered(pair, n, KD)

    def batch(theta: float, paths: int, seed: int) -> Array:
        flux = tile.trace(theta, paths, seed).flux.sum(axis=(-2, -1))
        return _figures(float(flux.sum()), float(flux[0, 0]))

    return batch


def _figures(albedo: float, mirrored: float) -> Array:
    return np.array([albedo, mirrored, albedo - mirrored])


def compare(name: str, theta: float, batches: int, paths: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one pair and incidence, a row for each of FIGURES."""
    pair = pair_of(name)
    sides = [by_microsurf(pair), by_mitsuba(pair, N), by_mitsuba(pair, WRONG_N)]
    draws = np.array([[side(theta, paths, seed + k) for k in range(batches)] for side in sides])
    means, errors = draws.mean(axis=1), draws.std(axis=1, ddof=1) / np.sqrt(batches)
    z, z_wrong = ((means[k] - means[0]) / np.hypot(errors[k], errors[0]) for k in (1, 2))
    return [
        {
            "pair": name, "theta_i": theta, "figure": figure,
            "microsurf": float(means[0, f]), "microsurf_se": float(errors[0, f]),
            "mitsuba": float(means[1, f]), "mitsuba_se": float(errors[1, f]),
            "z": float(z[f]), f"z_of_n_{WRONG_N:g}": float(z_wrong[f]),
        }
        for f, figure in enumerate(FIGURES)
    ]  # fmt: skip


def p_value(rows: list[dict[str, Any]], key: str, batches: int) -> float:
    """Of the family, by Student's t with the fewest degrees of freedom.

    Šidák's bound holds whatever the figures of one case have to do with each other.
    """
    return sidak([two_sided_p(row[key], batches - 1) for row in rows])


def said(rows: list[dict[str, Any]], batches: int) -> Iterator[str]:
    """What the rows say, a line for the right index and one for the wrong one."""
    for key in (key for key in rows[0] if key.startswith("z")):
        z = np.array([row[key] for row in rows])
        yield (
            f"{key}: {z.size} figures, root mean square {np.sqrt(np.mean(z**2)):.2f}, largest "
            f"{np.abs(z).max():.1f}, p = {p_value(rows, key, batches):.2g}\n"
        )


def main() -> None:
    """Compare all and write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--paths", type=int, default=PATHS, help="of a batch, a power of two")
    paths = parser.parse_args().paths
    rows = []
    for p, name in enumerate(PAIRS):
        for t, theta in enumerate(THETAS):
            rows += compare(name, theta, BATCHES, paths, 10_000 * p + 1000 * t)
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"mitsuba.csv": rounded(rows, 5)})
    sys.stdout.writelines(said(rows, BATCHES))


if __name__ == "__main__":
    main()
