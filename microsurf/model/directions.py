"""Directions as arrays of unit vectors: made from angles, checked, broadcast."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, real_array

Array = NDArray[np.float64]

_UNIT = 1e-6  # how far from 1 a length may be: that of a float32 vector is off by 1e-7


def direction(theta: ArrayLike, phi: ArrayLike) -> Array:
    """Unit directions, shape (..., 3), from angles in radians."""
    theta, phi = np.broadcast_arrays(
        real_array("theta", theta).astype(np.float64), real_array("phi", phi).astype(np.float64)
    )
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack([x, y, np.cos(theta)], axis=-1)


def checked(**directions: ArrayLike) -> list[Array]:
    """Directions given by name, as float64 arrays of one common shape (..., 3), of length 1.

    Lengths within 1e-6 of 1, as of float32 vectors, are made 1.

    Raises
    ------
    InputError
        If one holds anything but unit vectors along its last axis.

    """
    return list(np.broadcast_arrays(*(_unit(name, w) for name, w in directions.items())))


def _unit(name: str, values: ArrayLike) -> Array:
    w = real_array(name, values).astype(np.float64)
    if w.shape[-1:] != (3,):
        raise InputError(
            f"{name} of shape {w.shape}: must be unit vectors along its last axis of 3"
        )
    length = np.linalg.norm(w, axis=-1, keepdims=True)
    off = ~(np.abs(length - 1) < _UNIT)  # not a number is off too
    if off.any():
        raise InputError(
            f"{name}: must be unit vectors within {_UNIT:g}, one has length {length[off][0]:.9g}; "
            f"in float64, divide by np.linalg.norm({name}, axis=-1, keepdims=True)"
        )
    return np.asarray(w / length)
