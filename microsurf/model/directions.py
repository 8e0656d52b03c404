"""Directions as arrays of unit vectors: made from angles, checked, broadcast."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]

_UNIT = 1e-9  # how far from 1 a length may be


def direction(theta: ArrayLike, phi: ArrayLike) -> Array:
    """Unit directions, shape (..., 3), from angles in radians."""
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack([x, y, np.cos(theta)], axis=-1)


def checked(**directions: ArrayLike) -> list[Array]:
    """Directions given by name, as float arrays of one common shape (..., 3).

    Raises
    ------
    InputError
        If one holds anything but unit vectors along its last axis.

    """
    for name, w in directions.items():
        if np.shape(w)[-1:] != (3,) or np.any(~(np.abs(np.linalg.norm(w, axis=-1) - 1) < _UNIT)):
            raise InputError(
                f"{name}: must be unit vectors along its last axis of 3; divide by length"
            )
    return list(np.broadcast_arrays(*(np.asarray(w, np.float64) for w in directions.values())))
