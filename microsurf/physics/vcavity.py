"""V-cavity masking and shadowing (Torrance and Sparrow, JOSA 57, 1967)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import float_array

Array = NDArray[np.float64]


def g1(w: ArrayLike, m: ArrayLike) -> Array:
    """Masking min(1, 2 (n·m)(n·w)/(w·m)) of facets m in direction w; 0 where either turns away."""
    w, m = float_array("w", w), float_array("m", m)
    facing = np.sum(w * m, axis=-1)
    visible = (facing > 0) & (w[..., 2] > 0) & (m[..., 2] > 0)
    return np.where(
        visible, np.minimum(1, 2 * m[..., 2] * w[..., 2] / np.where(visible, facing, 1)), 0.0
    )


def g2(i: ArrayLike, o: ArrayLike, m: ArrayLike) -> Array:
    """Masking and shadowing: the smaller of G1(i, m) and G1(o, m)."""
    return np.asarray(np.minimum(g1(i, m), g1(o, m)))
