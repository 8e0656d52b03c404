"""What compiled code reads and writes: the rays under way, and what the detector has seen."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...results import detector

BATCHES = 32
"""Light rays are dealt to so many batches in turn, all of them all over the tile: their
spread is the rays' error."""

LOST = ("below", "behind", "wrapped")
"""Why a path can be lost: it left the tile beneath its lowest point, it met the back of
a triangle, or it went round the period `empty_space.MOST_WRAPS` times and met nothing."""
ENDS = ("absorbed", "left out", *LOST)
"""How light can end that reaches no detector; compiled code knows these by their index."""
ABSORBED, LEFT_OUT, BELOW, BEHIND, WRAPPED = range(len(ENDS))


class RayBatch(NamedTuple):
    """Rays under way.

    State: facet events, body events, times round the period, batch; and of a fan's ray
    (see `fans`) the rings between which the first blocked one is, and its own, else −1;
    how often it was lost and sent again.
    """

    origins: NDArray[np.float32]
    embree_directions: NDArray[np.float32]
    directions: NDArray[np.float64]
    weight: NDArray[np.float64]
    state: NDArray[np.int64]
    fan: NDArray[np.float64]


def empty_ray_batch(size: int) -> RayBatch:
    """Room for ``size`` rays."""
    return RayBatch(
        np.zeros((size, 3), np.float32),
        np.zeros((size, 3), np.float32),
        np.zeros((size, 3)),
        np.zeros(size),
        np.zeros((size, 8), np.int64),
        np.zeros((size, 9)),
    )


class Tallies(NamedTuple):
    """What has ended, in units of the power of one light ray.

    Attributes
    ----------
    energy : ndarray, shape (body_events, order, sectors, rings)
        Light that arrived in each bin.
    squares : ndarray, shape (kind, sectors, rings)
        Sum of squared weights of order 1, specular and with one body event.
    batches : ndarray, shape (BATCHES, order, body_events)
        Light that arrived, by batch.
    ended : ndarray, shape (len(ENDS),)
        Light that did not.
    lost : ndarray of int64, shape (len(ENDS),)
        Paths it had ended with.

    """

    energy: NDArray[np.float64]
    squares: NDArray[np.float64]
    batches: NDArray[np.float64]
    ended: NDArray[np.float64]
    lost: NDArray[np.int64]


def empty_tallies() -> Tallies:
    """Nothing seen yet."""
    events, orders = len(detector.BODY_EVENTS), len(detector.ORDERS)
    return Tallies(
        np.zeros((events, orders, detector.SECTORS, detector.RINGS)),
        np.zeros((len(detector.KINDS), detector.SECTORS, detector.RINGS)),
        np.zeros((BATCHES, orders, events)),
        np.zeros(len(ENDS)),
        np.zeros(len(ENDS), np.int64),
    )
