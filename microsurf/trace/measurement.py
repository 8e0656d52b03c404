"""Ray-trace the surfaces of a scene: the measurement, with its errors and its losses."""

import json
import math
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from .. import memory
from ..errors import MicrosurfError
from ..scene import Scene
from ..surface import Heightfield, surface_of
from . import work_items
from .checkpoint import Checkpoint
from .engine import engine_of
from .scheduler import ROUND, Scheduler
from .wavefront import Tally
from .work_items import Realisation, WorkItem

_LEAST = 1024
"""Paths of a work item: fewer are not worth a work item's fixed cost."""


def measure(
    scene: Scene,
    surfaces: Iterable[Heightfield] | None = None,
    *,
    seed: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    checkpoint: Path | None = None,
    resume: bool = False,
    surface_paths: int | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Trace paths for every angle and realisation, as many as ``scene.accuracy`` asks for.

    Parameters
    ----------
    scene : Scene
        What to measure.
    surfaces : iterable of Heightfield, optional
        One for each realisation, instead of those of the scene.
    seed : int
        Same seed, same bits, whoever does the work.
    workers : int, optional
        Threads; default one for each core. With an ``executor`` its number of workers,
        with the time that tracing took.
    executor : concurrent.futures.Executor, optional
        Does the work instead of threads: processes, or ``Client.get_executor()`` of a
        dask cluster.
    checkpoint : Path, optional
        Folder for finished work items. Remove it when the result is safe, see `checkpoint.clear`.
    resume : bool
        Go on from the work items that are there.
    surface_paths : int, optional
        Where an error is asked for: how many paths for each angle of a surface come before
        the error is looked at first, at least 8192. By default, and at the most, a million.
    progress : bool
        Show a progress bar on standard error if that is a terminal.

    Returns
    -------
    xarray.Dataset
        See `microsurf.results.datasets`; besides ``flux`` it holds, by realisation and angle, the
        numbers of ``light_rays``, of ``paths`` they were split into, and of ``rays`` and
        ``grazes``; the light that ``arrived`` and that ``ended`` otherwise (absorbed, left
        out or lost, by cause) in units of a path's share of its light ray; the number of
        ``ended_paths``; and what errors are made of, ``batch_flux`` and ``bin_variance``.
        Attributes are ``seconds``, in which at least one work item was traced (not those that
        surfaces and meshes took), ``engine``, which traced, and ``embree_ratio``, the part of
        the workers' time that passed inside Embree, 0 of the exact engine; of a measured surface
        also ``surface``, where it comes from as JSON, see `Heightfield`.

    Raises
    ------
    InputError
        If a surface can't be used or made, or ``checkpoint`` can't serve, see `Checkpoint`.
    MicrosurfError
        If a worker was lost and nobody took its work, or there is no room for work items;
        what was finished is kept.

    """
    workers = workers or memory.cores()
    if surfaces is None and scene.surface.file is not None:
        surfaces = [surface_of(scene, seed, 0)]  # workers elsewhere may not have the file
    realisations = None
    if surfaces is not None:
        realisations = [Realisation(scene, seed, r, surface) for r, surface in enumerate(surfaces)]
    turn = not scene.requires.azimuth and all(map(_made_isotropic, realisations or ()))
    item_paths = None if surface_paths is None else max(surface_paths // ROUND, _LEAST)
    scheduler = Scheduler(scene, realisations, seed, turn=turn, item_paths=item_paths)
    store = (
        None
        if checkpoint is None
        else Checkpoint(checkpoint, scene, realisations, seed, resume=resume, item_paths=item_paths)
    )
    bar = tqdm(
        total=1.0,
        disable=None if progress else True,
        desc="tracing",
        smoothing=0,  # the share is of all the work: its mean rate tells the time left
        bar_format="{desc}: {percentage:3.0f}%|{bar}| [{elapsed}<{remaining}]",
    )
    pool = executor or ThreadPoolExecutor(workers)
    spans: list[tuple[float, float]] = []
    try:
        work_items.compiled(engine_of(scene), layered=scene.layers is not None)
        with bar:
            for done in _work(pool, scheduler, store, 2 * workers):
                now = time.perf_counter()
                spans += [(now - tally.seconds[0], now) for tally in done]
                # Estimates change their mind; the bar never goes back.
                bar.update(max(min(scheduler.share_done(), 1) - bar.n, 0))
            bar.update(1 - bar.n)
    except BaseException:
        if store is not None:
            store.leave()
        raise
    finally:
        if store is not None:
            store.close()
        if executor is None:
            pool.shutdown(wait=False, cancel_futures=True)
        work_items.forget()
    measured = scheduler.to_dataset()
    seconds, inside = np.sum([tally.seconds for tally in scheduler.tallies()], axis=0)
    # What an earlier run had done took its part of the workers' time.
    busy = sum(end - begin for begin, end in spans)
    measured.attrs |= {
        "rays": float(measured.rays.sum()),
        "grazes": float(measured.grazes.sum()),
        "seconds": _covered(spans) + max(float(seconds) - busy, 0.0) / workers,
        "embree_ratio": float(inside / seconds),
        "engine": engine_of(scene),
    }
    if realisations and realisations[0].given is not None and realisations[0].given.provenance:
        measured.attrs["surface"] = json.dumps(dict(realisations[0].given.provenance))
    return measured


def _made_isotropic(realisation: Realisation) -> bool:
    """Whether a given surface is known to look the same from every side, by its recipe."""
    recipe = realisation.given.recipe if realisation.given else {}
    return "sigma_x" in recipe and recipe["sigma_x"] == recipe.get("sigma_y")


def _covered(spans: list[tuple[float, float]]) -> float:
    """Length of the union of spans of time."""
    length, until = 0.0, -math.inf
    for begin, end in sorted(spans):
        length += max(end - max(begin, until), 0.0)
        until = max(until, end)
    return length


def _work(
    executor: Executor, scheduler: Scheduler, store: Checkpoint | None, depth: int
) -> Iterator[list[Tally]]:
    """Do what is wanted, ``depth`` work items under way; after an error keep what is finished.

    Yields what was done just now, nothing for what an earlier run had done.
    """
    wanted = scheduler.wanted()
    under_way: dict[Future[Tally], WorkItem] = {}
    try:
        while True:
            # One slow work item must not let all that comes after it pile up.
            room = len(under_way) < depth and scheduler.waiting() < 4 * depth
            item = next(wanted, None) if room else None
            if item is not None:
                stored = None if store is None else store.load(item)
                if stored is None:
                    with _workers_errors():
                        under_way[executor.submit(work_items.run, item)] = item
                else:
                    count, tally = stored
                    scheduler.take(item, tally, count)
                    yield []
            elif under_way:
                for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                    item = under_way.pop(future)
                    with _workers_errors():
                        tally = future.result()
                    _finish(item, tally, scheduler, store)
                    yield [tally]
            else:
                return
    except BaseException:
        for future, item in under_way.items():
            if not future.cancel() and future.done() and future.exception() is None:
                with suppress(MicrosurfError):  # the first error is the one to tell
                    _finish(item, future.result(), scheduler, store)
        raise


def _finish(item: WorkItem, tally: Tally, scheduler: Scheduler, store: Checkpoint | None) -> None:
    """Take in a work item that was done, on disk first."""
    stream = scheduler.stream(item)
    if store is not None and not stream.closed:
        store.save(item, tally)
    scheduler.take(item, tally)
    if store is not None:
        store.add_up(item, stream)


@contextmanager
def _workers_errors() -> Iterator[None]:
    """Say of what workers could not do that it is they who could not."""
    try:
        yield
    except (MicrosurfError, MemoryError, KeyboardInterrupt):
        raise
    except Exception as error:
        what = ": ".join(filter(None, (type(error).__name__, str(error))))
        raise MicrosurfError(
            f"a worker was lost or failed ({what}); "
            "what is finished is kept, start again with --resume"
        ) from error
