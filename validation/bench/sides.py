"""The two sides of the benchmark, each alone in a process of its own.

Both answer the same two questions about the same surface, light from (θ, φ = 0):
`turn`, how fast; `batch`, what comes out of a number of paths with a seed.
"""

import multiprocessing
import resource
import sys
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from microsurf.results import detector
from microsurf.scene import Accuracy, Light, Material, Roughness, Scene
from microsurf.surface import Heightfield, read_surface

from ..mitsuba import renderer

Array = NDArray[np.float64]

N, KD = 1.5, 0.8
EXACT, EMBREE, MITSUBA = "exact", "embree", "mitsuba"
"""Who takes part; "exact-fixed" and "embree-fixed" have their light from φ = 0."""
RIVALS = {EMBREE: "our Embree engine", MITSUBA: "Mitsuba"}
"""Whom the exact engine is compared with, as tables call them."""


@dataclass(frozen=True)
class Batch:
    """What came out of a number of paths.

    Attributes
    ----------
    flux : ndarray, shape (θ, order, kind, ring, sector)
        Part of the incident power.
    lost : ndarray, shape (θ,)
        The same of what was lost.
    light_rays : float
        Traced for each θ.

    """

    flux: Array
    lost: Array
    light_rays: float


@dataclass(frozen=True)
class Turn:
    """One turn: light rays, the paths they became, light lost in rays, and what it took.

    ``seconds`` are the processor's, of all threads together: they hardly change when the machine
    has other work. ``wall_seconds`` are the clock's, which only threads are judged by.
    """

    light_rays: int
    paths: int
    seconds: float
    lost: float
    wall_seconds: float


class Side(Protocol):
    """Who takes part."""

    def turn(self, theta: float, paths: int, seed: int, variant: str = "") -> Turn:
        """Trace against the clock; what is compiled is compiled before."""

    def batch(self, thetas: tuple[float, ...], kd: float, paths: int, seed: int) -> Batch:
        """Trace that many paths for each θ."""


class Ours:
    """Microsurf, through what anyone can call.

    On an isotropic scene it may turn the light about the surface from path to path;
    ``fixed`` calls the scene anisotropic by a hair, so that light comes from φ = 0.
    ``engine`` is one of `scene.engines`.
    """

    def __init__(
        self,
        surface: Heightfield,
        sigma: float,
        workers: int | None = None,
        *,
        engine: str = "exact",
        fixed: bool = False,
    ) -> None:
        from microsurf import measure  # noqa: PLC0415 - theirs must not pay
        from microsurf.results import albedos, datasets  # noqa: PLC0415 - theirs must not pay

        self._measure, self._datasets, self._albedos = measure, datasets, albedos
        self._surface, self._workers, self._engine = surface, workers, engine
        self._sigma = (sigma, sigma * (1 + 1e-6)) if fixed else (sigma,)

    def _run(self, thetas: tuple[float, ...], kd: float, paths: int, seed: int) -> Any:
        scene = Scene(
            material=Material(n=N, kd=(kd,)),
            roughness=Roughness(sigma=self._sigma),
            light=Light(theta=thetas),
            accuracy=Accuracy(paths=paths, engine=self._engine),
        )
        return self._measure(scene, [self._surface], seed=seed, workers=self._workers)

    def turn(self, theta: float, paths: int, seed: int, variant: str = "") -> Turn:  # noqa: ARG002
        """See `Side`."""
        begin = time.process_time()
        found = self._run((theta,), KD, paths, seed)
        seconds = time.process_time() - begin
        rays = float(found.light_rays.sum())
        return Turn(
            light_rays=round(rays),
            paths=round(float(found.paths.sum())),
            seconds=seconds,
            lost=rays * float(self._albedos.lost_light(found).mean()),
            wall_seconds=float(found.attrs["seconds"]),
        )

    def batch(self, thetas: tuple[float, ...], kd: float, paths: int, seed: int) -> Batch:
        """See `Side`."""
        found = self._run(thetas, kd, paths, seed)
        energy = self._datasets.by_kind(found.flux, N, kd).isel(realisation=0, phi_i=0)
        energy = energy.reindex(order=list(detector.ORDERS), fill_value=0.0)
        flux = energy.transpose("theta_i", "order", "kind", "theta_o", "phi_o").values
        lost = self._albedos.lost_light(found).isel(phi_i=0).values
        rays = float(found.light_rays.sum()) / len(thetas)
        return Batch(np.asarray(flux), np.asarray(lost), rays)


class Theirs:
    """Mitsuba; variants of `turn`: "" at its best, "default" Embree, "independent" origins."""

    def __init__(self, surface: Heightfield) -> None:
        self._surface = surface
        self._tiles: dict[tuple[float, bool], renderer.MitsubaTile] = {}
        self._seen: set[str] = set()
        self._tile(KD, robust=True)

    def _tile(self, kd: float, *, robust: bool) -> renderer.MitsubaTile:
        key = (kd, robust)
        if key not in self._tiles:
            # At Kd = 1 its own energy error is asked for.
            reflectance = renderer.same_body(N, kd) if kd < 1 else 1.0
            self._tiles[key] = renderer.MitsubaTile(self._surface, N, reflectance, robust=robust)
        return self._tiles[key]

    def turn(self, theta: float, paths: int, seed: int, variant: str = "") -> Turn:
        """See `Side`."""
        tile = self._tile(KD, robust=variant != "default")
        ordered = variant != "independent"
        launch = min(renderer.BATCH, paths)
        if variant not in self._seen:
            tile.trace(theta, launch, 0, ordered=ordered)
            self._seen.add(variant)
        lost = 0
        begin = time.perf_counter(), time.process_time()
        for k in range(paths // launch):
            traced = tile.trace(theta, launch, 1_000 * seed + k, ordered=ordered)
            lost += sum(traced.lost.values())
        traced_paths = paths // launch * launch
        wall, processor = time.perf_counter() - begin[0], time.process_time() - begin[1]
        return Turn(traced_paths, traced_paths, processor, lost, wall)

    def batch(self, thetas: tuple[float, ...], kd: float, paths: int, seed: int) -> Batch:
        """See `Side`."""
        tile = self._tile(kd, robust=True)
        traced = [tile.trace(theta, paths, 1_000_000 + seed) for theta in thetas]
        lost = [sum(one.lost.values()) / paths for one in traced]
        return Batch(np.stack([one.flux for one in traced]), np.array(lost), paths)


def peak_bytes() -> int:
    """Most memory this process ever had at a time."""
    try:
        with Path("/proc/self/status").open(encoding="ascii") as lines:
            # ru_maxrss would begin with what the parent had before exec.
            return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        unit = 1 if sys.platform == "darwin" else 1024
        return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _side(kind: str, surface: Heightfield, sigma: float) -> Side:
    if kind == MITSUBA:
        return Theirs(surface)
    engine, _, light = kind.partition("-")
    return Ours(surface, sigma, engine=engine, fixed=light == "fixed")


def _serve(pipe: Connection, kind: str, path: Path, sigma: float) -> None:
    """Warm up on a small surface, note the memory, then answer questions about the real one."""
    _side(kind, Heightfield(np.zeros((8, 8))), sigma).batch((0.0,), KD, 2**10, 0)
    pipe.send(peak_bytes())
    side = _side(kind, read_surface(path), sigma)
    while True:
        name, *arguments = pipe.recv()
        if name == "close":
            return
        pipe.send(peak_bytes() if name == "peak" else getattr(side, name)(*arguments))


class Player:
    """A side in its own process; its calls wait for the answer."""

    def __init__(self, kind: str, path: Path, sigma: float) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, end = context.Pipe()
        self._process = context.Process(target=_serve, args=(end, kind, path, sigma), daemon=True)
        self._process.start()
        end.close()
        self.baseline = int(self._pipe.recv())
        """Bytes of the imported, warmed-up process before it had the surface."""

    def ask(self, *question: Any) -> Any:
        """Call one of the side's methods, or "peak" for `peak_bytes`."""
        self._pipe.send(question)
        return self._pipe.recv()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _: type[BaseException] | None, __: BaseException | None, ___: TracebackType | None
    ) -> None:
        self._pipe.send(("close",))
        self._process.join()
