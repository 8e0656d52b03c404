"""The detector: bins by order, number of body events, θ_o and φ_o that all results share.

Numbers of body events above BODY_EXACT share bins 25 % wide, named by their middle. If b is
spread evenly over a bin the mean of w^b is then off by less than 2e−3 (of 1, not of what is
left); if it falls geometrically the sum over bins is off by less than 5e−3 of all body light,
at worst near w = 0.97 where hardly any path escapes.

Rings in θ_o, sectors in φ_o − φ_i, both in degrees. The first ring is the cap
θ_o < 1°; rings and sectors are centred so that mirror directions at whole even
degrees lie inside a bin and not on an edge. The mirror side is φ_o − φ_i = 180°.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

ORDERS = (1, 2, 3, 4)
KINDS = ("specular", "body")
SECTORS = 36
RING_EDGES = np.concatenate([[0.0], np.arange(1.0, 90.0, 2.0), [90.0]])
SECTOR_EDGES = (np.arange(SECTORS + 1) - 0.5) * 360 / SECTORS
RINGS = len(RING_EDGES) - 1

BODY_EXACT = 16


def _body_edges() -> NDArray[np.int64]:
    edges = list(range(BODY_EXACT + 2))
    while edges[-1] < 10**9:
        edges.append(-(-edges[-1] * 5 // 4))
    return np.array(edges)


BODY_EDGES = _body_edges()
"""First number of body events of each bin; the last edge closes the last bin."""
BODY_EVENTS = (BODY_EDGES[:-1] + BODY_EDGES[1:] - 1) / 2
"""Number of body events that stands for each bin."""


def ring_centres() -> Array:
    """θ_o of the rings in degrees; 0 for the cap."""
    centres = (RING_EDGES[:-1] + RING_EDGES[1:]) / 2
    centres[0] = 0.0
    return np.asarray(centres)


def solid_angles() -> Array:
    """∫ dω of each bin in sr, shape (rings, 1)."""
    return np.asarray(-np.diff(np.cos(np.radians(RING_EDGES)))[:, None] * 2 * np.pi / SECTORS)


def projected_solid_angles() -> Array:
    """∫ cosθ dω of each bin in sr, shape (rings, 1)."""
    return np.asarray(np.diff(np.sin(np.radians(RING_EDGES)) ** 2)[:, None] * np.pi / SECTORS)


def ring_of(theta_o: float) -> int:
    """Index of the ring that holds θ_o, in degrees."""
    return int(_rings_of(theta_o))


def _rings_of(theta_o: ArrayLike) -> NDArray[np.intp]:
    return np.clip(np.searchsorted(RING_EDGES, theta_o, side="right") - 1, 0, RINGS - 1)


def bins_of(o: Array, phi_i: float) -> NDArray[np.int64]:
    """Bins of directions, numbered ring by ring: ring · SECTORS + sector.

    Parameters
    ----------
    o : ndarray, shape (count, 3)
        Unit vectors above the horizon.
    phi_i : float
        Azimuth of incidence, from which sectors count, in degrees.

    Returns
    -------
    ndarray of int64, shape (count,)

    """
    ring = _rings_of(np.degrees(np.arccos(np.minimum(o[:, 2], 1))))
    turn = (np.degrees(np.arctan2(o[:, 1], o[:, 0])) - phi_i) / 360 * SECTORS
    return ring * SECTORS + np.floor(turn + 0.5).astype(np.int64) % SECTORS


def body_bins_of(body_events: ArrayLike) -> NDArray[np.int64]:
    """Bins of numbers of body events ≥ 0; the first BODY_EXACT of them are their own."""
    return np.searchsorted(BODY_EDGES, body_events, side="right") - 1
