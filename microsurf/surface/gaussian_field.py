"""Periodic Gaussian fields, the raw material of every made surface, isotropic on the mesh's facets.

Made in the discrete Fourier transform from white noise, with the spectrum of the
autocorrelation exp(−dᵀ A d) folded at the sampling frequency.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.optimize import brentq

from .. import memory

Array = NDArray[np.float64]

_ALIASES = 2  # spectra folded at ±1, ±2 sampling frequencies: exact to e^−15 for L ≥ ½


_SMALL = 2**14
"""Heights whose transform is over before a second thread has begun, or cores are counted."""


def threads_for(heights: int) -> int:
    """Threads for the Fourier transform of so many heights; its bits are the same with any."""
    return 1 if heights < _SMALL else memory.cores()


def inverse_lengths(
    correlation: float, ratio_x: float, ratio_y: float
) -> tuple[float, float, float]:
    """Return A_xx, A_yy, A_xy of the autocorrelation exp(−dᵀ A d) of the initial field.

    With a = exp(−A_xx) and b = exp(−A_yy) a facet's slopes have the variances
    2(1−a), 2(1−b) and the covariance 1 + ab·exp(−2A_xy) − a − b. For (p/σ_x, q/σ_y)
    to be isotropic 1−a : 1−b = σ_x² : σ_y² and the covariance is zero, which needs
    a slight tilt A_xy: both triangles share the diagonal's direction.
    """
    if ratio_x == ratio_y:
        xx = yy = correlation**-2
    else:

        def geometric_mean(log_t: float) -> float:
            t = np.exp(log_t)
            logs = -np.log1p(-t * ratio_x**2), -np.log1p(-t * ratio_y**2)
            return float(np.log(logs[0]) + np.log(logs[1]) + 4 * np.log(correlation))

        # At the top one axis is white noise: no shorter mean length has this ratio.
        top = float(-2 * np.log(max(ratio_x, ratio_y))) - 1e-9
        low = min(top, -4 * float(np.log(correlation))) - 50
        t = np.exp(top if geometric_mean(top) <= 0 else brentq(geometric_mean, low, top))
        xx, yy = float(-np.log1p(-t * ratio_x**2)), float(-np.log1p(-t * ratio_y**2))
    # (a+b−1)/(ab) = 1 − (1−a)(1−b)/(ab), without its cancellation at long correlation.
    lost = np.expm1(xx) * np.expm1(yy)
    limit = 0.9 * np.sqrt(xx * yy)  # A must stay positive definite
    xy = min(-0.5 * np.log1p(-lost), limit) if lost < 1 else limit
    return xx, yy, float(xy)


def gaussian_field(white: Array, correlation: float, ratio_x: float, ratio_y: float) -> Array:
    """Periodic Gaussian field with the autocorrelation of `inverse_lengths`, any variance.

    Made of white noise, shape (rows, columns): noises that are correlated make fields that are.
    """
    rows, columns = white.shape
    xx, yy, xy = inverse_lengths(correlation, ratio_x, ratio_y)
    determinant = xx * yy - xy**2
    kx = 2 * np.pi * fft.rfftfreq(columns)
    ky = 2 * np.pi * fft.fftfreq(rows)[:, None]

    def log_power(kx: Array, ky: Array) -> Array:
        return np.asarray(-(yy * kx**2 - 2 * xy * kx * ky + xx * ky**2) / (4 * determinant))

    power = log_power(kx, ky)
    power[0, 0] = -np.inf  # no mean
    # Lengths beyond the period would underflow everywhere: only ratios matter.
    top = power.max()
    power -= top
    np.exp(power, out=power)
    if min(xx, yy) / determinant * np.pi**2 / 4 < 40:
        reach = range(-_ALIASES, _ALIASES + 1)
        for i, j in ((i, j) for i in reach for j in reach if (i, j) != (0, 0)):
            power += np.exp(log_power(kx + 2 * np.pi * i, ky + 2 * np.pi * j) - top)
        power[0, 0] = 0.0
    threads = threads_for(white.size)
    noise = fft.rfft2(white, workers=threads)
    noise *= np.sqrt(power)
    return np.asarray(fft.irfft2(noise, white.shape, workers=threads))
