"""Pieces are handed out, taken in and decided upon in the order of their numbers."""

from dataclasses import replace

import numpy as np
import pytest
from small import PIECE, many_pieces, scene

from microsurf.results import uncertainty
from microsurf.scene import Accuracy
from microsurf.trace import measure, scheduler, work_items
from microsurf.trace.scheduler import Ledger


def worked(asked, *, seed=0):
    """Do all of a scene here, one piece at a time; the ledger and the shares it told."""
    book = Ledger(asked, None, seed, turn=True)
    shares = []
    for piece in book.wanted():
        book.take(piece, work_items.run(piece))
        shares.append(book.share_done())
    return book, shares


def test_paths_asked_for_are_traced_for_each_angle_and_realisation(monkeypatch):
    many_pieces(monkeypatch)
    asked = replace(scene(), accuracy=Accuracy(3 * PIECE + 1))
    book, shares = worked(asked)
    assert [lane.added for row in book.lanes for lane in row] == [4] * 6
    # Whole light rays: up to four paths more a piece.
    paths = book.labelled().paths
    assert ((paths >= 3 * PIECE + 1) & (paths <= 3 * PIECE + 1 + 4 * 4)).all()
    np.testing.assert_allclose(shares, np.arange(1, 25) / 24)


def test_an_error_asked_for_is_reached_and_not_by_chance_alone(monkeypatch):
    many_pieces(monkeypatch)
    asked = scene(by_error=True)
    book, shares = worked(asked)
    assert uncertainty.surplus(book.labelled(), asked) <= 1
    assert len(book.lanes) >= asked.surface.realisations
    assert all(0 <= share <= 1 for share in shares)
    finer = replace(asked, accuracy=Accuracy(standard_error=3e-3, lobe_error=0.08))
    more, _ = worked(finer)
    assert uncertainty.surplus(more.labelled(), finer) <= 1
    assert float(more.labelled().paths.sum()) > 1.3 * float(book.labelled().paths.sum())


def test_who_asks_for_too_much_is_told_what_was_reached(monkeypatch):
    many_pieces(monkeypatch)
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
    assert Ledger(scene(by_error=True), None, 0, turn=True)._most == 7


def test_pieces_put_together_are_decided_upon_as_they_were_one_by_one(monkeypatch):
    many_pieces(monkeypatch)
    asked = scene(by_error=True)
    book, _ = worked(asked)
    last = book.lanes[0][0].added
    assert last > 5
    for done in (1, 3, 4, 5, last):
        again = Ledger(asked, None, 0, turn=True)
        first = next(again.wanted())
        parts = [work_items.run(replace(first, number=k)) for k in range(done)]
        total = parts[0]
        for part in parts[1:]:
            total += part
        again.take(first, total, done)
        there, here = again.lane(first), book.lanes[0][0]
        assert (there.issued, there.added) == (done, done)
        assert there.closed == (done == last)
        if there.closed:
            assert there.look == here.look


def test_a_piece_far_behind_holds_the_others_up(monkeypatch):
    """Else all that comes after it would pile up in memory."""
    many_pieces(monkeypatch)
    book = Ledger(scene(), None, 0, turn=True)
    wanted = book.wanted()
    first, *others = [next(wanted) for _ in range(10)]
    for piece in others:
        book.take(piece, None) if piece.angle == first.angle else None
    assert book.waiting() == 4
    assert book.lane(first).added == 0


@pytest.mark.parametrize("added", [4, 5, 100])
def test_looks_are_ever_further_apart(added):
    assert added < scheduler._next_look(added) <= 1.25 * added + 1
