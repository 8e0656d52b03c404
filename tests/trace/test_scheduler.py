"""Work items are handed out, taken in and decided upon in the order of their numbers."""

from dataclasses import replace

import numpy as np
import pytest
from small import PATHS_PER_ITEM, many_items, scene

from microsurf.results import uncertainty
from microsurf.scene import Accuracy
from microsurf.trace import measure, scheduler, work_items
from microsurf.trace.scheduler import Scheduler


def worked(asked, *, seed=0):
    """Do all of a scene here, one work item at a time; the ledger and the shares it told."""
    book = Scheduler(asked, None, seed, turn=True)
    shares = []
    for item in book.wanted():
        book.take(item, work_items.run(item))
        shares.append(book.share_done())
    return book, shares


@pytest.fixture(scope="module")
def by_error():
    """As `worked`, of a scene that names its errors and not its paths."""
    with pytest.MonkeyPatch.context() as patch:
        many_items(patch)
        yield worked(scene(by_error=True))


def test_paths_asked_for_are_traced_for_each_angle_and_realisation(monkeypatch):
    many_items(monkeypatch)
    asked = replace(scene(), accuracy=Accuracy(3 * PATHS_PER_ITEM + 1))
    book, shares = worked(asked)
    assert [stream.added for row in book.streams for stream in row] == [4] * 6
    # Whole light rays: up to four paths more a work item.
    paths = book.to_dataset().paths
    assert ((paths >= 3 * PATHS_PER_ITEM + 1) & (paths <= 3 * PATHS_PER_ITEM + 1 + 4 * 4)).all()
    np.testing.assert_allclose(shares, np.arange(1, 25) / 24)


def test_an_error_asked_for_is_reached_and_not_by_chance_alone(by_error):
    asked = scene(by_error=True)
    book, shares = by_error
    assert uncertainty.surplus(book.to_dataset(), asked) <= 1
    assert len(book.streams) >= asked.surface.realisations
    assert all(0 <= share <= 1 for share in shares)
    finer = replace(asked, accuracy=Accuracy(standard_error=3e-3, lobe_error=0.08))
    more, _ = worked(finer)
    assert uncertainty.surplus(more.to_dataset(), finer) <= 1
    assert float(more.to_dataset().paths.sum()) > 1.3 * float(book.to_dataset().paths.sum())


def test_who_asks_for_too_much_is_told_what_was_reached(monkeypatch):
    many_items(monkeypatch)
    monkeypatch.setattr(scheduler, "MOST_SURFACES", 4)
    asked = replace(scene(), accuracy=Accuracy(standard_error=1e-4, lobe_error=1.0))
    asked = replace(asked, material=replace(asked.material, kd=(0.0,)))  # rays alone reach it
    monkeypatch.setattr(
        uncertainty, "surplus", lambda d, _: 9.0 if d.sizes["realisation"] > 1 else 1
    )
    measured = measure(asked, workers=1)
    assert measured.sizes["realisation"] == 4


def test_memory_bounds_the_realisations(monkeypatch):
    monkeypatch.setattr(scheduler.memory, "lobes_that_fit", lambda: 14)
    assert Scheduler(scene(by_error=True), None, 0, turn=True)._most == 7


def test_pieces_put_together_are_decided_upon_as_they_were_one_by_one(by_error):
    asked = scene(by_error=True)
    book, _ = by_error
    last = book.streams[0][0].added
    assert last > 5
    for done in (1, 3, 4, 5, last):
        again = Scheduler(asked, None, 0, turn=True)
        first = next(again.wanted())
        parts = [work_items.run(replace(first, number=k)) for k in range(done)]
        total = parts[0]
        for part in parts[1:]:
            total += part
        again.take(first, total, done)
        there, here = again.stream(first), book.streams[0][0]
        assert (there.issued, there.added) == (done, done)
        assert there.closed == (done == last)
        if there.closed:
            assert there.look == here.look


def test_a_piece_far_behind_holds_the_others_up(monkeypatch):
    """Else all that comes after it would pile up in memory."""
    many_items(monkeypatch)
    book = Scheduler(scene(), None, 0, turn=True)
    wanted = book.wanted()
    first, *others = [next(wanted) for _ in range(10)]
    for item in others:
        book.take(item, None) if item.angle == first.angle else None
    assert book.waiting() == 4
    assert book.stream(first).added == 0


@pytest.mark.parametrize("added", [4, 5, 100])
def test_looks_are_ever_further_apart(added):
    assert added < scheduler._next_look(added) <= 1.25 * added + 1
