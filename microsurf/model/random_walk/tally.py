"""Count where walks left to: the detector's bins of `microsurf.results.datasets`."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...results import detector
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

    """

    counts: NDArray[np.int64]
    ended: NDArray[np.int64]
    paths: int
    events: int

    @classmethod
    def empty(cls) -> Self:
        """No walks."""
        shape = (0, len(detector.ORDERS), detector.RINGS, detector.SECTORS)
        return cls(np.zeros(shape, np.int64), np.zeros(len(CAUSES), np.int64), 0, 0)

    def __add__(self, other: "WalkTally") -> "WalkTally":
        """Add up; the one with fewer body events is padded with zeros."""
        longer, shorter = sorted((self.counts, other.counts), key=len, reverse=True)
        counts = longer.copy()
        counts[: len(shorter)] += shorter
        return WalkTally(
            counts, self.ended + other.ended, self.paths + other.paths, self.events + other.events
        )


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
    return WalkTally(counts, ended, paths, total)


def tally_layered(
    exits: Array,
    events: NDArray[np.int64],
    phi_i: float,
    thickness: float,
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
    rng : numpy.random.Generator
        Draws which.

    """
    if thickness > 0:
        left = np.exp(-thickness * exits[:, 3])
        taken = (events[:, 1] >= 0) & (rng.random(len(exits)) >= left)
        events[taken, 1] = ABSORBED
    tally = tally_walks(exits[:, :3], events[:, :2], phi_i, single=False)
    return replace(tally, events=int(events[:, 4].sum()))
