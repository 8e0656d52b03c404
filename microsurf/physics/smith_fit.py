"""Smith's Λ of STD as published: a closed part and a rational fit of the rest.

Ribardière et al., Computer Graphics Forum 36(2), 2017: eq. 13 with S1 of eq. 14 and the
fit of S2 in eqs. 22 and 23; the coefficients as two public renderers have them (appleseed
and BBM, which agree). With z = cotθ/σ(φ),

    Λ = Γ(γ−½)/(√π Γ(γ)) · ((γ−1)^γ/(2γ−3) · S1 + √(γ−1) · S2) − ½,
    S1 = (γ−1+z²)^(3/2−γ)/z,   S2 ≈ F21(z) (F22(γ) + F23(γ) F24(z)).

Measured against `smith`: off by up to 6.9e−3 in G1 (at γ = 2; 5e−3 and more for γ ≥ 40),
and Λ falls to −4.5e−3, so that G1 > 1, for γ about 2 to 5. It is here to be measured beside
the exact function, which costs as much, and nothing uses it by default.
"""

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike, NDArray

from ..errors import float_array
from . import smith

Array = NDArray[np.float64]

_F21 = (0, 1.066, 2.655, 4.892), (1.038, 2.969, 4.305, 4.418)
_F22 = (14.402, -27.145, 20.574, -2.745), (-30.612, 86.567, -84.341, 29.938)
_F23 = (-129.404, 324.987, -299.305, 93.268), (-92.609, 256.006, -245.663, 86.064)
_F24 = (6.537, 6.074, -0.623, 5.223), (6.538, 6.103, -3.218, 6.347)


def _rational(fit: tuple[tuple[float, ...], tuple[float, ...]], v: Array) -> Array:
    """A ratio of two cubics; of large v in 1/v, whose powers do not overflow."""
    large = np.abs(v) > 1
    u = np.where(large, 1 / np.where(large, v, 1.0), np.where(large, 1.0, v))
    above, below = (np.where(large, polyval(u, c[::-1]), polyval(u, c)) for c in fit)
    return np.asarray(above / below)


def lambda_of_z(z: ArrayLike, gamma: float) -> Array:
    """Λ as a function of z = cotθ/σ ≥ 0, γ in (3/2, ∞); ∞ at z = 0, and 0 at z = ∞.

    The fit itself does not end at 0 but within 3e−3 of it: as in the public codes,
    normal incidence alone is set to 0.
    """
    z = float_array("z", z)
    inside = (z > 0) & np.isfinite(z)
    v = np.where(inside, z, 1.0)
    free = gamma - 1
    with np.errstate(over="ignore"):
        closed = np.exp((1.5 - gamma) * np.log1p((v / np.sqrt(free)) ** 2)) / v
    closed *= free**1.5 / (2 * gamma - 3)
    g = np.asarray(gamma)
    fitted = _rational(_F21, v) * (_rational(_F22, g) + _rational(_F23, g) * _rational(_F24, v))
    # Γ(γ−½)/Γ(γ) by the constant of Student's t, which keeps its digits at large γ.
    ratio = np.exp(smith.log_student_constant(2 * free)) * np.sqrt(2 * np.pi / free)
    value = ratio / np.sqrt(np.pi) * (closed + np.sqrt(free) * fitted) - 0.5
    return np.where(inside, value, np.where(z == 0, np.inf, 0.0))


def g1(w: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None) -> Array:
    """Masking 1/(1+Λ(w)) by the fit, up to 1.0045; 0 at and below the horizon.

    Raises
    ------
    ValueError
        If γ is not in (3/2, ∞).

    """
    if not 1.5 < gamma < np.inf:
        raise ValueError(f"gamma = {gamma}: the published fit is for 3/2 < gamma < inf")
    w = float_array("w", w)
    up = w[..., 2] > 0
    with np.errstate(divide="ignore"):
        z = np.where(up, w[..., 2], 1.0) / smith.projected_roughness(w, sigma_x, sigma_y)
    return np.where(up, 1 / (1 + lambda_of_z(z, gamma)), 0.0)


def g2_separable(
    i: ArrayLike, o: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """G1(i) G1(o) by the fit."""
    return np.asarray(g1(i, gamma, sigma_x, sigma_y) * g1(o, gamma, sigma_x, sigma_y))


def g2_height_correlated(
    i: ArrayLike, o: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """1/(1+Λ(i)+Λ(o)) by the fit."""
    return smith.height_correlated(g1(i, gamma, sigma_x, sigma_y), g1(o, gamma, sigma_x, sigma_y))
