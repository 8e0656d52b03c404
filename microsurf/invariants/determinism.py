"""Same seed, same bits, whoever does the work."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import xarray as xr

from ..errors import MicrosurfError
from ..model.random_walk.simulate import CHUNK, walk
from ..scene import Accuracy, Light, Scene, Surface
from ..trace import measure
from ..trace.engine import AUTO
from .invariant import Invariant
from .replicates import differing

SCENE = Scene(
    surface=Surface(cells=32, realisations=2),
    light=Light((0.0, 60.0)),
    accuracy=Accuracy(150_000),
)
"""Two work items each of two angles on two surfaces."""


def apart(a: xr.Dataset, b: xr.Dataset) -> int:
    """Numbers in which two results differ."""
    return sum(differing(a[name].values, b[name].values) for name in a.data_vars)


@contextmanager
def _deaf() -> Iterator[None]:
    """Let processes that start here not hear Ctrl-C while they load: it would be a traceback."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """In a process that has loaded: end without a word, at Ctrl-C or with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def threads(seed: int, engine: str = AUTO) -> Iterator[Invariant]:
    """One thread, two, three, and two processes."""
    scene = replace(SCENE, accuracy=replace(SCENE.accuracy, engine=engine))
    one = measure(scene, seed=seed, workers=1)
    size = sum(one[name].size for name in one.data_vars)
    figures = {
        f"{workers} threads": float(apart(one, measure(scene, seed=seed, workers=workers)))
        for workers in (2, 3)
    }
    detail = ""
    try:
        # Started afresh: what forks a process with threads may hang.
        with ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), _begin) as executor:
            with _deaf():
                for _ in range(2):
                    executor.submit(int)  # each starts a process
            elsewhere = measure(scene, seed=seed, executor=executor, workers=2)
        figures["2 processes"] = float(apart(one, elsewhere))
    except (MicrosurfError, OSError) as error:
        figures["2 processes"] = np.inf
        detail = f"could not be shown with processes: {error}"
    yield Invariant(
        "threads and processes",
        "the same seed gives the same bits of a measurement with 1, 2, 3 threads and 2 processes",
        max(figures.values()),
        0.0,
        f"numbers that differ, of {size}; every work item has its own random numbers",
        figures,
        detail,
    )
    walks = [walk(SCENE, walks=2 * CHUNK, seed=seed, workers=workers) for workers in (1, 2)]
    yield Invariant(
        "threads of walks",
        "the same seed gives the same bits of a walk with 1 and 2 threads",
        float(apart(*walks)),
        0.0,
        f"numbers that differ, of {sum(walks[0][name].size for name in walks[0].data_vars)}",
    )
