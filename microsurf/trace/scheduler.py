"""Which pieces are still wanted, what the finished ones came to, and when it is enough.

Pieces come back in any order; they are added, and decided upon, in the order of their
numbers. So the result does not depend on who finished first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
import xarray as xr

from .. import memory
from ..results import uncertainty
from ..scene import Scene
from .tally_dataset import labelled
from .wavefront import Tally
from .work_items import PIECE, Piece, Source, facet_of

MOST_SURFACES = 1000
"""No error is worth more realisations: who asks for it is told what was reached."""

ROUND = 8
"""Pieces that cover the tile once, where their number is not known before."""
_GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(eq=False)
class Lane:
    """The pieces of one angle on one realisation: handed out, added up, closed if enough."""

    tally: Tally | None = None
    issued: int = 0
    added: int = 0
    closed: bool = False
    look: int = ROUND  # at the error, after so many pieces
    expected: float = np.inf  # pieces, from the last look
    waiting: dict[int, tuple[int, Tally]] = field(default_factory=dict)


class Ledger:
    """Hands out pieces and takes in what they came to.

    With ``accuracy.paths`` every lane has the same number of pieces. With
    ``accuracy.standard_error`` each realisation is traced until its rays leave that error
    in the mean over a scene's ``realisations``, and realisations are added until the
    spread of all leaves no more; those of the scene are then the least. Pieces of less than
    PIECE paths let a realisation end earlier.
    """

    def __init__(
        self,
        scene: Scene,
        sources: list[Source] | None,
        seed: int,
        *,
        turn: bool,
        piece: int | None = None,
    ) -> None:
        self.scene = scene
        self._size = PIECE if piece is None else min(piece, PIECE)
        self.angles = list(product(scene.light.theta, scene.light.phi))
        self.lanes: list[list[Lane]] = []
        self._sources = sources
        self._seed = seed
        self._turn = turn
        self._complete = False
        self._look = self._least()  # at the error between surfaces, after so many of them
        self._expected = float(self._least())  # surfaces, from the last look
        fit = memory.lobes_that_fit() // len(self.angles)
        self._most = max(min(MOST_SURFACES, fit), self._least())
        total = scene.accuracy.paths
        count = -(-total // PIECE)
        self._sizes = [total * (k + 1) // count - total * k // count for k in range(count)]

    def wanted(self) -> Iterator[Piece | None]:
        """Pieces in the order they are needed; None while that depends on what is under way."""
        self._open()
        while not self._complete:
            lane = min(
                (lane for lane in self.lanes[-1] if self._more(lane)),
                key=lambda lane: lane.issued,
                default=None,
            )
            if lane is not None:
                yield self._piece(lane)
            elif self._by_error and not all(lane.closed for lane in self.lanes[-1]):
                yield None
            elif self._enough():
                self._complete = True
            else:
                self._open()

    def _open(self) -> None:
        realisation = len(self.lanes)
        source = (
            Source(self.scene, self._seed, realisation)
            if self._sources is None
            else self._sources[realisation]
        )
        self._source, self._name = source, source.name
        self.lanes.append([Lane() for _ in self.angles])

    @property
    def _by_error(self) -> bool:
        return self.scene.accuracy.standard_error is not None

    def _more(self, lane: Lane) -> bool:
        return not lane.closed and (self._by_error or lane.issued < len(self._sizes))

    def _piece(self, lane: Lane) -> Piece:
        angle = self.lanes[-1].index(lane)
        number = lane.issued
        lane.issued += 1
        size = self._size if self._by_error else self._sizes[number]
        parts = ROUND if self._by_error else len(self._sizes)
        rounds, part = divmod(number, parts)
        theta, phi = self.angles[angle]
        if self._turn:
            # From all sides in turn, the same for every seed: then what two runs on one
            # surface differ by is their rays' error.
            phi += 360 * (part + rounds * _GOLDEN) / parts
        return Piece(self._source, self._name, angle, theta, phi, number, size, part, parts)

    def _least(self) -> int:
        """Realisations to make in any case."""
        if self._sources is not None:
            return len(self._sources)
        return self.scene.surface.realisations

    def _enough(self) -> bool:
        done = len(self.lanes)
        if done < self._least() or self._sources is not None or not self._by_error:
            return done >= self._least()
        if not self.scene.requires.roughness or done >= self._most:
            return True
        if done < self._look:
            return False
        self._look = _next_look(done)
        surplus = uncertainty.surplus(self.labelled(), self.scene)
        self._expected = min(done * surplus**2, self._most)
        return surplus <= 1

    def lane(self, piece: Piece) -> Lane:
        """Where a piece belongs."""
        return self.lanes[piece.source.realisation][piece.angle]

    def take(self, piece: Piece, tally: Tally, count: int = 1) -> None:
        """Take in what ``count`` pieces of a lane, from this one on, came to.

        What is beyond enough is dropped.
        """
        lane = self.lane(piece)
        lane.issued = max(lane.issued, piece.number + count)
        lane.waiting[piece.number] = count, tally
        while not lane.closed and lane.added in lane.waiting:
            number, finished = lane.waiting.pop(lane.added)
            lane.tally = finished if lane.tally is None else lane.tally + finished
            lane.added += number
            self._decide(lane)
        if lane.closed:
            lane.waiting.clear()

    def waiting(self) -> int:
        """Finished pieces that wait for an earlier one."""
        return sum(len(lane.waiting) for row in self.lanes for lane in row)

    def _decide(self, lane: Lane) -> None:
        """Close a lane that has enough; errors are looked at ever less often."""
        if not self._by_error:
            lane.closed = lane.added == len(self._sizes)
            return
        # Pieces that were put together skip looks, all of which said that more are wanted.
        while lane.look < lane.added:
            lane.look = _whole_rounds(_next_look(lane.look))
        if lane.tally is not None and lane.added == lane.look:
            lane.look = _whole_rounds(_next_look(lane.look))
            seen = self._labelled([[lane.tally]], ([0.0], [0.0]))
            # The mean over realisations is that much better than each of them.
            surplus = uncertainty.surplus(seen, self.scene) / np.sqrt(self._least())
            lane.expected = lane.added * surplus**2
            lane.closed = surplus <= 1

    def share_done(self) -> float:
        """Estimate which part of all the work is finished, from the errors so far."""
        done = float(np.mean([self._share(lane) for lane in self.lanes[-1]]))
        return (len(self.lanes) - 1 + done) / max(self._expected, self._least(), len(self.lanes))

    def _share(self, lane: Lane) -> float:
        if lane.closed:
            return 1.0
        return min(lane.added / (lane.expected if self._by_error else len(self._sizes)), 1.0)

    def labelled(self) -> xr.Dataset:
        """Everything so far, with its labels."""
        rows = [[lane.tally for lane in row if lane.tally is not None] for row in self.lanes]
        return self._labelled(rows, (self.scene.light.theta, self.scene.light.phi))

    def _labelled(
        self, rows: list[list[Tally]], angles: tuple[Sequence[float], Sequence[float]]
    ) -> xr.Dataset:
        return labelled(self.scene, facet_of(self.scene), rows, angles, self._seed, fold=self._turn)

    def tallies(self) -> list[Tally]:
        """All of them, to be summed up."""
        return [lane.tally for row in self.lanes for lane in row if lane.tally is not None]


def _next_look(now: int) -> int:
    """Errors are looked at ever less often: a look costs, and chance passes one of many."""
    return -(-now * 5 // 4)


def _whole_rounds(pieces: int) -> int:
    return -(-pieces // ROUND) * ROUND
