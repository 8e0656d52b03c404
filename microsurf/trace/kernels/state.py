"""What compiled code reads and writes: the rays under way, and what the detector has seen."""

from typing import Any, NamedTuple

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


ORDER, BODY, WRAPS, BATCH, LOW_RING, HIGH_RING, FAN_RING, RETRIES = range(8)
"""Columns of a ray's state: facet events, body events, times round the period, batch; of a
fan's ray (see `lobe_fans`) the rings between which the first blocked one is, and its own, else −1;
how often it was lost and sent again."""


class RayBatch(NamedTuple):
    """Rays under way.

    Attributes
    ----------
    origins, embree_directions : ndarray of float32, shape (rays, 3)
        As Embree takes them, in cells.
    directions : ndarray, shape (rays, 3)
        Unit vectors along which they travel, not in cells.
    weight : ndarray, shape (rays,)
        Light they carry, in units of one light ray's.
    state : ndarray of int64, shape (rays, 8)
        Columns ORDER … RETRIES.
    fan : ndarray, shape (rays, 9)
        The numbers of a fan's ray, columns `lobe_fans.START_X` and following.
    aspect : float
        Width of a cell over its depth, see `grid.Grid`.

    """

    origins: NDArray[np.float32]
    embree_directions: NDArray[np.float32]
    directions: NDArray[np.float64]
    weight: NDArray[np.float64]
    state: NDArray[np.int64]
    fan: NDArray[np.float64]
    aspect: float


def empty_ray_batch(size: int, aspect: float) -> RayBatch:
    """Room for ``size`` rays."""
    return RayBatch(
        np.zeros((size, 3), np.float32),
        np.zeros((size, 3), np.float32),
        np.zeros((size, 3)),
        np.zeros(size),
        np.zeros((size, 8), np.int64),
        np.zeros((size, 9)),
        aspect,
    )


class Frame(NamedTuple):
    """Where the mesh lies: its first vertex, above everything, the scale of rounding; in cells."""

    x0: float
    y0: float
    top: float
    reach: float


class Bins(NamedTuple):
    """The detector's bins as kernels look them up.

    Azimuth of incidence in degrees; cosines of the rings' outer edges, shape (rings,); edges
    of the numbers of body events.
    """

    azimuth: float
    ring_cosines: NDArray[np.float64]
    body_edges: NDArray[np.int64]


def bins_about(azimuth: float) -> Bins:
    """The detector's bins, for light that arrives from an azimuth in degrees."""
    return Bins(azimuth, np.cos(np.radians(detector.RING_EDGES[1:])), detector.BODY_EDGES)


class Scattering(NamedTuple):
    """What facets do to light: their optics, paths a light ray splits into, greatest T."""

    facet: Any
    branches: int
    bound: float


class FanWork(NamedTuple):
    """What fans need: see `lobe_fans`.

    Attributes
    ----------
    rings : Rings
        From the zenith to the nadir.
    blocked_counts : ndarray of int64, shape (LIKE, rings + 1)
        Where fans had their first blocked ring, to find the next one sooner.
    light, numbers : ndarray, shape (rings,) and (FAN,)
        Room for the shares and the numbers of one fan.

    """

    rings: Any
    blocked_counts: NDArray[np.int64]
    light: NDArray[np.float64]
    numbers: NDArray[np.float64]


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
