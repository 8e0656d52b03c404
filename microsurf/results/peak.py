"""The specular peak in the plane of incidence: how high, where, how wide.

Of the intensity f cosθ_o (power per solid angle over the incident one, sr⁻¹), which unlike
f itself falls to 0 at grazing. Of light without a body event, all orders. At each point of
the plane it is the mean over the bins about it with Gaussian weights in the angle to it:
near the normal bins are small and hold little light, there many of them count. The weights
are as wide for all that is compared with a reference, a tenth of its lobe's full width, so
that a noisy lobe has its own maximum and not that of its noise.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from . import detector

Array = NDArray[np.float64]

FIGURES = ("height", "position", "width")
_PART = 0.1
"""Width of the weights over that of the lobe: lowers a Gaussian's ridge by 5 % and widens it
by 3 %, of measurement and model alike."""
_FIRST, _LEAST = 2.0, 1.0  # degrees: to find the width, and at least: bins are 2° wide


def angles() -> Array:
    """Signed θ_o of the points in degrees, positive on the mirror side."""
    rings = detector.ring_centres()
    return np.concatenate([-rings[:0:-1], rings])


@cache
def _weights(width: float) -> Array:
    """Matrix from the bins' energies to intensities at the points, shape (points, bins)."""
    theta = np.radians(detector.ring_centres())[:, None]
    # φ_o − φ_i is 180° on the mirror side.
    phi = np.radians(np.arange(detector.SECTORS) * 360 / detector.SECTORS - 180)
    points = np.radians(angles())[:, None, None]
    cosine = np.sin(theta) * np.cos(phi) * np.sin(points) + np.cos(theta) * np.cos(points)
    away = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    kernel = np.exp(-((away / width) ** 2) / 2)
    # A point at a bin's centre always has that bin; others may underflow.
    within = (kernel * detector.solid_angles()).sum(axis=(1, 2), keepdims=True)
    return np.asarray((kernel / within).reshape(len(points), -1))


def cut(lobe: Array, width: float) -> Array:
    """Intensities in sr⁻¹ at `angles` of energies in the bins, shape (…, bins)."""
    return np.asarray(lobe @ _weights(width).T)


def weight_width(lobe: Array) -> float:
    """Width of the weights in degrees for a reference's mean lobe, to a hundredth."""
    return round(max(_PART * float(figures(cut(lobe, _FIRST))[2]), _LEAST), 2)


def figures(values: Array) -> Array:
    """Height in sr⁻¹, position and full width at half height in degrees of one cut."""
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
