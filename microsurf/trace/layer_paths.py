"""Paths between two layers as whole arrays, and what the detector counts of those that arrive."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..results import detector
from ..results.layers import length_bins
from .kernels.exact_layers import (
    INNER_HITS,
    LENGTH,
    LENGTH_LIGHT,
    LENGTH_SUM,
    MANY,
    SUBSTRATE_EVENTS,
)
from .kernels.state import ABSORBED, Tallies

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(eq=False)
class LayerPaths:
    """Paths under way, one row each.

    Attributes
    ----------
    point : ndarray, shape (paths, 3)
        Where the path was last, in cells.
    start : ndarray, shape (paths, 3)
        Where its next ray starts, a little off the facet.
    d : ndarray, shape (paths, 3)
        Unit vector along which it goes on, not in cells.
    within : ndarray of bool
        Whether it is between the surfaces.
    order, entries, events, hits, wraps, batch : ndarray of int64
        Hits on the interface from outside, entries, substrate events, hits on the interface from
        below, times round the period, batch.
    length : ndarray
        Length inside in cells.

    """

    point: Array
    start: Array
    d: Array
    within: Flags
    order: NDArray[np.int64]
    entries: NDArray[np.int64]
    events: NDArray[np.int64]
    hits: NDArray[np.int64]
    wraps: NDArray[np.int64]
    batch: NDArray[np.int64]
    length: Array

    @classmethod
    def begin(cls, start: Array, d: Array, batch: NDArray[np.int64]) -> "LayerPaths":
        """Light rays that have met nothing yet."""
        order, entries, events, hits, wraps = np.zeros((5, len(batch)), np.int64)
        within, length = np.zeros(len(batch), bool), np.zeros(len(batch))
        return cls(
            start.copy(), start, d, within, order, entries, events, hits, wraps, batch, length
        )

    def of(self, rows: Flags) -> "LayerPaths":
        """Some of them."""
        return LayerPaths(*(values[rows] for values in vars(self).values()))


def count_exits(
    paths: LayerPaths, absorption: float, azimuth: float, tallies: Tallies, inside: Array
) -> None:
    """Count paths that reach the detector.

    Body events are 0 of paths that were never inside, else one more than the substrate events.
    Sectors count from ``azimuth``, in degrees; ``inside`` is the table of `kernels.exact_layers`.
    """
    been = paths.entries > 0
    body = np.where(been, detector.body_bins_of(paths.events + 1), 0)
    order = np.minimum(paths.order, len(detector.ORDERS)) - 1
    left = np.exp(-absorption * paths.length)
    ring, sector = np.divmod(detector.bins_of(paths.d, azimuth), detector.SECTORS)
    np.add.at(tallies.energy, (body, order, sector, ring), left)
    np.add.at(tallies.batches, (paths.batch, order, body), left)
    one, kind = order == 0, np.minimum(body, 1)
    np.add.at(tallies.squares, (kind[one], sector[one], ring[one]), left[one] ** 2)
    tallies.ended[ABSORBED] += (1 - left).sum()
    _record(paths.of(been), body[been], inside)


def _record(paths: LayerPaths, body: NDArray[np.int64], inside: Array) -> None:
    """Fill the table of what has been inside, before absorption on the way."""
    ones = np.ones(len(body))
    reflections = np.minimum(paths.order - paths.entries, MANY)
    passages = reflections * (MANY + 1) + np.minimum(paths.entries, MANY)
    decade_bin = length_bins(paths.length)
    for row, values in (
        (passages, ones),
        (np.full_like(body, LENGTH), paths.length),
        (np.full_like(body, SUBSTRATE_EVENTS), paths.events.astype(float)),
        (np.full_like(body, INNER_HITS), paths.hits.astype(float)),
        (LENGTH_LIGHT + decade_bin, ones),
        (LENGTH_SUM + decade_bin, paths.length),
    ):
        np.add.at(inside, (row, body), values)
