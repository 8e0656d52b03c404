"""Smith masking and shadowing of STD, exactly.

Smith, IEEE Trans. Antennas and Propagation 15, 1967; Heitz, "Understanding the
Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 3(2), 2014. With
ν = 2γ − 2 and x = √2 cotθ/σ(φ), and t_ν the density of Student's t,

    Λ(x) = (1/x) ∫_x^∞ (p − x) t_ν(p) dp = A − SF_ν(x),
    A    = K ν/((ν−1) x) (1 + x²/ν)^(−(ν−1)/2),
    K    = Γ((ν+1)/2) / (√(νπ) Γ(ν/2)).

The difference loses relative digits where Λ is small, so two forms without a
subtraction take over there (`_series`, `_laguerre`). All functions need
γ > 3/2: below, the mean slope, and with it Λ, is infinite.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import beta, binom, erfc, roots_laguerre, stdtr

from ..errors import float_array, require

Array = NDArray[np.float64]

_TERMS = 64  # of the series at z ≤ 1/2: the first left out is below 2^−64
_COEFFICIENTS = np.abs(binom(-0.5, np.arange(_TERMS)))  # (1/2)_k/k!
_LAGUERRE_FROM = 4.0  # smallest x at which 40 nodes hold 1e−14
_NODES, _WEIGHTS = roots_laguerre(40)


def log_student_constant(nu: float) -> float:
    """Return ln K, K the height of Student's t density at zero with ν > 0 degrees of freedom.

    From ν = 50 on by Stirling's series (error below 2e−18): the gamma functions
    overflow, and their logarithms lose digits in the difference.
    """
    if np.isinf(nu):
        return -0.5 * float(np.log(2 * np.pi))
    if nu < 50:
        return -float(np.log(np.sqrt(nu) * beta(nu / 2, 0.5)))
    r = 1 / nu
    tail = r * (-1 / 4 + r**2 * (1 / 24 + r**2 * (-1 / 20 + r**2 * (17 / 112 - r**2 * 31 / 36))))
    return float(-0.5 * np.log(2 * np.pi) + tail)


def projected_roughness(w: ArrayLike, sigma_x: float, sigma_y: float | None = None) -> Array:
    """Return sinθ σ(φ) of the directions w, shape (..., 3): σ(φ)² = σ_x²cos²φ + σ_y²sin²φ."""
    w = float_array("w", w)
    sigma_y = sigma_x if sigma_y is None else sigma_y
    return np.hypot(sigma_x * w[..., 0], sigma_y * w[..., 1])


def smith_lambda(w: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None) -> Array:
    """Smith's Λ of directions w, shape (..., 3), in (−∞, ∞); see the module for the formula.

    Λ ≥ 0 for w_z > 0, with relative accuracy also where it is tiny;
    Λ(−w) = −1 − Λ(w) below the horizon; ∞ at the horizon.

    Raises
    ------
    ValueError
        If γ ≤ 3/2 or a σ is negative or infinite.

    """
    sigma_y = sigma_x if sigma_y is None else sigma_y
    require(gamma > 1.5, "gamma", gamma, "> 3/2 for Smith's masking")
    finite = 0 <= sigma_x < np.inf and 0 <= sigma_y < np.inf
    require(finite, "sigma", (sigma_x, sigma_y), "finite and >= 0")
    w = float_array("w", w)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        x = np.sqrt(2) * np.abs(w[..., 2]) / projected_roughness(w, sigma_x, sigma_y)
    x = np.where(w[..., 2] == 0, 0.0, x)  # 0/0 if σ = 0, but still the horizon
    value = lambda_of_x(x, 2 * gamma - 2)
    return np.where(w[..., 2] < 0, -1 - value, value)


def lambda_of_x(x: ArrayLike, nu: float) -> Array:
    """Λ as a function of x = √2 cotθ/σ ≥ 0 and ν = 2γ − 2 > 1; ∞ at x = 0."""
    x = float_array("x", x)
    flat = np.atleast_1d(x).ravel()
    value = np.full_like(flat, np.nan)  # stays where x is no number or negative
    value[flat == 0], value[np.isinf(flat)] = np.inf, 0.0
    series = (flat >= np.sqrt(nu)) & np.isfinite(flat)
    laguerre = ~series & (flat >= _LAGUERRE_FROM) & np.isfinite(flat)
    direct = ~series & ~laguerre & (flat > 0) & np.isfinite(flat)
    # Overflow: to an infinite Λ near x = 0, and of x² far out, where Λ is 0 if ν = ∞.
    with np.errstate(over="ignore"):
        for where, form in ((series, _series), (laguerre, _laguerre), (direct, _direct)):
            if where.any():
                value[where] = form(flat[where], nu)
    return value.reshape(x.shape)


def _leading(x: Array, nu: float) -> Array:
    """Return A of the module's formula."""
    constant = log_student_constant(nu)
    if np.isinf(nu):
        return np.asarray(np.exp(constant - x**2 / 2) / x)
    power = np.exp(constant - (nu - 1) / 2 * np.log1p(x**2 / nu))
    return np.asarray(power * (nu / ((nu - 1) * x)))


def _direct(x: Array, nu: float) -> Array:
    survival = erfc(x / np.sqrt(2)) / 2 if np.isinf(nu) else stdtr(nu, -x)
    return np.asarray(_leading(x, nu) - survival)


def _series(x: Array, nu: float) -> Array:
    """Λ = K√ν z^(ν/2) Σ_k (1/2)_k/k! z^k (2k+1)/((ν−1)(ν+2k)), z = ν/(ν+x²) ≤ 1/2.

    Both parts of the difference expanded in z; every term is positive.
    """
    ratio2 = (np.sqrt(nu) / x) ** 2
    z = ratio2 / (1 + ratio2)
    total = np.zeros_like(z)
    for k in range(_TERMS - 1, -1, -1):
        total = total * z + _COEFFICIENTS[k] * (2 * k + 1) / (nu + 2 * k)
    # z^(ν/2) without z, which underflows first.
    log_power = -nu * (np.log(x / np.sqrt(nu)) + np.log1p(ratio2) / 2)
    power = np.exp(log_student_constant(nu) + log_power)
    return np.asarray(power * (np.sqrt(nu) / (nu - 1)) * total)


def _laguerre(x: Array, nu: float) -> Array:
    """Λ = A ∫ e^(−s) (p − x)/p ds with p² = x² + (ν + x²) expm1(2s/(ν−1)), for x ≥ 4, x² < ν."""
    if np.isinf(nu):
        rise = np.broadcast_to(2 * _NODES, (*x.shape, _NODES.size))
    else:
        rise = (nu + x[:, None] ** 2) * np.expm1(2 * _NODES / (nu - 1))
    p = np.sqrt(x[:, None] ** 2 + rise)
    return np.asarray(_leading(x, nu) * ((rise / (p * (p + x[:, None]))) @ _WEIGHTS))


def g1(w: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None) -> Array:
    """Masking G1(w) = 1/(1+Λ(w)) of facets that face w; 0 at and below the horizon."""
    w = float_array("w", w)
    up = w[..., 2] > 0
    value = smith_lambda(np.where(up[..., None], w, [0.0, 0.0, 1.0]), gamma, sigma_x, sigma_y)
    return np.where(up, 1 / (1 + value), 0.0)


def g2_separable(
    i: ArrayLike, o: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """Masking and shadowing taken as independent, G1(i) G1(o), for facets that face both."""
    return np.asarray(g1(i, gamma, sigma_x, sigma_y) * g1(o, gamma, sigma_x, sigma_y))


def g2_height_correlated(
    i: ArrayLike, o: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """G2 = 1/(1+Λ(i)+Λ(o)) (Heitz 2014, eq. 99), for facets that face both."""
    return height_correlated(g1(i, gamma, sigma_x, sigma_y), g1(o, gamma, sigma_x, sigma_y))


def height_correlated(seen_i: Array, seen_o: Array) -> Array:
    """G2 = 1/(1+Λ(i)+Λ(o)) in terms of both G1, which stay finite at the horizon where Λ is not."""
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(1 / (1 / seen_i + 1 / seen_o - 1))
