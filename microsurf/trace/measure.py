"""Ray-trace the surfaces of a scene: the measurement, with its errors and its losses."""

import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    Future,
    ThreadPoolExecutor,
    as_completed,
    wait,
)
from dataclasses import dataclass, field
from functools import partial
from itertools import product

import numpy as np
import xarray as xr
from tqdm import tqdm

from .. import __version__, memory, result
from ..physics.facet import body_weight
from ..scene import Scene
from ..scene_file import to_toml
from ..surface import Heightfield, mesh, surfaces_of
from .embree import EmbreeTile, Rays
from .grid import from_heights
from .paths import LOST, Facet, Tally, Tile, trace
from .plane import Plane

PIECE = 131_072
"""Paths of one piece of work; each is seeded by its place and adds up with the others."""

_RECORDED = 1_000_000  # rays kept to time Embree alone afterwards


@dataclass
class _Clock:
    """What the tracing took, and rays to replay for what Embree alone would take."""

    seconds: float = 0.0
    rays: int = 0
    replay_seconds_per_ray: float = 0.0
    kept: list[tuple[Rays, Rays]] = field(default_factory=list)

    def recorder(self, angles: int) -> Callable[[Rays, Rays], None]:
        """Keep rays of one angle of incidence, its share of what is kept in all."""
        room = _RECORDED // angles

        def record(origins: Rays, directions: Rays) -> None:
            nonlocal room
            if room > 0:
                self.kept.append((origins, directions))
                room -= len(origins)

        return record

    def replay(self, tile: Tile, workers: int) -> None:
        """Time a bare loop over recorded rays, on as many threads as the trace had."""

        def loop(_: int) -> None:
            for origins, directions in self.kept:
                tile.intersect(origins, directions)

        begin = time.perf_counter()
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(loop, range(workers)))
        count = workers * sum(len(rays) for rays, _ in self.kept)
        self.replay_seconds_per_ray = (time.perf_counter() - begin) / max(count, 1)
        self.kept.clear()


def measure(
    scene: Scene,
    surfaces: Iterable[Heightfield] | None = None,
    *,
    seed: int = 0,
    workers: int | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Trace ``scene.accuracy.paths`` paths for every angle and realisation.

    Parameters
    ----------
    scene : Scene
        What to measure.
    surfaces : iterable of Heightfield, optional
        One for each realisation, instead of those of the scene.
    seed : int
        Same seed, same bits, whatever the number of workers.
    workers : int, optional
        Threads; default one for each core.
    progress : bool
        Show a progress bar on standard error if that is a terminal.

    Returns
    -------
    xarray.Dataset
        See `microsurf.result`; besides ``flux`` it holds the numbers of ``paths``,
        of those that ``arrived`` and of those that ``ended`` otherwise (absorbed,
        left out or lost, by cause), and in its attributes ``rays``,
        ``grazes``, ``seconds`` (tracing alone) and ``embree_ratio``, the time a bare
        loop of Embree calls takes for as many rays over the time of the whole trace.

    """
    workers = workers or os.cpu_count() or 1
    needs = scene.requires
    facet = Facet(
        scene.material.n,
        needs.interface,
        needs.substrate,
        needs.multiple_scattering,
        survival=float(body_weight(scene.material.n, max(scene.material.kd))),
        k=scene.material.k,
    )
    trace(Plane(), 0.0, 0.0, facet, 1, np.random.default_rng(0))  # compiles before the clock runs
    angles = list(product(scene.light.theta, scene.light.phi))
    count = -(-scene.accuracy.paths // PIECE)
    sizes = [
        scene.accuracy.paths * (k + 1) // count - scene.accuracy.paths * k // count
        for k in range(count)
    ]
    clock = _Clock()
    tallies: list[list[Tally]] = []
    realisations = scene.surface.realisations if scene.surface.file is None else 1
    bar = tqdm(
        total=realisations * len(angles) * count * PIECE / 1e6,
        disable=None if progress else True,
        desc="tracing",
        unit=" Mpaths",
        bar_format="{desc}: {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f}{unit} "
        "[{elapsed}<{remaining}]",
    )
    with bar, ThreadPoolExecutor(workers) as pool:
        for realisation, tile in enumerate(_tiles(scene, surfaces, seed)):

            def jobs(
                realisation: int = realisation, tile: Tile = tile
            ) -> Iterator[tuple[int, Callable[[], Tally]]]:
                for (a, angle), (k, size) in product(enumerate(angles), enumerate(sizes)):
                    sequence = np.random.SeedSequence(seed, spawn_key=(1, realisation, a, k))
                    rng = np.random.Generator(np.random.SFC64(sequence))
                    recorder = clock.recorder(len(angles)) if realisation == k == 0 else None
                    yield a, partial(trace, tile, *angle, facet, size, rng, recorder)

            begin = time.perf_counter()
            of_angle: list[Tally | None] = [None] * len(angles)
            for a, tally in _as_they_come(pool, jobs(), 4 * workers):
                # Whole numbers: their sum is the same in whatever order they come.
                so_far = of_angle[a]
                of_angle[a] = tally if so_far is None else so_far + tally
                bar.update(PIECE / 1e6)
            clock.seconds += time.perf_counter() - begin
            tallies.append([tally for tally in of_angle if tally is not None])
            if realisation == 0:
                clock.replay(tile, min(workers, os.cpu_count() or 1))
    clock.rays = sum(tally.rays for row in tallies for tally in row)
    return _dataset(scene, facet, tallies, clock, seed)


def _as_they_come(
    pool: ThreadPoolExecutor, jobs: Iterable[tuple[int, Callable[[], Tally]]], depth: int
) -> Iterator[tuple[int, Tally]]:
    """Results of jobs with their keys, ``depth`` jobs under way; an interrupt drops the rest."""
    waiting: dict[Future[Tally], int] = {}
    try:
        for key, job in jobs:
            waiting[pool.submit(job)] = key
            if len(waiting) >= depth:
                for done in wait(waiting, return_when=FIRST_COMPLETED).done:
                    yield waiting.pop(done), done.result()
        for done in as_completed(waiting):
            yield waiting[done], done.result()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise


def _tiles(scene: Scene, surfaces: Iterable[Heightfield] | None, seed: int) -> Iterator[Tile]:
    """Build what the rays of each realisation meet; a flat scene has no mesh."""
    if surfaces is None and not scene.requires.roughness:
        for _ in range(scene.surface.realisations):
            yield Plane()
        return
    for heightfield in surfaces_of(scene, seed) if surfaces is None else surfaces:
        tile = mesh(heightfield)
        memory.require(tile.heights.size, memory.TRACE_BYTES_PER_CELL, "surface")
        yield EmbreeTile(from_heights(tile.heights, tile.flipped))


def _dataset(
    scene: Scene, facet: Facet, tallies: list[list[Tally]], clock: _Clock, seed: int
) -> xr.Dataset:
    thetas, phis = scene.light.theta, scene.light.phi
    shape = (len(tallies), len(thetas), len(phis))
    events = max(tally.counts.shape[1] for row in tallies for tally in row)
    flux = np.zeros((*shape, len(result.ORDERS), events, result.RINGS, result.SECTORS))
    paths, arrived = np.zeros(shape), np.zeros(shape)
    path_weight = facet.path_weight(events)
    causes = list(tallies[0][0].ends)
    ended = np.zeros((*shape, len(causes)))
    for r, row in enumerate(tallies):
        for a, tally in enumerate(row):
            place = (r, *divmod(a, len(phis)))
            flux[place][:, : tally.counts.shape[1]] = tally.counts / tally.paths
            arrived[place] = tally.counts.sum()
            paths[place] = tally.paths
            ended[place] = [tally.ends[cause] for cause in causes]
    flux *= path_weight[:, None, None]
    measured = result.build(
        flux,
        thetas,
        phis,
        path_weight=path_weight,
        attrs={
            "source": "measurement",
            "model": "explicit surface",
            "scene": to_toml(scene),
            "seed": seed,
            "microsurf": __version__,
            "rays": float(clock.rays),
            "grazes": float(sum(tally.grazes for row in tallies for tally in row)),
            "seconds": clock.seconds,
            "embree_ratio": clock.replay_seconds_per_ray * clock.rays / clock.seconds,
        },
    )
    dims = ("realisation", "theta_i", "phi_i")
    measured["paths"] = (dims, paths)
    measured["arrived"] = (dims, arrived)
    measured["ended"] = ((*dims, "cause"), ended)
    return measured.assign_coords(cause=causes, lost=("cause", [c in LOST for c in causes]))
