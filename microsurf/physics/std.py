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

Array = NDArray[np.float64]

GGX = 2.0
"""γ at which STD is GGX (Trowbridge–Reitz) with α = σ."""

BECKMANN = np.inf
"""γ at which STD is Beckmann with α = σ."""


def _check(gamma: float, sigma_x: float, sigma_y: float | None) -> float:
    """Return sigma_y, or sigma_x in its place; refuse what has no distribution."""
    sigma_y = sigma_x if sigma_y is None else sigma_y
    if not gamma > 1:
        raise ValueError(f"gamma = {gamma}: a distribution of slopes needs gamma > 1")
    if not (0 < sigma_x < np.inf and 0 < sigma_y < np.inf):
        raise ValueError(f"sigma = ({sigma_x}, {sigma_y}): a density needs finite sigma > 0")
    return sigma_y


def log_kernel(rho2: ArrayLike, gamma: float) -> Array:
    """Return ln of (1 + ρ²/(γ−1))^(−γ), or its limit −ρ² at γ = ∞."""
    rho2 = np.asarray(rho2, dtype=np.float64)
    if np.isinf(gamma):
        return np.negative(rho2)
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
    p, q = np.asarray(p, dtype=np.float64), np.asarray(q, dtype=np.float64)
    rho2 = (p / sigma_x) ** 2 + (q / sigma_y) ** 2
    return np.asarray(np.exp(log_kernel(rho2, gamma)) / (np.pi * sigma_x * sigma_y))


def distribution(
    m: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """Distribution of normals D(m) in sr⁻¹ (Ribardière et al. 2018, eq. 6).

    ∫ D(m) cosθ_m dm = 1. Zero where m_z ≤ 0. The power of the cosine is kept in
    the exponent so that grazing normals neither overflow nor underflow early.
    """
    sigma_y = _check(gamma, sigma_x, sigma_y)
    m = np.asarray(m, dtype=np.float64)
    up = m[..., 2] > 0
    cosine = np.where(up, m[..., 2], 1.0)
    rho2 = ((m[..., 0] / sigma_x) ** 2 + (m[..., 1] / sigma_y) ** 2) / cosine**2
    density = np.exp(log_kernel(rho2, gamma) - 4 * np.log(cosine)) / (np.pi * sigma_x * sigma_y)
    return np.where(up, density, 0.0)


def slope_cdf(r: ArrayLike, gamma: float, sigma: float = 1.0) -> Array:
    """Probability that |slope| ≤ r; with sigma = 1 and r = ρ also for anisotropy.

    F(r) = 1 − (1 + r²/((γ−1)σ²))^(1−γ), to full relative accuracy at small r.
    """
    _check(gamma, sigma, sigma)
    rho2 = (np.asarray(r, dtype=np.float64) / sigma) ** 2
    if np.isinf(gamma):
        return np.asarray(-np.expm1(-rho2))
    return np.asarray(-np.expm1((1 - gamma) * np.log1p(rho2 / (gamma - 1))))


def slope_quantile(u: ArrayLike, gamma: float, sigma: float = 1.0) -> Array:
    """Return the |slope| below which a part u of the projected area lies, u in [0, 1].

    u = 1 gives ∞.
    """
    _check(gamma, sigma, sigma)
    u = np.asarray(u, dtype=np.float64)
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
    """Unit facet normals m ∝ (−p, −q, 1), shape (..., 3)."""
    p, q = np.broadcast_arrays(np.asarray(p, np.float64), np.asarray(q, np.float64))
    m = np.stack([-p, -q, np.ones_like(p)], axis=-1)
    # Scaled by the largest component first: slopes of 1e200 would overflow squared.
    m /= np.max(np.abs(m), axis=-1, keepdims=True)
    return np.asarray(m / np.linalg.norm(m, axis=-1, keepdims=True))


def area_beyond(slope: float, gamma: float, sigma: float) -> float:
    """Share of the *microsurface area* whose |slope| exceeds ``slope`` (isotropic).

    ∫_slope^∞ √(1+r²) dF(r) over the same from 0: area, not projected area. Needs
    γ > 3/2 (below, the area is infinite); raises ValueError otherwise.
    """
    if not gamma > 1.5:
        raise ValueError(f"gamma = {gamma}: the area of the surface is finite for gamma > 3/2 only")
    # With the tail's probability s = 1 − F as variable the integrand grows like
    # s^(−1/(2γ−2)); s = v^a flattens it for every γ > 3/2. In logarithms, because
    # near γ = 3/2 both factors leave the range of a double.
    a = 1.0 if np.isinf(gamma) else (2 * gamma - 2) / (2 * gamma - 3)
    nodes, weights = np.polynomial.legendre.leggauss(32)
    edges = np.concatenate([[0.0], np.geomspace(1e-12, 1.0, 49)])

    def area(v_top: float) -> float:
        low, high = v_top * edges[:-1, None], v_top * edges[1:, None]
        log_v = np.log(low + (high - low) * (nodes + 1) / 2)
        stretch = a * log_v if np.isinf(gamma) else a * log_v / (gamma - 1)
        log_rho2 = np.log(-stretch) if np.isinf(gamma) else (
            np.log(gamma - 1) - stretch + np.log(-np.expm1(stretch))
        )
        log_area = np.logaddexp(0.0, 2 * np.log(sigma) + log_rho2) / 2
        return float(np.sum((high - low) / 2 * weights * np.exp(log_area + (a - 1) * log_v)))

    tail = np.exp(log_kernel((slope / sigma) ** 2, gamma) * (1 if np.isinf(gamma) else 1 - 1 / gamma))
    return area(float(tail) ** (1 / a)) / area(1.0)
