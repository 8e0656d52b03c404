"""White furnaces: at Kd = 1 nothing is absorbed, so all light comes back.

Where the exit direction is *drawn* from the facet's BRDF a furnace closes by
construction and checks only that energy is conserved. The BRDF itself is checked by *evaluating*
it: f cosθ over directions that know nothing of it.
"""

from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

from ..model.directions import direction
from ..model.random_walk.evaluate import evaluate_walk
from ..model.random_walk.parameters import slope_parameters, stream, walk_facet
from ..model.random_walk.simulate import MOST_EVENTS, walk
from ..physics import facet, fresnel
from ..results import albedos
from ..scene import Accuracy, Light, Material, Roughness, Scene, Surface
from ..trace import measure
from ..trace.engine import AUTO
from . import false_alarms
from .invariant import Invariant
from .walk_furnace import furnace

Array = NDArray[np.float64]

INDICES = (1.0, 1.33, 1.5, 2.4)
THETAS = (0.0, 60.0, 89.0)
SLOPES = ((1.75, 0.5), (2.0, 0.5), (8.0, 1.0))
"""γ and σ."""
PATHS = 10_000
WALKS = 20_000
MIRROR = Material(1e-15, k=10.0)
"""A conductor whose F differs from 1 by less than 1e−15 away from grazing."""
_CLOSED = 1e-12


def explicit_scenes(engine: str = AUTO) -> Iterator[Scene]:
    """White scenes of every index and distribution, and perfect mirrors."""
    base = Scene(
        surface=Surface(cells=64, realisations=1),
        light=Light(THETAS),
        accuracy=Accuracy(PATHS, engine=engine),
    )
    for n, (gamma, sigma) in product(INDICES, SLOPES):
        yield replace(base, material=Material(n, (1.0,)), roughness=Roughness(gamma, (sigma,)))
    for gamma, sigma in SLOPES:
        yield replace(base, material=MIRROR, roughness=Roughness(gamma, (sigma,)))


def traced(seed: int, workers: int | None, engine: str = AUTO) -> Invariant:
    """Albedo + lost of explicit white surfaces."""
    gaps, lost, paths = [], 0.0, 0.0
    for scene in explicit_scenes(engine):
        measured = measure(scene, seed=seed, workers=workers)
        total = measured.microsurf.albedo(kd=scene.material.kd[0])
        away = albedos.lost_light(measured)
        gaps.append(float(np.abs(total.isel(realisation=0) + away - 1).max()))
        lost += float(measured.ended_paths.isel(cause=measured.lost.values).sum())
        paths += float(measured.paths.sum())
    return Invariant(
        "white furnace, traced",
        "albedo + lost = 1 at Kd = 1, and of a perfect mirror, on explicit surfaces",
        max(gaps),
        _CLOSED,
        f"largest |albedo + lost − 1|, n = {', '.join(f'{n:g}' for n in INDICES)}, three "
        "distributions of slopes, θ = 0, 60, 89°; rounding of the sums. By construction: checks "
        "that energy is conserved",
        {"paths": paths, "lost paths": lost},
    )


def walked(seed: int, workers: int | None) -> Invariant:
    """Albedo of white walks."""
    gaps = []
    for kind, n, (gamma, sigma) in product(("smith-walk", "vcavity-walk"), (1.0, 1.5), SLOPES):
        scene = Scene(
            material=Material(n, (1.0,)), roughness=Roughness(gamma, (sigma,)), light=Light(THETAS)
        )
        walks = walk(scene, kind, walks=PATHS, seed=seed, workers=workers)
        gaps.append(float(np.abs(walks.microsurf.albedo(kd=1.0) - 1).max()))
    return Invariant(
        "white furnace, walked",
        "albedo = 1 at Kd = 1 by both random walks, without a cap on events",
        max(gaps),
        _CLOSED,
        "largest |albedo − 1|, n = 1 and 1.5, three distributions of slopes, θ = 0, 60, 89°; "
        "rounding of the sums. By construction: checks that energy is conserved",
    )


def facet_gap(n: float, kd: float, cosine: float) -> float:
    """F + ∫ f_b cosθ_o dω_o by quadrature, minus the facet's albedo in closed form."""

    def ring(mu: float) -> float:
        return float(2 * np.pi * mu * facet.body(cosine, mu, n, kd))

    # T rises within √(n − 1) of grazing: a border there for n near 1.
    edge = min(np.sqrt((n - 1) * (n + 1)), 1.0)
    parts = [(0.0, edge), (edge, 1.0)] if 0 < edge < 1 else [(0.0, 1.0)]
    body = sum(quad(ring, *part, epsabs=0, epsrel=1e-13)[0] for part in parts)
    whole = float(fresnel.reflectance(cosine, n)) + body
    return float(np.abs(whole - facet.albedo(cosine, n, kd)))


def evaluated_facet() -> Invariant:
    """One facet's BRDF, integrated over the hemisphere."""
    cosines = np.cos(np.radians([0.0, 60.0, 85.0, 89.9]))
    cases = product((1.0, 1 + 1e-6, 1.5, 100.0), (1.0, 0.5), cosines)
    gaps = {case: facet_gap(*case) for case in cases}
    return Invariant(
        "white furnace, facet evaluated",
        "F + ∫ f_b cosθ dω = 1 at Kd = 1, and the albedo in closed form below",
        max(gaps.values()),
        _CLOSED,
        f"largest difference of {len(gaps)} facets, n = 1 to 100, Kd = 0.5 and 1, θ to 89.9°; "
        "quadrature to 1e−13",
        {f"Kd = {kd:g}": max(g for c, g in gaps.items() if c[1] == kd) for kd in (1.0, 0.5)},
    )


def evaluated_walk(pool: Executor, seed: int) -> Invariant:
    """The Smith walk's BRDF, evaluated in directions drawn without regard to it."""
    cases = list(product((1.0, 1.5, 2.4), SLOPES, (0.0, 60.0, 85.0)))

    def both(k: int) -> tuple[float, float]:
        n, parameters, theta = cases[k]
        rng = np.random.default_rng((seed, 3, k))
        values = [furnace_values(n, parameters, theta, WALKS, rng)]
        # Lambertian facets alone have lobes that uniform directions can find.
        values += [evaluated_lambertian(parameters, theta, WALKS, rng)] if n == 1 else []
        z = max((float(false_alarms.against(v, 1.0)) for v in values), key=abs)
        return z, float(values[0].mean() - 1)

    estimates = list(pool.map(both, range(len(cases))))
    worst = max(estimates, key=lambda pair: abs(pair[0]))
    return false_alarms.by_chance(
        "white furnace, walk evaluated",
        "∫ f cosθ dω = 1 at Kd = 1 over all orders, f by next-event evaluation of the Smith walk",
        # Of n = 1 the worse of two: as many comparisons again.
        [z for z, _ in estimates] + [0.0] * sum(case[0] == 1 for case in cases),
        f"n = 1, 1.5, 2.4, three distributions of slopes, θ = 0, 60, 85°, {WALKS} walks each; "
        "at n = 1 also over uniform directions by `evaluate_walk`",
        {
            "mean of all − 1 in %": 100 * float(np.mean([gap for _, gap in estimates])),
            "the worst − 1 in %": 100 * worst[1],
        },
    )


def furnace_values(
    n: float,
    parameters: tuple[float, float],
    theta: float,
    walks: int,
    rng: np.random.Generator,
    cap: int = MOST_EVENTS,
) -> Array:
    """∫ f cosθ dω by each of so many walks, see `invariants.walk_furnace`."""
    gamma, sigma = parameters
    scene = Scene(material=Material(n, (1.0,)), roughness=Roughness(gamma, (sigma,)))
    values = np.zeros(walks)
    i = direction(np.radians(theta), 0.0)
    furnace(
        values, i, slope_parameters(gamma, sigma, sigma), walk_facet(scene, 1.0), stream(rng), cap
    )
    return values


def evaluated_lambertian(
    parameters: tuple[float, float], theta: float, pairs: int, rng: np.random.Generator
) -> Array:
    """2π f cosθ_o of Lambertian facets at uniform directions o, two walks each."""
    gamma, sigma = parameters
    scene = Scene(material=Material(1.0, (1.0,)), roughness=Roughness(gamma, (sigma,)))
    cosine, azimuth = rng.random(pairs), 2 * np.pi * rng.random(pairs)
    o = direction(np.arccos(cosine), azimuth)
    i = np.broadcast_to(direction(np.radians(theta), 0.0), o.shape)
    mean, _ = evaluate_walk(scene, i, o, "smith-walk", 2, rng)
    return np.asarray(2 * np.pi * mean.total * cosine)


def furnaces(pool: Executor, seed: int, workers: int | None, engine: str = AUTO) -> list[Invariant]:
    """All of them."""
    return [
        traced(seed, workers, engine),
        walked(seed, workers),
        evaluated_facet(),
        evaluated_walk(pool, seed),
    ]
