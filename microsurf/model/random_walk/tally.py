"""Count where walks left to: the detector's bins of `microsurf.results.datasets`."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...results import detector
from ...results.layers import LENGTHS, length_bins
from .facet_kernels import ABSORBED

Array = NDArray[np.float64]

CAUSES = ("absorbed", "left out", "endless")
"""Why a walk reaches no detector: it ended in the substrate, its second facet was left
out on purpose, or it had more events than any walk can have, and is lost."""


@dataclass(frozen=True)
class WalkTally:
    """What a number of walks came to; tallies add up.

    Attributes
    ----------
    counts : ndarray of int64, shape (body_events, order, rings, sectors)
        Walks that left, by bin.
    ended : ndarray of int64, shape (causes,)
        Walks that did not.
    paths, events : int
        Walks, and facet events of all of them.
    lengths : ndarray, shape (body_events, 2, LENGTHS)
        Walks that left two layers by their length inside, and the sum of these lengths, before
        absorption on the way, see `results.layers`; of other walks there are none.

    """

    counts: NDArray[np.int64]
    ended: NDArray[np.int64]
    paths: int
    events: int
    lengths: Array

    @classmethod
    def empty(cls) -> Self:
        """No walks."""
        shape = (0, len(detector.ORDERS), detector.RINGS, detector.SECTORS)
        ended = np.zeros(len(CAUSES), np.int64)
        return cls(np.zeros(shape, np.int64), ended, 0, 0, no_lengths())

    def __add__(self, other: "WalkTally") -> "WalkTally":
        """Add up; the one with fewer body events is padded with zeros."""
        return WalkTally(
            _added(self.counts, other.counts),
            self.ended + other.ended,
            self.paths + other.paths,
            self.events + other.events,
            _added(self.lengths, other.lengths),
        )


def no_lengths() -> Array:
    """Lengths of no walks."""
    return np.zeros((0, 2, LENGTHS))


def _added(one: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    longer, shorter = sorted((one, other), key=len, reverse=True)
    total = longer.copy()
    total[: len(shorter)] += shorter
    return total


def tally_walks(
    exits: Array, events: NDArray[np.int64], phi_i: float, *, single: bool
) -> WalkTally:
    """Count walks by bin.

    Parameters
    ----------
    exits : array, shape (walks, 3)
        Unit directions in which they left.
    events : array of int64, shape (walks, 2)
        Numbers of facet events and of body events; in place of the latter ABSORBED or
        OVER for walks that did not leave.
    phi_i : float
        Azimuth of incidence in degrees.
    single : bool
        Whether walks were over at a second facet on purpose.

    """
    total = int(events[:, 0].sum())
    ended = np.zeros(len(CAUSES), np.int64)
    left = events[:, 1] >= 0
    paths = len(left)
    if not left.all():
        over = events[~left, 1] != ABSORBED
        ended[0], ended[1 if single else 2] = np.sum(~over), np.sum(over)
        exits, events = exits[left], events[left]
    order, body = np.minimum(events[:, 0], len(detector.ORDERS)) - 1, events[:, 1]
    if body.size and body.max() > detector.BODY_EXACT:
        body = detector.body_bins_of(body)
    lobe = detector.RINGS * detector.SECTORS
    code = (body * len(detector.ORDERS) + order) * lobe + detector.bins_of(exits, phi_i)
    shape = (-1, len(detector.ORDERS), detector.RINGS, detector.SECTORS)
    size = int(np.prod(shape[1:]))
    counts = np.bincount(code, minlength=size)
    counts = np.pad(counts, (0, -len(counts) % size)).reshape(shape)
    return WalkTally(counts, ended, paths, total, no_lengths())


def tally_layered(
    exits: Array,
    events: NDArray[np.int64],
    phi_i: float,
    thickness: float,
    gap: float,
    rng: np.random.Generator,
) -> WalkTally:
    """Count walks in two layers by bin; those that the layer absorbs on their way out end there.

    Parameters
    ----------
    exits, events : array
        As `layered_kernels.layered_walk` fills them. Events are changed: absorbed light has none.
    phi_i : float
        Azimuth of incidence in degrees.
    thickness : float
        Absorption times gap: exp(−thickness · length) of the light is left.
    gap : float
        In cells.
    rng : numpy.random.Generator
        Draws which.

    """
    lengths = _by_length(exits[:, 3] * gap, events[:, 1])
    if thickness > 0:
        left = np.exp(-thickness * exits[:, 3])
        taken = (events[:, 1] >= 0) & (rng.random(len(exits)) >= left)
        events[taken, 1] = ABSORBED
    tally = tally_walks(exits[:, :3], events[:, :2], phi_i, single=False)
    return replace(tally, events=int(events[:, 4].sum()), lengths=lengths)


def _by_length(length: Array, body: NDArray[np.int64]) -> Array:
    """Walks that were inside and left, see `WalkTally`; ``length`` in cells."""
    been = body > 0
    length, body = length[been], detector.body_bins_of(body[been])
    lengths = np.zeros((int(body.max(initial=-1)) + 1, 2, LENGTHS))
    bins = length_bins(length)
    np.add.at(lengths[:, 0], (body, bins), 1.0)
    np.add.at(lengths[:, 1], (body, bins), length)
    return lengths
