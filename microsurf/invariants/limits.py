"""What rough surfaces become when roughness or interface vanish."""

from collections.abc import Iterator
from concurrent.futures import Executor
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..model import predict
from ..physics import facet
from ..scene import Accuracy, Light, Material, Roughness, Scene
from ..surface import Heightfield, generate_surface
from ..trace import measure
from ..trace.engine import AUTO
from ..trace.wavefront import FacetOptics
from . import false_alarms
from .invariant import Invariant
from .replicates import FEATURES, features, heights_of, runs, tile_of

Array = NDArray[np.float64]

KD = 0.8
THETAS = (0.0, 30.0, 60.0, 80.0, 89.0)
RINGS = 1e-6
"""Of the light: how well a fan's shares know a ring, see `trace.kernels.lobe_fans`."""


def _scene(n: float, sigma: float, engine: str, thetas: tuple[float, ...] = THETAS) -> Scene:
    return Scene(
        material=Material(n, (KD,)),
        roughness=Roughness(8.0, (sigma,)),
        light=Light(thetas),
        accuracy=Accuracy(2000, engine=engine),
    )


def flat(seed: int, workers: int | None, engine: str = AUTO) -> Iterator[Invariant]:
    """A mesh without relief against closed forms, with an interface and without."""
    mesh = [Heightfield(np.zeros((16, 16)))]
    albedos, rings = [], []
    for n in (1.0, 1.33, 1.5, 2.4):
        scene = _scene(n, 0.0, engine)
        measured = measure(scene, mesh, seed=seed, workers=workers)
        expected = facet.albedo(np.cos(np.radians(THETAS)), n, KD)
        total = measured.microsurf.albedo(kd=KD).values.ravel()
        albedos.append(float(np.abs(total - expected).max()))
        rings.append(ring_gap(measured.flux.values, predict(scene, "flat").flux.values))
    yield Invariant(
        "flat limit",
        "a traced mesh with σ = 0 has the albedo of one facet, F + T·w",
        max(albedos[1:]),
        1e-12,
        "largest difference of albedos, n = 1.33, 1.5, 2.4, Kd = 0.8, θ = 0 to 89°; light is "
        "split, not drawn: rounding of the sums",
        {"largest difference of a ring's light": max(rings[1:])},
    )
    yield Invariant(
        "Lambertian limit",
        "with n = 1 and σ = 0 a traced mesh has the albedo Kd",
        albedos[0],
        1e-12,
        "largest difference from Kd = 0.8, θ = 0 to 89°; rounding of the sums",
        {"largest difference of a ring's light": rings[0]},
    )
    yield Invariant(
        "flat and Lambertian lobes",
        "each ring of a traced mesh with σ = 0 holds the light of T(μ) μ, of Kd/π at n = 1",
        max(rings),
        RINGS,
        "largest difference, of the light sent; the quadrature of a fan's shares",
    )


def ring_gap(measured: Array, predicted: Array) -> float:
    """Largest difference of the light of any ring: specular, and body at unit weight."""
    caps = [lobes[0, :, 0, 0, :2].sum(axis=-1) for lobes in (measured, predicted)]
    kinds = min(caps[0].shape[1], caps[1].shape[1])
    return float(np.abs(caps[0][:, :kinds] - caps[1][:, :kinds]).max())


def small_roughness(seed: int, workers: int | None, engine: str = AUTO) -> Invariant:
    """σ → 0 on explicit surfaces: what is left is second order."""
    thetas = (0.0, 30.0, 60.0)
    expected = facet.albedo(np.cos(np.radians(thetas)), 1.5, KD)
    figures = {}
    for sigma in (1e-2, 1e-3):
        mesh = [generate_surface(8.0, sigma, cells=64, seed=seed)]
        scene = _scene(1.5, sigma, engine, thetas)
        total = measure(scene, mesh, seed=seed, workers=workers).microsurf.albedo(kd=KD)
        figures[f"σ = {sigma:g}"] = float(np.abs(total.values.ravel() - expected).max())
    return Invariant(
        "σ → 0",
        "an explicit surface becomes one facet as σ → 0",
        max(figures["σ = 0.01"] / 1e-2, figures["σ = 0.001"] / 1e-3),
        0.02,
        "largest |albedo − flat| / σ at σ = 0.01 and 0.001, θ ≤ 60°, Kd = 0.8: a facet's tilt "
        "changes its albedo by |dT/dθ| (1 − w) σ < 0.13 σ, tilts are 0 in the mean, and 1000 rays "
        "leave 0.004 σ of that",
        figures,
    )


def small_interface(pool: Executor, seed: int, engine: str = AUTO) -> list[Invariant]:
    """n → 1: on an explicit surface by z, in the model by its rate."""
    heights = heights_of(generate_surface(2.0, 0.5, cells=64, seed=seed))
    tile = tile_of(heights, engine=engine)
    without = FacetOptics(1.0, interface=False, substrate=True, multiple_scattering=True)
    almost = FacetOptics(1 + 1e-9, interface=True, substrate=True, multiple_scattering=True)
    lobes = [
        # Half of a split light ray's paths are its mirrored ones.
        runs(
            pool, tile, (60.0, 0.0), of, 4000 * of.branches, (seed, 4, k),
            partial(features, n=of.n, kd=KD),
        )
        for k, of in enumerate((almost, without))
    ]  # fmt: skip
    by_rays = false_alarms.by_chance(
        "n → 1, traced",
        "with n = 1 + 1e−9 an explicit surface reflects as one without interface",
        false_alarms.between(*(x[:, 1:] for x in lobes)),
        f"{', '.join(FEATURES[1:])}; γ = 2, σ = 0.5, θ = 60°",
        {
            f"{name}: difference in %": 100 * float(a / b - 1)
            for name, a, b in zip(FEATURES[1:4], *(x[:, 1:4].mean(0) for x in lobes), strict=True)
        },
    )
    lambertian = _order_1(1.0)
    rates = {
        f"n = 1 + {step:g}": float(np.abs(_order_1(1 + step) - lambertian).max()) / step
        for step in (1e-2, 1e-3)
    }
    return [
        by_rays,
        Invariant(
            "n → 1, predicted",
            "the model's order-1 albedo goes to that of Lambertian facets as n → 1",
            max(rates.values()),
            5.0,
            "largest |Δ albedo| / (n − 1) at n − 1 = 0.01 and 0.001; F and 1 − r_i change by less "
            "than 5 (n − 1) in the mean over visible facets",
            rates,
        ),
    ]


def _order_1(n: float) -> Array:
    scene = Scene(
        material=Material(n, (KD,)), roughness=Roughness(2.0, (0.5,)), light=Light((0.0, 60.0))
    )
    albedos = predict(scene).microsurf.albedo_by_order(kd=KD)
    return np.asarray(albedos.sum(("order", "kind")).values)


def limits(pool: Executor, seed: int, workers: int | None, engine: str = AUTO) -> list[Invariant]:
    """All of them."""
    return [
        *flat(seed, workers, engine),
        small_roughness(seed, workers, engine),
        *small_interface(pool, seed, engine),
    ]
