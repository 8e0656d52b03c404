from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from microsurf.errors import MicrosurfError
from microsurf.invariants import determinism as workers
from microsurf.scene import Accuracy


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(workers, "SCENE", replace(workers.SCENE, accuracy=Accuracy(2000)))
    monkeypatch.setattr(workers, "CHUNK", 2000)


class Threads(ThreadPoolExecutor):
    """In the place of processes, which take seconds to start; tests/trace has real ones."""

    def __init__(self, workers, *_):
        super().__init__(workers)


@pytest.mark.usefixtures("small")
def test_same_bits(monkeypatch):
    monkeypatch.setattr(workers, "ProcessPoolExecutor", Threads)
    found = list(workers.threads(1))
    assert [row.value for row in found] == [0.0, 0.0]
    assert set(found[0].figures) == {"2 threads", "3 threads", "2 processes"}


@pytest.mark.usefixtures("small")
def test_bits_that_depend_on_the_workers_are_found(monkeypatch):
    monkeypatch.setattr(workers, "ProcessPoolExecutor", Threads)
    for name in ("measure", "walk"):
        right = getattr(workers, name)

        def moody(*args, right=right, **more):
            found = right(*args, **more)
            found["flux"] = found.flux * (1 + 1e-15 * (more["workers"] > 1))
            return found

        monkeypatch.setattr(workers, name, moody)
    assert all(row.value > 100 for row in workers.threads(1))


@pytest.mark.usefixtures("small")
def test_processes_that_cannot_start_are_told(monkeypatch):
    class Broken(Threads):
        def __enter__(self):
            raise MicrosurfError("a worker was lost")

    monkeypatch.setattr(workers, "ProcessPoolExecutor", Broken)
    first, _ = workers.threads(1)
    assert not first.holds
    assert first.value == np.inf
    assert "a worker was lost" in first.detail
