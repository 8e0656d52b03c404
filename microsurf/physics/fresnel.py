"""Fresnel's equations for unpolarised light, and their diffuse averages.

Written with n² − 1 taken out as a factor, so that neither n → 1 nor grazing
incidence subtracts two nearly equal numbers. μ is the cosine of the angle of
incidence in air, n ≥ 1 the relative index. Every function raises ValueError if
an n is below 1. A conductor has the complex index η = n + ik, k > 0, and any n > 0;
with η for n the equations are the same (Born and Wolf, Principles of Optics, §14.2).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import float_array, require

Array = NDArray[np.float64]


def _terms(mu: ArrayLike, n: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Return μ, n, n² − 1 and g = √(n² − 1 + μ²) = n cosθ_t as arrays."""
    mu, n = float_array("mu", mu), float_array("n", n)
    require(bool(np.all(n >= 1)), "n", np.min(n, initial=np.inf), ">= 1, a relative index")
    excess = (n - 1) * (n + 1)
    return mu, n, excess, np.sqrt(excess + mu**2)


class _Conductor(NamedTuple):
    """Terms of η = n + ik: η² and η² − 1, and at each μ g = √(η² − 1 + μ²) and denominators."""

    eta2: complex
    excess: complex
    g: NDArray[np.complex128]
    across: Array  # |g + μ|²
    along: Array  # |η² μ + g|²


def _conductor(mu: ArrayLike, index: ArrayLike, k: float) -> _Conductor:
    mu, n = float_array("mu", mu), float_array("n", index).item()
    require(n > 0 and k > 0, "(n, k)", (n, k), "> 0, both, of a conductor")
    eta2 = complex((n - k) * (n + k), 2 * n * k)
    excess = complex((n - 1) * (n + 1) - k**2, 2 * n * k)
    g = np.sqrt(excess + mu**2)
    return _Conductor(eta2, excess, g, np.abs(g + mu) ** 2, np.abs(eta2 * mu + g) ** 2)


def _absorbed(metal: _Conductor, mu: Array) -> Array:
    """T(μ) of a conductor."""
    in_s = metal.g.real / metal.across
    in_p = (metal.eta2 * metal.g.conj()).real / metal.along
    return np.asarray(2 * mu * (in_s + in_p))


def reflectance(mu: ArrayLike, n: ArrayLike, k: float = 0.0) -> Array:
    """Fresnel reflectance F(μ), μ in [0, 1]; 0 if n = 1 and k = 0.

    Relative error a few roundings, so that it may pass 1 by one at grazing. With an
    extinction coefficient k > 0, of a conductor, n is one number; 14 digits are right for
    n from 1e−3 to 100 beyond what conditioning costs near total reflection.
    """
    if k != 0:
        metal, squared = _conductor(mu, n, k), np.square(mu)
        r_s = np.abs(metal.excess) / metal.across
        r_p = np.abs(metal.excess * ((metal.eta2 + 1) * squared - 1)) / metal.along
        # Where n < 1 mirrors nearly all, errors of g cancel in T and not in r_s and r_p.
        absorbed = _absorbed(metal, float_array("mu", mu))
        return np.where(absorbed < 0.5, 1 - absorbed, (r_s**2 + r_p**2) / 2)
    mu, n, excess, g = _terms(mu, n)
    with np.errstate(invalid="ignore", divide="ignore"):  # n = 1 at grazing
        r_s = excess / (g + mu) ** 2
        r_p = excess * ((n**2 + 1) * mu**2 - 1) / (n**2 * mu + g) ** 2
    return np.where(n == 1, 0.0, (r_s**2 + r_p**2) / 2)


def conductor_derivatives(mu: ArrayLike, n: float, k: float) -> tuple[Array, Array]:
    """∂F/∂n and ∂F/∂k of a conductor's reflectance, k > 0.

    Both amplitudes r are holomorphic in η = n + ik, and F is half the sum of their |r|².
    """
    metal, mu, eta = _conductor(mu, n, k), float_array("mu", mu), complex(n, k)
    along = metal.eta2 * mu + metal.g
    r_s, r_p = (mu - metal.g) / (mu + metal.g), (metal.eta2 * mu - metal.g) / along
    rise = eta / metal.g  # of g
    by_s = -2 * mu * rise / (mu + metal.g) ** 2
    by_p = 2 * mu * eta * (2 * metal.g - eta * rise) / along**2
    total = r_s.conj() * by_s + r_p.conj() * by_p
    return np.asarray(total.real), np.asarray(-total.imag)


def transmittance(mu: ArrayLike, n: ArrayLike, k: float = 0.0) -> Array:
    """T(μ) = 1 − F(μ), with relative accuracy also at grazing incidence; 1 if n = 1 and k = 0.

    What goes into a conductor (k > 0) is absorbed there.
    """
    if k != 0:
        return _absorbed(_conductor(mu, n, k), float_array("mu", mu))
    mu, n, _, g = _terms(mu, n)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):  # n = 1 at grazing
        t = 2 * g * mu * (1 / (g + mu) ** 2 + n**2 / (n**2 * mu + g) ** 2)
    return np.where(n == 1, 1.0, t)


def transmittance_bound(n: float) -> float:
    """A bound on T(μ) over all μ, for rejection: T(1) up to n = 2 + √3, else 1.

    Beyond that index T is largest near Brewster's angle and not at μ = 1.
    """
    return float(transmittance(1.0, n)) if n <= 2 + np.sqrt(3) else 1.0


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
# Panels in units of the whole range, halving towards 0 where F falls from 1 to its
# Brewster minimum at μ = 1/√(n²+1), within 1/n of the range.
_EDGES = np.concatenate([[0.0], np.geomspace(2.0**-12, 1 / 8, 10), np.arange(2, 9) / 8])


def _diffuse_nodes(n: ArrayLike) -> tuple[Array, Array, Array]:
    """Return n[..., None], and μ and weights on the last axis for ∫_0^1 2μ (…) dμ, n > 1.

    Gauss-Legendre panels in t, μ = √(n²−1) sinh t, where √(n²−1+μ²) + μ = √(n²−1) e^t
    and F is smooth. The weights are 0 where n = 1.
    """
    _, n, excess, _ = _terms(1.0, n)
    root = np.sqrt(excess)[..., None]
    top = np.arcsinh(1 / np.where(root > 0, root, np.inf))
    half = np.diff(_EDGES)[:, None] / 2
    t = (_EDGES[:-1, None] + half * (1 + _NODES)).ravel() * top
    mu = root * np.sinh(t)
    return n[..., None], mu, top * (half * _WEIGHTS).ravel() * 2 * mu * root * np.cosh(t)


def external_diffuse_reflectance(n: ArrayLike) -> Array:
    """Return r_e = ∫_0^1 2 μ F(μ) dμ, the part of diffuse light a dielectric reflects outside.

    Relative error below 1e−14 for n − 1 from 1e−12 to 1e4. The closed form
    (Duntley 1942) loses digits as n → 1.
    """
    n, mu, weights = _diffuse_nodes(n)
    return np.asarray(np.sum(reflectance(mu, n) * weights, axis=-1))


def external_diffuse_transmittance(n: ArrayLike) -> Array:
    """Return 1 − r_e = ∫_0^1 2 μ T(μ) dμ, with relative accuracy also for large n; 1 if n = 1."""
    n, mu, weights = _diffuse_nodes(n)
    total = np.sum(transmittance(mu, n) * weights, axis=-1)
    return np.where(n[..., 0] == 1, 1.0, total)


def internal_diffuse_reflectance(n: ArrayLike) -> Array:
    """Return r_i = 1 − (1 − r_e)/n², the part of diffuse light reflected back inside.

    Take (1 − r_e)/n² from `external_diffuse_transmittance` where 1 − r_i is wanted:
    for large n the difference has few digits left.
    """
    n = float_array("n", n)
    return np.asarray(((n - 1) * (n + 1) + external_diffuse_reflectance(n)) / n**2)
