"""Fresnel's equations for unpolarised light, and their diffuse averages.

Written with n² − 1 taken out as a factor, so that neither n → 1 nor grazing
incidence subtracts two nearly equal numbers. μ is the cosine of the angle of
incidence in air, n ≥ 1 the relative index.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def _terms(mu: ArrayLike, n: ArrayLike) -> tuple[Array, Array, Array, Array]:
    mu, n = np.asarray(mu, dtype=np.float64), np.asarray(n, dtype=np.float64)
    excess = (n - 1) * (n + 1)
    return mu, n, excess, np.sqrt(excess + mu**2)


def reflectance(mu: ArrayLike, n: ArrayLike) -> Array:
    """Fresnel reflectance F(μ) of a dielectric, μ in [0, 1], n ≥ 1; 1 at μ = 0 if n > 1, 0 if n = 1."""
    mu, n, excess, g = _terms(mu, n)
    with np.errstate(invalid="ignore", divide="ignore"):
        r_s = excess / (g + mu) ** 2
        r_p = excess * ((n**2 + 1) * mu**2 - 1) / (n**2 * mu + g) ** 2
    return np.where(n == 1, 0.0, (r_s**2 + r_p**2) / 2)


def transmittance(mu: ArrayLike, n: ArrayLike) -> Array:
    """T(μ) = 1 − F(μ), with relative accuracy also at grazing incidence; 1 if n = 1."""
    mu, n, _, g = _terms(mu, n)
    with np.errstate(invalid="ignore", divide="ignore"):
        t = 2 * g * mu * (1 / (g + mu) ** 2 + n**2 / (n**2 * mu + g) ** 2)
    return np.where(n == 1, 1.0, t)


_PANELS = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)


def external_diffuse_reflectance(n: ArrayLike) -> Array:
    """Return r_e = ∫_0^1 2 μ F(μ) dμ, the part of diffuse light a dielectric reflects outside.

    By quadrature in t, μ = √(n²−1) sinh t, where √(n²−1+μ²) + μ = √(n²−1) e^t and
    F is smooth: relative error below 1e−14 for n − 1 from 1e−12 to 99. The closed
    form (Duntley 1942) loses digits as n → 1.
    """
    n = np.asarray(n, dtype=np.float64)
    root = np.sqrt((n - 1) * (n + 1))[..., None]
    with np.errstate(divide="ignore"):
        top = np.where(root > 0, np.arcsinh(1 / np.where(root > 0, root, 1.0)), 0.0)
    t = ((np.arange(_PANELS)[:, None] + (_NODES + 1) / 2) / _PANELS).ravel() * top
    weights = np.tile(_WEIGHTS / (2 * _PANELS), _PANELS)
    mu = root * np.sinh(t)
    integrand = 2 * mu * reflectance(mu, n[..., None]) * root * np.cosh(t)
    return np.asarray(top[..., 0] * (integrand @ weights))


def internal_diffuse_reflectance(n: ArrayLike) -> Array:
    """Return r_i = 1 − (1 − r_e)/n², the part of diffuse light reflected back inside."""
    n = np.asarray(n, dtype=np.float64)
    return np.asarray(((n - 1) * (n + 1) + external_diffuse_reflectance(n)) / n**2)
