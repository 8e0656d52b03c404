"""Student's t-distribution of slopes (STD).

Ribardière et al., "STD: Student's t-Distribution of Slopes for Microfacet Based
BSDFs", Computer Graphics Forum 36(2), 2017; the form of Ribardière et al. 2018,
eq. 6. Slopes (p, q) = (−m_x/m_z, −m_y/m_z) are a bivariate Student t with
ν = 2γ − 2 degrees of freedom and scale σ/√2 an axis.

γ = 2 is GGX with α = σ, γ = ∞ is Beckmann with α = σ. All functions take γ as a
number in (1, ∞]; sigma_y defaults to sigma_x (isotropic). With anisotropy
|slope|²/σ² becomes ρ² = p²/σ_x² + q²/σ_y².
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import float_array, require

Array = NDArray[np.float64]

GGX = 2.0
"""γ at which STD is GGX (Trowbridge–Reitz) with α = σ."""

BECKMANN = np.inf
"""γ at which STD is Beckmann with α = σ."""


def _check(gamma: float, sigma_x: float, sigma_y: float | None) -> float:
    """Return sigma_y, or sigma_x in its place; refuse what has no distribution."""
    sigma_y = sigma_x if sigma_y is None else sigma_y
    require(gamma > 1, "gamma", gamma, "> 1 for a distribution of slopes")
    finite = 0 < sigma_x < np.inf and 0 < sigma_y < np.inf
    require(finite, "sigma", (sigma_x, sigma_y), "finite and > 0 for a density")
    return sigma_y


def log_kernel(rho2: ArrayLike, gamma: float) -> Array:
    """Return ln of (1 + ρ²/(γ−1))^(−γ), or its limit −ρ² at γ = ∞."""
    rho2 = float_array("rho2", rho2)
    if np.isinf(gamma):
        return np.asarray(-rho2)
    return np.asarray(-gamma * np.log1p(rho2 / (gamma - 1)))


def slope_density(
    p: ArrayLike, q: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """Density of facet slopes per unit of projected area, in 1/(dp dq).

    Parameters
    ----------
    p, q : array_like
        Slopes along x and y, dimensionless.
    gamma : float
        Shape, γ > 1; ∞ for Beckmann.
    sigma_x, sigma_y : float
        Roughness, > 0.

    """
    sigma_y = _check(gamma, sigma_x, sigma_y)
    p, q = float_array("p", p), float_array("q", q)
    with np.errstate(over="ignore"):  # of slopes past 1e150: their density is 0 in a double
        rho2 = (p / sigma_x) ** 2 + (q / sigma_y) ** 2
    return _over_area(log_kernel(rho2, gamma), sigma_x, sigma_y)


def _over_area(log: Array, sigma_x: float, sigma_y: float) -> Array:
    """Return e^log/(π σ_x σ_y); in two halves, or e^log underflows where the quotient does not."""
    half = np.exp(log / 2)
    return np.asarray(half * (half / (np.pi * sigma_x * sigma_y)))


def distribution(m: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None) -> Array:
    """Distribution of normals D(m) in sr⁻¹ (Ribardière et al. 2018, eq. 6).

    ∫ D(m) cosθ_m dm = 1. Zero where m_z ≤ 0. The power of the cosine is kept in
    the exponent so that grazing normals neither overflow nor underflow early; for
    γ < 2, where D diverges at grazing, down to cosines of 1e−150.
    """
    sigma_y = _check(gamma, sigma_x, sigma_y)
    m = float_array("m", m)
    up = m[..., 2] > 0
    cosine = np.where(up, m[..., 2], 1.0)
    with np.errstate(over="ignore"):
        rho2 = (np.hypot(m[..., 0] / sigma_x, m[..., 1] / sigma_y) / cosine) ** 2
    density = _over_area(log_kernel(rho2, gamma) - 4 * np.log(cosine), sigma_x, sigma_y)
    return np.where(up, density, 0.0)


def slope_cdf(r: ArrayLike, gamma: float, sigma: float = 1.0) -> Array:
    """Probability that |slope| ≤ r; with sigma = 1 and r = ρ also for anisotropy.

    F(r) = 1 − (1 + r²/((γ−1)σ²))^(1−γ), to full relative accuracy at small r.
    """
    _check(gamma, sigma, sigma)
    with np.errstate(over="ignore"):  # of slopes past 1e150: F is 1 there
        rho2 = (float_array("r", r) / sigma) ** 2
    if np.isinf(gamma):
        return np.asarray(-np.expm1(-rho2))
    return np.asarray(-np.expm1((1 - gamma) * np.log1p(rho2 / (gamma - 1))))


def slope_quantile(u: ArrayLike, gamma: float, sigma: float = 1.0) -> Array:
    """Return the |slope| below which a part u of the projected area lies, u in [0, 1].

    u = 1 gives ∞.
    """
    _check(gamma, sigma, sigma)
    u = float_array("u", u)
    with np.errstate(divide="ignore", over="ignore"):
        log_tail = -np.log1p(-u)
        rho2 = log_tail if np.isinf(gamma) else (gamma - 1) * np.expm1(log_tail / (gamma - 1))
    return np.asarray(sigma * np.sqrt(rho2))


def sample_slopes(
    rng: np.random.Generator,
    size: int | tuple[int, ...],
    gamma: float,
    sigma_x: float,
    sigma_y: float | None = None,
) -> tuple[Array, Array]:
    """Draw facet slopes (p, q) per unit of projected area, by the inverse CDF."""
    sigma_y = _check(gamma, sigma_x, sigma_y)
    rho = slope_quantile(rng.random(size), gamma)
    azimuth = 2 * np.pi * rng.random(size)
    return sigma_x * rho * np.cos(azimuth), sigma_y * rho * np.sin(azimuth)


def normals(p: ArrayLike, q: ArrayLike) -> Array:
    """Return unit facet normals m ∝ (−p, −q, 1), shape (..., 3)."""
    p, q = np.broadcast_arrays(float_array("p", p), float_array("q", q))
    m = np.stack([-p, -q, np.ones_like(p)], axis=-1)
    # Scaled by the largest component first: slopes of 1e200 would overflow squared.
    m /= np.max(np.abs(m), axis=-1, keepdims=True)
    return np.asarray(m / np.linalg.norm(m, axis=-1, keepdims=True))


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def area_beyond(slope: float, gamma: float, sigma: float) -> float:
    """Share of the *microsurface area* whose |slope| exceeds ``slope`` (isotropic).

    ∫_slope^∞ √(1+r²) dF(r) over the same from 0: area, not projected area. Relative
    error below 1e−13, times 1 + |ln| of the share where that is tiny.

    Raises
    ------
    ValueError
        If γ ≤ 3/2 (the area is infinite), σ is not positive and finite, or the
        slope is negative.

    """
    _check(gamma, sigma, sigma)
    if not gamma > 1.5:
        raise ValueError(f"gamma = {gamma}: the area of the surface is finite for gamma > 3/2 only")
    if not slope >= 0:
        raise ValueError(f"slope = {slope}: must be >= 0, it is the length of a slope")
    below, above = _areas(slope, gamma, sigma)
    return above / (below + above)


def mean_area(gamma: float, sigma: float) -> float:
    """Microsurface area per projected area, ∫ √(1+r²) dF(r), isotropic; relative error 1e−13.

    Raises ValueError as `area_beyond`.
    """
    _check(gamma, sigma, sigma)
    if not gamma > 1.5:
        raise ValueError(f"gamma = {gamma}: the area of the surface is finite for gamma > 3/2 only")
    return sum(_areas(sigma, gamma, sigma))


def _areas(slope: float, gamma: float, sigma: float) -> tuple[float, float]:
    """Microsurface area per projected area below and above a slope."""
    # In y = ln r the integrand is analytic in |Im y| < π/2 whatever γ and σ, and
    # falls as r² towards 0. Towards ∞ it falls as r^(3−2γ), too slowly to be
    # followed near γ = 3/2, but from `last` on it is that power to rounding.
    first = np.log(min(1.0, sigma)) - 22
    last = np.log(max(1.0, sigma * np.sqrt(min(gamma, 1e8)))) + 22
    middle = float(np.clip(np.log(slope), first, last)) if slope > 0 else first
    below = _area(np.linspace(first, middle, 2 + int(middle - first)), gamma, sigma)
    above = _area(_edges_of_tail(middle, last, gamma, sigma), gamma, sigma)
    if np.isfinite(gamma):
        power = 2 * gamma - 3
        decay = np.exp(min(0.0, power * (last - np.log(slope)))) if slope > 0 else 1.0
        tail = float(np.exp(_log_area_density(np.asarray(last), gamma, sigma))) / power
        below, above = below + tail * (1 - decay), above + tail * decay
    return float(below), float(above)


def _log_area_density(y: Array, gamma: float, sigma: float) -> Array:
    """Return ln of the microsurface area per unit of y = ln |slope| and of projected area."""
    rho2 = np.exp(2 * (y - np.log(sigma)))
    stretch = np.log1p(np.exp(2 * y)) / 2
    return np.asarray(np.log(2 * rho2) + log_kernel(rho2, gamma) + stretch)


def _edges_of_tail(low: float, high: float, gamma: float, sigma: float) -> Array:
    """Return panels of width ≤ 1 from low to high, doubling from what resolves the fall at low."""
    rho2 = np.exp(2 * (low - np.log(sigma)))
    rate = max(1.0, 2 * rho2 / ((1 - 1 / gamma) + rho2 / gamma))
    doubled = 2.0 ** np.arange(int(np.log2(rate)) + 1) / rate
    uniform = np.arange(doubled[-1], high - low, 1.0)
    edges = np.concatenate([[0.0], doubled, uniform[1:], [high - low]])
    return np.asarray(low + np.minimum(edges, high - low))


def _area(edges: Array, gamma: float, sigma: float) -> float:
    """Microsurface area over panels of y = ln |slope|, by Gauss-Legendre quadrature."""
    half = np.diff(edges)[:, None] / 2
    y = edges[:-1, None] + half * (1 + _NODES)
    return float(np.sum(half * _WEIGHTS * np.exp(_log_area_density(y, gamma, sigma))))
