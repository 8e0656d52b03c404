"""The specular peak in the plane of incidence: how high, where, how wide.

Of the intensity f cosθ_o (power per solid angle over the incident one, sr⁻¹), which unlike
f itself falls to 0 at grazing. Of light without a body event, all orders. Bins are 2° wide;
the cut is smoothed by a Gaussian of a part of the reference's width, the same one for all
that are compared with it, so that a noisy cut has a maximum of its lobe and not of its noise.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import ndimage

from . import result

Array = NDArray[np.float64]

FIGURES = ("height", "position", "width")
_PART = 0.1
"""Standard deviation of the smoothing over the width of the lobe: lowers a Gaussian by 2.7 %
and widens it as much, of measurement and model alike."""
_FIRST = 1.0  # rings, to find the width


def cut(specular: xr.DataArray) -> Array:
    """Intensity in sr⁻¹ along the plane of incidence, θ_o signed, last axis; else as given."""
    intensity = specular / xr.DataArray(
        np.repeat(result.solid_angles(), result.SECTORS, axis=1), dims=("theta_o", "phi_o")
    )
    plane = result.in_plane(intensity)
    return np.asarray(plane.transpose(..., "theta_o").values)


def angles() -> Array:
    """Signed θ_o of a cut in degrees, positive on the mirror side."""
    rings = result.ring_centres()
    return np.concatenate([-rings[:0:-1], rings])


def smoothing(values: Array) -> float:
    """Standard deviation in rings to smooth with, from a reference's mean cut."""
    width = _figures(ndimage.gaussian_filter1d(values, _FIRST, mode="nearest"))[2]
    return float(_PART * width / np.diff(result.ring_centres())[1])


def figures(values: Array, smooth: float) -> Array:
    """Height in sr⁻¹, position and full width at half height in degrees of one cut."""
    if smooth > 0.3:  # below, a ring's neighbours would have less than 1 %
        values = ndimage.gaussian_filter1d(values, smooth, mode="nearest")
    return _figures(values)


def _figures(values: Array) -> Array:
    theta = angles()
    top = int(np.argmax(values))
    height, position = float(values[top]), float(theta[top])
    if 0 < top < len(values) - 1:
        a, b, c = np.polyfit(theta[top - 1 : top + 2] - position, values[top - 1 : top + 2], 2)
        if a < 0:
            shift = -b / (2 * a)
            height, position = float(c + b * shift / 2), position + float(shift)
    half = height / 2
    left, right = np.flatnonzero(values[:top] < half), np.flatnonzero(values[top:] < half)
    low = _crossing(theta, values, left[-1], half) if left.size else float(theta[0])
    high = _crossing(theta, values, top + right[0] - 1, half) if right.size else float(theta[-1])
    return np.array([height, position, high - low])


def _crossing(theta: Array, values: Array, k: int, level: float) -> float:
    """θ between points k and k + 1 at which the line through them has the level."""
    part = (level - values[k]) / (values[k + 1] - values[k])
    return float(theta[k] + part * (theta[k + 1] - theta[k]))
