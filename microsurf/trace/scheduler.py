"""Which work items are still wanted, what the finished ones came to, and when it is enough.

Work items come back in any order; they are added, and decided upon, in the order of their
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
from .tally_dataset import to_dataset
from .wavefront import Tally
from .work_items import PATHS_PER_ITEM, Realisation, WorkItem, facet_optics

MOST_SURFACES = 1000
"""No error is worth more realisations: the result says what was reached."""

ROUND = 8
"""Work items that cover the tile once, where their number is not known before."""
_GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(eq=False)
class Stream:
    """The work items of one angle on one realisation: handed out, added up, closed if enough."""

    tally: Tally | None = None
    issued: int = 0
    added: int = 0
    closed: bool = False
    look: int = ROUND  # at the error, after so many work items
    expected: float = np.inf  # work items, from the last look
    waiting: dict[int, tuple[int, Tally]] = field(default_factory=dict)


class Scheduler:
    """Hands out work items and takes in what they came to.

    With ``accuracy.paths`` every stream has the same number of work items. With
    ``accuracy.standard_error`` each realisation is traced until its rays leave that error
    in the mean over a scene's ``realisations``, and realisations are added until the
    spread of all leaves no more; those of the scene are then the least. Work items of less than
    PATHS_PER_ITEM paths let a realisation end earlier.
    """

    def __init__(
        self,
        scene: Scene,
        realisations: list[Realisation] | None,
        seed: int,
        *,
        turn: bool,
        item_paths: int | None = None,
    ) -> None:
        self.scene = scene
        self._size = PATHS_PER_ITEM if item_paths is None else min(item_paths, PATHS_PER_ITEM)
        self.angles = list(product(scene.light.theta, scene.light.phi))
        self.streams: list[list[Stream]] = []
        self._realisations = realisations
        self._seed = seed
        self._turn = turn
        self._complete = False
        self._look = self._least()  # at the error between surfaces, after so many of them
        self._expected = float(self._least())  # surfaces, from the last look
        fit = memory.lobes_that_fit() // len(self.angles)
        self._most = max(min(MOST_SURFACES, fit), self._least())
        total = scene.accuracy.paths
        count = -(-total // PATHS_PER_ITEM)
        self._sizes = [total * (k + 1) // count - total * k // count for k in range(count)]

    def wanted(self) -> Iterator[WorkItem | None]:
        """Work items in the order they are needed; None while that depends on what is under way."""
        self._open()
        while not self._complete:
            stream = min(
                (stream for stream in self.streams[-1] if self._more(stream)),
                key=lambda stream: stream.issued,
                default=None,
            )
            if stream is not None:
                yield self._item(stream)
            elif self._by_error and not all(stream.closed for stream in self.streams[-1]):
                yield None
            elif self._enough():
                self._complete = True
            else:
                self._open()

    def _open(self) -> None:
        number = len(self.streams)
        realisation = (
            Realisation(self.scene, self._seed, number)
            if self._realisations is None
            else self._realisations[number]
        )
        self._realisation, self._name = realisation, realisation.name
        self.streams.append([Stream() for _ in self.angles])

    @property
    def _by_error(self) -> bool:
        return self.scene.accuracy.standard_error is not None

    def _more(self, stream: Stream) -> bool:
        return not stream.closed and (self._by_error or stream.issued < len(self._sizes))

    def _item(self, stream: Stream) -> WorkItem:
        angle = self.streams[-1].index(stream)
        number = stream.issued
        stream.issued += 1
        size = self._size if self._by_error else self._sizes[number]
        parts = ROUND if self._by_error else len(self._sizes)
        rounds, part = divmod(number, parts)
        theta, phi = self.angles[angle]
        if self._turn:
            # From all sides in turn, the same for every seed: then what two runs on one
            # surface differ by is their rays' error.
            phi += 360 * (part + rounds * _GOLDEN) / parts
        return WorkItem(self._realisation, self._name, angle, theta, phi, number, size, part, parts)

    def _least(self) -> int:
        """Realisations to make in any case."""
        if self._realisations is not None:
            return len(self._realisations)
        return self.scene.surface.realisations

    def _enough(self) -> bool:
        done = len(self.streams)
        if done < self._least() or self._realisations is not None or not self._by_error:
            return done >= self._least()
        if not self.scene.requires.roughness or done >= self._most:
            return True
        if done < self._look:
            return False
        self._look = _next_look(done)
        surplus = uncertainty.surplus(self.to_dataset(), self.scene)
        self._expected = min(done * surplus**2, self._most)
        return surplus <= 1

    def stream(self, item: WorkItem) -> Stream:
        """Where a work item belongs."""
        return self.streams[item.realisation.number][item.angle]

    def take(self, item: WorkItem, tally: Tally, count: int = 1) -> None:
        """Take in what ``count`` work items of a stream, from this one on, came to.

        What is beyond enough is dropped.
        """
        stream = self.stream(item)
        stream.issued = max(stream.issued, item.number + count)
        stream.waiting[item.number] = count, tally
        while not stream.closed and stream.added in stream.waiting:
            number, finished = stream.waiting.pop(stream.added)
            stream.tally = finished if stream.tally is None else stream.tally + finished
            stream.added += number
            self._decide(stream)
        if stream.closed:
            stream.waiting.clear()

    def waiting(self) -> int:
        """Finished work items that wait for an earlier one."""
        return sum(len(stream.waiting) for row in self.streams for stream in row)

    def _decide(self, stream: Stream) -> None:
        """Close a stream that has enough; errors are looked at ever less often."""
        if not self._by_error:
            stream.closed = stream.added == len(self._sizes)
            return
        # Work items that were put together skip looks, all of which said that more are wanted.
        while stream.look < stream.added:
            stream.look = _whole_rounds(_next_look(stream.look))
        if stream.tally is not None and stream.added == stream.look:
            stream.look = _whole_rounds(_next_look(stream.look))
            dataset = self._to_dataset([[stream.tally]], ([0.0], [0.0]))
            # The mean over realisations is that much better than each of them.
            surplus = uncertainty.surplus(dataset, self.scene) / np.sqrt(self._least())
            stream.expected = stream.added * surplus**2
            stream.closed = surplus <= 1

    def share_done(self) -> float:
        """Estimate which part of all the work is finished, from the errors so far."""
        done = float(np.mean([self._share(stream) for stream in self.streams[-1]]))
        return (len(self.streams) - 1 + done) / max(
            self._expected, self._least(), len(self.streams)
        )

    def _share(self, stream: Stream) -> float:
        if stream.closed:
            return 1.0
        return min(stream.added / (stream.expected if self._by_error else len(self._sizes)), 1.0)

    def to_dataset(self) -> xr.Dataset:
        """Everything so far, with its labels."""
        rows = [
            [stream.tally for stream in row if stream.tally is not None] for row in self.streams
        ]
        return self._to_dataset(rows, (self.scene.light.theta, self.scene.light.phi))

    def _to_dataset(
        self, rows: list[list[Tally]], angles: tuple[Sequence[float], Sequence[float]]
    ) -> xr.Dataset:
        return to_dataset(
            self.scene, facet_optics(self.scene), rows, angles, self._seed, fold=self._turn
        )

    def tallies(self) -> list[Tally]:
        """All of them, to be summed up."""
        return [stream.tally for row in self.streams for stream in row if stream.tally is not None]


def _next_look(now: int) -> int:
    """Errors are looked at ever less often: a look costs, and chance passes one of many."""
    return -(-now * 5 // 4)


def _whole_rounds(items: int) -> int:
    return -(-items // ROUND) * ROUND
