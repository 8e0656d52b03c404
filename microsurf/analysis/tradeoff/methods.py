"""The methods: every way of getting a reflectance, run and timed alike.

Time is that of the processor, of all threads together, so that a method that uses two cores
is not cheaper for it. Of several angles it is the mean for one.
"""

import hashlib
import time
import tracemalloc
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ... import memory, model, seeds
from ...results import datasets, detector
from ...scene import CORRELATIONS, Scene, Surface
from ...trace import engine, measure
from ..stages import Stages
from .effort import TradeoffEffort

Array = NDArray[np.float64]
T = TypeVar("T")

Place = tuple[float, float, float]
"""θ_i, φ_i in degrees and Kd."""

AVERAGED = (1, 4)
"""Surfaces that an explicit method averages."""
_AT_A_TIME = 2  # surfaces traced in one go: both cores are busy
_PAIRS = 64  # directions that evaluations are timed with
_MOST_WALKS = 100_000  # of all pairs together, but for one pair


@dataclass(frozen=True)
class Draws:
    """What some draws say of one place: first axis the draw.

    albedo, shape (K, 1); energies in the bins, shape (K, bins): specular, of light without
    body events, and lobe, of the other.
    """

    albedo: Array
    specular: Array
    lobe: Array


@dataclass(frozen=True)
class Method:
    """A way of getting a reflectance, the mean of ``averaged`` draws; ``draws`` are made.

    tier : 0 takes about 0.1 s an angle or less, 1 seconds, 2 makes surfaces.
    model : one of `model.registry`, of all orders with ``walks``; or "surface".
    """

    name: str
    tier: int
    model: str
    walks: int = 0
    surface: Surface | None = None
    paths: int = 0
    draws: int = 1
    averaged: int = 1


@dataclass(frozen=True)
class Run:
    """A method's draws by place, seconds an angle of each repeat, and one f(i, o); bytes at most.

    ``evaluation`` is None for a surface, which has no such thing. ``bytes_basis`` is
    "measured" (of numpy's arrays) or "estimated" (of surfaces and what rays need of them).
    """

    method: Method
    draws: Mapping[Place, Draws]
    seconds: tuple[float, ...]
    evaluation: float | None = None
    bytes: int = 0
    bytes_basis: str = ""


def methods_of(scene: Scene, effort: TradeoffEffort) -> list[Method]:
    """All methods of a scene, about from cheap to expensive; one of a flat scene."""
    if not scene.requires.roughness:
        return [Method("flat", 0, "flat")]
    single = [model.MODELS[key] for key in model.order_one()]
    methods = [Method(entry.key, 0, entry.key) for entry in single if not entry.quadrature]
    methods += [
        Method(_walk_name(kind, walks), int(walks > _MOST_WALKS), kind, walks, draws=draws)
        for walks, draws in effort.walks
        for kind in model.all_orders()
    ]
    methods += [Method(entry.key, 1, entry.key) for entry in single if entry.quadrature]
    for factor, paths, draws in effort.meshes:
        mesh = mesh_of(scene, factor)
        methods += [
            Method(
                f"{averaged} × {mesh.cells}² L {mesh.correlation:g} {paths} rays",
                2, "surface", surface=mesh, paths=paths, draws=draws, averaged=averaged,
            )
            for averaged in AVERAGED
        ]  # fmt: skip
    return list(dict.fromkeys(sorted(methods, key=lambda method: method.tier)))


def _walk_name(kind: str, walks: int) -> str:
    return f"{kind} {walks:.0e}".replace("e+0", "e")


def mesh_of(scene: Scene, factor: float) -> Surface:
    """The scene's tile with another number of cells for each correlation length."""
    cells = max(round(scene.surface.cells * factor), 2)
    length = scene.surface.correlation * cells / scene.surface.cells
    return replace(scene.surface, cells=cells, correlation=max(length, CORRELATIONS[0]))


def run_all(
    scene: Scene,
    methods: list[Method],
    seed: int,
    *,
    full: bool = True,
    stages: Stages | None = None,
) -> Iterator[Run]:
    """Run methods one after the other; those of the same surfaces share them.

    ``full`` times evaluations and repeats, and measures memory, besides. ``stages``: where
    finished methods are kept and found; nowhere without it.
    """
    stages = stages or Stages()
    traced: dict[tuple[Surface | None, int], Run] = {}
    for k, method in enumerate(methods):
        if method.model == "surface":
            key = method.surface, method.paths
            if key not in traced:
                work = partial(_surfaces, scene, method, _seed(seed, 100 + k))
                traced[key] = stages.done(_stage(method), work)
            of_one = traced[key]
            seconds = tuple(method.averaged * s for s in of_one.seconds)
            yield replace(of_one, method=method, seconds=seconds)
        elif method.walks:
            work = partial(_walks, scene, method, _seed(seed, k), full=full)
            yield stages.done(_stage(method), work)
        else:
            yield stages.done(_stage(method), partial(_model, scene, method, full=full))


def _stage(method: Method) -> str:
    """What the stage of a method is called."""
    return f"method-{hashlib.sha256(repr(method).encode()).hexdigest()[:16]}"


def draws_of(dataset: xr.Dataset, scene: Scene) -> dict[Place, Draws]:
    """Albedo, specular and body lobe of all orders, for each realisation of a result."""
    flux = dataset.flux.sum("order")
    draws = {}
    for kd in scene.material.kd:
        kinds = datasets.by_kind(flux, scene.material.n, kd)
        specular, body = (kinds.sel(kind=kind, drop=True) for kind in detector.KINDS)
        for (t, theta), (p, phi) in product(
            enumerate(scene.light.theta), enumerate(scene.light.phi)
        ):
            lobes = [
                np.asarray(v.isel(theta_i=t, phi_i=p).values).reshape(v.sizes["realisation"], -1)
                for v in (specular, body)
            ]
            total = lobes[0].sum(axis=1) + lobes[1].sum(axis=1)
            draws[theta, phi, kd] = Draws(total[:, None], *lobes)
    return draws


def joined(parts: list[dict[Place, Draws]]) -> dict[Place, Draws]:
    """Draws of several results, one after the other."""
    return {
        index: Draws(*(
            np.concatenate([getattr(part[index], name) for part in parts])
            for name in ("albedo", "specular", "lobe")
        ))
        for index in parts[0]
    }  # fmt: skip


def trace_surfaces(
    scene: Scene, surface: Surface, paths: int, count: int, seed: int
) -> dict[Place, Draws]:
    """Draws of ``count`` surfaces, each illuminated by ``paths`` at every angle."""
    traced_scene = replace(
        scene,
        surface=replace(surface, realisations=count),
        accuracy=scene.accuracy.with_paths(paths),
        expect={},
    )
    return draws_of(measure(traced_scene, seed=seed), scene)


def _seed(seed: int, *key: int) -> int:
    return seeds.derived(seed, seeds.METHODS, *key)


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Do some work and say how many seconds of the processor it took."""
    begin = time.process_time()
    result = work()
    return result, time.process_time() - begin


def _weighed(work: Callable[[], T]) -> tuple[T, int]:
    """Do some work and say how many bytes numpy had at most."""
    tracemalloc.start()
    try:
        result = work()
        return result, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _model(scene: Scene, method: Method, *, full: bool) -> Run:
    def predict() -> xr.Dataset:
        return model.predict(scene, method.model)

    size = 0
    if full:
        dataset, size = _weighed(predict)  # slows it down: not timed
        times = [timed(predict)[1]]
        times += [timed(predict)[1] for _ in range(2 if times[0] > 1 else 6)]
    else:
        dataset, first = timed(predict)
        times = [first] if first > 0.05 else [timed(predict)[1] for _ in range(3)]
    seconds = tuple(t / scene.light.angles for t in times)
    return Run(
        method, draws_of(dataset, scene), seconds, _evaluation(scene, method) if full else None,
        size, "measured",
    )  # fmt: skip


def _walks(scene: Scene, method: Method, seed: int, *, full: bool) -> Run:
    def walk(k: int, walks: int) -> xr.Dataset:
        return model.walk(scene, method.model, walks=walks, seed=_seed(seed, k), workers=1)

    walk(0, 2)  # compiled before the clock runs
    size = _weighed(lambda: walk(0, method.walks))[1] if full else 0
    parts, times = [], []
    for k in range(method.draws):
        dataset, seconds = timed(lambda k=k: walk(k, method.walks))  # type: ignore[misc]
        parts.append(draws_of(dataset, scene))
        times.append(seconds / scene.light.angles)
    evaluation = _evaluation(scene, method) if full else None
    return Run(method, joined(parts), tuple(times), evaluation, size, "measured")


def _surfaces(scene: Scene, method: Method, seed: int) -> Run:
    surface = method.surface or scene.surface
    parts, times = [], []
    for k in range(method.draws // _AT_A_TIME):
        draws, seconds = timed(
            lambda k=k: trace_surfaces(scene, surface, method.paths, _AT_A_TIME, _seed(seed, k))  # type: ignore[misc]
        )
        parts.append(draws)
        times.append(seconds / (_AT_A_TIME * scene.light.angles))
    size = surface.cells**2 * engine.of_scene(scene).bytes_per_cell
    size += scene.light.angles * memory.BYTES_PER_LOBE
    return Run(method, joined(parts), tuple(times), None, size, "estimated")


def _evaluation(scene: Scene, method: Method) -> float:
    """Seconds of one f(i, o): of many at a time for a model, with its walks for a walk."""
    one = replace(scene, material=replace(scene.material, kd=(max(scene.material.kd),)))
    rng = np.random.default_rng(0)
    pairs = _PAIRS if not method.walks else max(1, _MOST_WALKS // method.walks)
    i = model.direction(np.radians(scene.light.theta[0]), np.radians(scene.light.phi[0]))
    o = model.direction(np.arccos(rng.random(pairs)), 2 * np.pi * rng.random(pairs))
    directions = np.broadcast_to(i, o.shape)

    def evaluate() -> object:
        if method.walks:
            return model.evaluate_walk(one, directions, o, method.model, method.walks, rng)
        return model.evaluate(one, directions, o, method.model)

    if method.walks:
        model.evaluate_walk(one, directions[:1], o[:1], method.model, 2, rng)  # compiled
    times = [timed(evaluate)[1] for _ in range(3 if method.walks <= _MOST_WALKS else 1)]
    return float(np.median(times)) / pairs
