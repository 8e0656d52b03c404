"""Smith's masking of all directions of the detector's cones, from a table.

Λ is a function of one number x, see `physics.smith`, and a cone has 61 directions: with so
many of them a table is quicker than the formula. G1 is a cubic spline of ln x there, through 64
values a factor e; its relative error is 3e−9 at most.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ...model.single_scattering.facets import Masking
from ...physics import smith

Array = NDArray[np.float64]

_STEP = 1 / 64  # of ln x
_FROM = 8192  # directions: below, a table costs more than it saves
_MOST = np.log(1e10)
"""Of ln x: beyond, 1 − G1 is below 1e−10 for any γ > 3/2."""


def g1(o: Array, gamma: float, sigma_x: float, sigma_y: float) -> Array:
    """Masking G1 of unit directions with z > 0, shape (..., 3), σ > 0."""
    across = (sigma_x * o[..., 0]) ** 2 + (sigma_y * o[..., 1]) ** 2
    with np.errstate(divide="ignore"):  # at the zenith x is infinite
        at = np.minimum(np.log(2 * o[..., 2] ** 2 / across) / 2, _MOST)
    low = at.min()
    nodes = low + _STEP * np.arange(int((at.max() - low) / _STEP) + 4)
    values = 1 / (1 + smith.lambda_of_x(np.exp(nodes), 2 * gamma - 2))
    powers = CubicSpline(nodes, values).c * _STEP ** np.arange(3, -1, -1)[:, None]
    at -= low
    at /= _STEP
    cell = at.astype(np.intp)
    at -= cell
    result = np.take(powers[0], cell)
    for power in powers[1:]:
        result *= at
        result += np.take(power, cell)
    return result


def g2(i: Array, o: Array, gamma: float, sigma_x: float, sigma_y: float) -> Array:
    """Height-correlated G2, as `smith.g2_height_correlated`."""
    if o.size < 3 * _FROM:
        return smith.g2_height_correlated(i, o, gamma, sigma_x, sigma_y)
    std = gamma, sigma_x, sigma_y
    return smith.height_correlated(smith.g1(i, *std), g1(o, *std))


MASKING = Masking(g2)
"""Smith's height-correlated masking, from the table where there are many directions."""
