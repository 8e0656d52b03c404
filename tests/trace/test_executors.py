"""Whoever does the work, in whatever order it is finished: the same bits."""

import multiprocessing
import random
import signal
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor

import pytest
from small import many_items, same, scene

from microsurf.errors import MicrosurfError
from microsurf.surface import generate_surface
from microsurf.trace import measure


class Shuffled(Executor):
    """Does one of the work items that wait, drawn at random; ``fails`` at that one."""

    def __init__(self, seed, fails=None):
        self._rng, self._fails = random.Random(seed), fails  # noqa: S311 - an order
        self._waiting, self._done, self._open = [], 0, True
        self.order = []
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def submit(self, work, item):
        """Put it with those that wait."""
        future = Future()
        self._waiting.append((future, work, item))
        return future

    def _work(self):
        while self._open:
            time.sleep(0.002)  # until several wait
            if not self._waiting:
                continue
            future, work, item = self._waiting.pop(self._rng.randrange(len(self._waiting)))
            if not future.set_running_or_notify_cancel():
                continue
            self._done += 1
            self.order.append((item.realisation.number, item.number, item.angle))
            if self._done == self._fails:
                future.set_exception(RuntimeError("struck by lightning"))
            else:
                future.set_result(work(item))

    def shutdown(self, wait=True, *, cancel_futures=False):
        """Stop; whoever waits, waits in vain."""
        del wait, cancel_futures
        self._open = False
        self._thread.join()


@pytest.fixture
def processes():
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        yield executor


@pytest.mark.parametrize("by_error", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_same_bits_by_threads_and_in_any_order(monkeypatch, by_error):
    many_items(monkeypatch)
    asked = scene(by_error=by_error)
    one = measure(asked, seed=5, workers=1)
    assert int(one.paths.min()) >= 4 * 2000  # several work items in each sum
    for workers in (2, 3):
        assert same(measure(asked, seed=5, workers=workers), one)
    for seed in range(2):
        with Shuffled(seed) as executor:
            assert same(measure(asked, seed=5, workers=4, executor=executor), one)
            assert executor.order != sorted(executor.order)
    assert not same(measure(asked, seed=6, workers=2), one)  # what `same` is worth


def test_processes_do_the_same_and_a_lost_one_ends_with_one_line(monkeypatch, processes, tmp_path):
    """Then threads go on with what it had finished. Given surfaces are sent along."""
    many_items(monkeypatch)
    asked, made = scene(), [generate_surface(2.0, 0.5, cells=32, seed=s) for s in range(3)]
    there = {"workers": 2, "executor": processes}
    assert same(measure(asked, made, **there), measure(asked, made, workers=1))
    asked = scene(realisations=40)
    parts = tmp_path / "parts"

    def kill():
        while len(list(parts.glob("00005-*.npz"))) < 1:
            time.sleep(0.001)
        # Not from outside: while a worker sends a result, Python would wait for the rest.
        processes.submit(signal.raise_signal, signal.SIGKILL)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    with pytest.raises(MicrosurfError, match="worker was lost") as lost:
        measure(asked, **there, checkpoint=parts)
    killer.join()
    assert str(lost.value).count("\n") == 0
    assert lost.value.exit_code == 3
    assert len(list(parts.glob("0*.npz"))) >= 10  # one of each stream that is finished
    resumed = measure(asked, workers=1, checkpoint=parts, resume=True)
    assert same(resumed, measure(asked, workers=2))


@pytest.mark.parametrize("by_error", [False, pytest.param(True, marks=pytest.mark.long)])
def test_failed_and_resumed_comes_to_the_same_bits(monkeypatch, tmp_path, by_error):
    """Again and again, until it is through."""
    many_items(monkeypatch)
    asked, failures = scene(by_error=by_error), 0
    for seed in range(100):
        with Shuffled(seed, fails=40 if by_error else 5) as executor:
            try:
                found = measure(
                    asked, workers=3, executor=executor, checkpoint=tmp_path / "p", resume=True
                )
                break
            except MicrosurfError as error:
                assert "struck by lightning" in str(error)  # noqa: PT017 - it may also succeed
                failures += 1
    assert failures > 3
    assert same(found, measure(asked, workers=1))
