"""Visible normals of STD, exactly, for rays from above and from below.

Facets m are seen in direction w with density ⟨w·m⟩ D(m)/σ(w), where σ(w) is the
projected area of the facets that face w (Heitz, JCGT 3(2), 2014, eq. 18; the
sampling was derived for this project). With slopes in units of σ/√2, ν = 2γ − 2, t_ν
Student's density, c = √2 cotθ/σ(φ) and K = t_ν(0), the slope p along the azimuth
of w has a density ∝ (c − p)₊ t_ν(p), and across it q is a scaled t_(ν+1). γ > 3/2.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import float_array
from . import smith, student_t

Array = NDArray[np.float64]


def projected_area(
    w: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """Area σ(w) = w_z (1 + Λ(w)) of the facets that face w, per unit of mean plane.

    w unit vectors of shape (..., 3). Below the horizon it is what a ray that goes up
    can still meet, −w_z Λ(−w), with relative accuracy.
    """
    w = float_array("w", w)
    nu = 2 * gamma - 2
    across = smith.projected_roughness(w, sigma_x, sigma_y) / np.sqrt(2)
    steep = np.abs(w[..., 2]) <= 1e-9 * across  # Λ grows as 1/cosθ: take the limit of the product
    upward = np.concatenate([w[..., :2], np.abs(w[..., 2:])], axis=-1)
    safe = np.where(steep[..., None], [0.0, 0.0, 1.0], upward)
    area = np.abs(w[..., 2]) * smith.smith_lambda(safe, gamma, sigma_x, sigma_y)
    area = np.where(steep, across * mean_excess(nu) - np.abs(w[..., 2]) / 2, area)
    return np.asarray(area + np.maximum(w[..., 2], 0))


def mean_excess(nu: float) -> float:
    """E = ∫_0^∞ p t_ν(p) dp = K ν/(ν−1), half the mean |p|; ν > 1."""
    constant = float(np.exp(smith.log_student_constant(nu)))
    return constant if np.isinf(nu) else constant * nu / (nu - 1)


def density(
    w: ArrayLike, m: ArrayLike, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> Array:
    """Density of facets m seen in direction w, in sr⁻¹."""
    w, m = float_array("w", w), float_array("m", m)
    facing = np.maximum(np.sum(w * m, axis=-1), 0)
    return np.asarray(
        facing
        * student_t.distribution(m, gamma, sigma_x, sigma_y)
        / projected_area(w, gamma, sigma_x, sigma_y)
    )


def sample(
    w: ArrayLike,
    gamma: float,
    sigma_x: float,
    sigma_y: float | None,
    rng: np.random.Generator,
) -> Array:
    """Draw one visible normal for each direction w.

    Parameters
    ----------
    w : array_like, shape (..., 3)
        Unit directions the facets are seen in; below the horizon too, where only
        facets steeper than w are.
    gamma : float
        Shape, γ > 3/2; ∞ for Beckmann.
    sigma_x, sigma_y : float
        Roughness, > 0.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    array, shape (..., 3)
        Unit normals with w·m > 0, but for rounding. Of slopes beyond 1e308, which only tails of
        γ < 1.53 have, cosines are below the smallest normal float: 11.9 digits are right in the
        normal as a whole, or the cosine is 0.

    Raises
    ------
    ValueError
        If γ ≤ 3/2: the projected area is infinite.

    """
    if not gamma > 1.5:
        raise ValueError(f"gamma = {gamma}: visible normals need gamma > 3/2")
    sigma_y = sigma_x if sigma_y is None else sigma_y
    w = float_array("w", w)
    flat = w.reshape(-1, 3)
    nu = 2 * gamma - 2
    scale = np.array([sigma_x, sigma_y]) / np.sqrt(2)
    stretched = flat[:, :2] * scale
    across = np.hypot(*stretched.T)
    with np.errstate(divide="ignore"):
        c = flat[:, 2] / across
    sign, log_p = _along(c, nu, rng)
    # One unit for all: slopes past 1e154 would overflow squared, past 1e308 themselves.
    unit = np.exp(-np.maximum(log_p, 0))
    p = sign * np.exp(np.minimum(log_p, 0))
    if np.isinf(nu):
        q = rng.standard_normal(len(p)) * unit
    else:
        q = rng.standard_t(nu + 1, len(p)) * np.sqrt((nu * unit**2 + p**2) / (nu + 1))
    azimuth = np.where(across[:, None] > 0, stretched, [1.0, 0.0])
    azimuth = azimuth / np.hypot(*azimuth.T)[:, None]
    slope_x = scale[0] * (p * azimuth[:, 0] - q * azimuth[:, 1])
    slope_y = scale[1] * (p * azimuth[:, 1] + q * azimuth[:, 0])
    m = np.stack([-slope_x, -slope_y, unit], axis=-1)
    return np.asarray(m / np.linalg.norm(m, axis=-1, keepdims=True)).reshape(w.shape)


def _along(c: Array, nu: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Slopes of density ∝ (c − p)₊ t_ν(p), as sign and ln |p|."""
    sign, log_p = np.full(c.shape, -1.0), np.zeros_like(c)
    pending = np.arange(len(c))
    while pending.size:
        above = c[pending] >= 0
        accepted = np.zeros(pending.size, dtype=bool)
        for chosen, draw in ((above, _seen_from_above), (~above, _seen_from_below)):
            if chosen.any():
                rows = pending[chosen]
                sign[rows], log_p[rows], accepted[chosen] = draw(c[rows], nu, rng)
        pending = pending[~accepted]
    return sign, log_p


def _seen_from_above(
    c: Array, nu: float, rng: np.random.Generator
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Draw from the mixture of |p| t_ν(p) on p < 0 and c t_ν(p); accept where it is too much.

    A rejected draw starts again here, with the choice between the two: the
    acceptance belongs to the mixture. It is at least 0.7.
    """
    excess = mean_excess(nu)
    # Not c/(c + E), which is ∞/∞ for w along the mean normal.
    steep = rng.random(len(c)) >= 1 / (1 + excess / np.maximum(c, np.finfo(float).tiny))
    log_rise = _log_expm1_exponential(rng.standard_exponential(len(c)), nu)
    t = rng.standard_normal(len(c)) if np.isinf(nu) else rng.standard_t(nu, len(c))
    with np.errstate(divide="ignore", over="ignore"):  # at c = 0 nothing with t > 0 is seen
        log_p = np.where(steep, log_rise / 2, np.log(np.abs(t)))
        # c is ∞ along the mean normal, where every facet is seen as it is.
        accepted = steep | (t <= 0) | (rng.random(len(c)) < 1 - t / c)
    return np.where(steep, -1.0, np.sign(t)), log_p, accepted


def _log_expm1_exponential(s: Array, nu: float) -> Array:
    """Return ln(ν expm1(2s/(ν−1))), where the power itself overflows as ν → 1."""
    if np.isinf(nu):
        return np.asarray(np.log(2 * s))
    rate = 2 * s / (nu - 1)
    return np.asarray(np.log(nu) + rate + np.log(-np.expm1(-rate)))


def _seen_from_below(
    c: Array, nu: float, rng: np.random.Generator
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Draw x = −p > a = −c of density ∝ (x − a) t_ν(x).

    In s, where x² = a² + (ν + a²) expm1(2s/(ν−1)), it is e^(−s)(1 − a/x). 1 − a/x is
    concave in s and 0 at s = 0, so it lies below 1 and below s·b with
    b = (ν + a²)/((ν−1) a²): draw s from e^(−s) or from s e^(−s), whichever bound is
    the lower. Accepted are at least 0.34, reached at a = 1 for γ = ∞; with the first
    alone it would be 1/a² there.
    """
    a = -c
    bound = 1 / a**2 if np.isinf(nu) else (nu / a**2 + 1) / (nu - 1)
    linear = bound < 1
    s = rng.standard_gamma(np.where(linear, 2.0, 1.0))
    with np.errstate(divide="ignore", over="ignore"):
        larger = 0.0 if np.isinf(nu) else np.log1p(a**2 / nu)
        relative = np.exp(_log_expm1_exponential(s, nu) + larger - 2 * np.log(a))
        growth = np.log1p(relative) / 2  # ln(x/a)
        log_x = np.log(a) + growth
        log_x = np.where(np.isfinite(relative), log_x, (_log_expm1_exponential(s, nu) + larger) / 2)
    part = -np.expm1(-growth)
    accepted = rng.random(len(a)) * np.where(linear, bound * s, 1.0) < part
    return np.full(len(a), -1.0), log_x, accepted
