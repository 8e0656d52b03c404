"""The cone of directions a detector collects: what a narrow lobe is averaged over."""

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError

Array = NDArray[np.float64]

LARGEST = 60.0
_POINTS = 61
_GOLDEN = np.pi * (3 - np.sqrt(5))


def cone(o: Array, aperture: float) -> Array:
    """Directions evenly spread over a cone about each o, shape (pairs, points, 3).

    ``aperture`` is the full angle in degrees. Fibonacci's spiral puts points of equal solid
    angle on the cap: means over lobes not narrower than a fifth of the cone are good to 1 %.

    Raises
    ------
    InputError
        If the aperture is not in (0, 60].

    """
    if not 0 < aperture <= LARGEST:
        raise InputError(
            f"aperture = {aperture}: must be > 0 … {LARGEST:g} degrees, the full angle of the cone"
        )
    k = np.arange(_POINTS) + 0.5
    z = 1 - (1 - np.cos(np.radians(aperture) / 2)) * k / _POINTS
    radius, turn = np.sqrt(1 - z**2), _GOLDEN * k
    local = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    # Any two axes across o will do.
    other = np.where(np.abs(o[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    x = np.cross(other, o)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    axes = np.stack([x, np.cross(o, x), o], axis=1)
    return np.asarray(np.einsum("ka,pab->pkb", local, axes))
