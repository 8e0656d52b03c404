"""STD fitted to the facets of a surface, by maximum likelihood.

Isotropic: per facet, −ln f = ln πσ² + γ ln(1 + η x), x = |slope|²/σ², η = 1/(γ−1)
(Ribardière et al. 2017; the bivariate Student t). η = 0 is Beckmann, so the
profile likelihood is followed in η and γ = ∞ is an inner value of the search's
closed range and not a limit to run after.

A share f₀ of facets that do not slope is a point mass: beyond η = (1−f₀)/f₀ the
likelihood grows without bound as σ falls. What is found is the highest maximum inside;
without one there is no fit.

Facets of one surface are far from independent: the intervals come from a sandwich
estimator (White, Econometrica 50(1), 1982) with scores summed over tiles of the
surface, each of which is taken as one observation. They hold for surfaces whose
correlation is short against a tile, an eighth of a side. KS is in-sample.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..errors import InputError
from .anisotropy import Anisotropy, anisotropy_of
from .heightfield import Heightfield, facet_slopes, measured_facets
from .statistics import ks_distance

Array = NDArray[np.float64]

_TILES = 8  # a side: 64 observations for the covariance of two parameters
_MIN_FACETS = 2 * _TILES**2
_NORMAL_95 = 1.959963984540054
_MAX_ETA = 20.0  # γ = 1.05: beyond, no mean slope for a mesh to show
_FLAT = 1e-6
"""Of the median slope: STD has one facet in 1e12 below, so what lies there does not slope."""
_SAME = 1e-9  # relative: differences of heights round so
_SEARCH = 24
"""Values of 1/γ at which the profile is looked at first: it may have several minima."""
_BECKMANN_ETA = 1e-3
"""Smallest 1/(γ−1) distinguished from Beckmann: KS between the two is then below 3e−4."""


@dataclass(frozen=True)
class StdFit:
    """STD that fits a surface best.

    gamma in (1, ∞], ∞ standing for 1e3 and more, and sigma > 0, each with its 95 %
    interval (`gamma_ci`, `sigma_ci`; sampling only, see the module). ks is the
    distance of the facets to the fit, in-sample. A fit depends on scale, so it
    states pixel = the spacing, shortest = 2 pixels and longest = the longer side,
    wavelengths in the user's unit; facets is their number, effective_facets that
    of independent ones that would know σ as well. flat is the share of facets without
    slope, which no STD has: a plateau, a filled gap, a coarse step of heights.
    anisotropy tells whether the slopes have a direction; then no isotropic STD fits.
    """

    gamma: float
    gamma_ci: tuple[float, float]
    sigma: float
    sigma_ci: tuple[float, float]
    ks: float
    pixel: float
    shortest: float
    longest: float
    facets: int
    effective_facets: float
    flat: float
    anisotropy: Anisotropy


def fit_std(h: Heightfield) -> StdFit:
    """Fit isotropic STD to the facet slopes of a surface. Level a measured one first.

    Facets that touch a filled point have no say.

    Raises
    ------
    InputError
        If there are fewer than 128 facets, half of them do not slope at all, or the
        likelihood has no maximum, which flat facets and tails below γ = 1.05 cause.

    """
    p, q = facet_slopes(h)
    measured = measured_facets(h)
    everywhere = p**2 + q**2
    slope2 = everywhere.ravel() if measured is None else everywhere[measured]
    if slope2.size < _MIN_FACETS:
        raise InputError(f"{slope2.size} facets: a fit needs {_MIN_FACETS}; take a larger surface")
    least = _FLAT**2 * np.median(slope2)
    slope2[slope2 <= least] = 0.0
    everywhere[everywhere <= least] = 0.0
    flat = int(np.count_nonzero(slope2 == 0))
    if flat >= slope2.size // 2:
        raise InputError(_too_flat(flat, slope2.size))
    if np.ptp(slope2) <= _SAME * slope2.max():
        raise InputError(
            f"all facets slope by {np.sqrt(slope2.max()):.4g}: no STD fits; level the surface"
        )
    eta, log_variance = _maximise(slope2, flat)
    covariance, naive = _covariances(everywhere, measured, eta, log_variance)
    sigma = float(np.exp(log_variance / 2))
    reach_eta, reach_log = _NORMAL_95 * np.sqrt(np.diagonal(covariance))
    rho = np.sqrt(np.sort(slope2)) / sigma
    gamma = _gamma(eta)
    effective = slope2.size * naive[1, 1] / covariance[1, 1] if covariance[1, 1] > 0 else np.nan
    if not np.isfinite([sigma, reach_eta, reach_log, effective]).all():
        raise InputError(
            f"γ = {gamma:.4g}, σ = {sigma:.4g}: their likelihood gives no interval, so these are "
            "no fit; take a larger surface"
        )
    return StdFit(
        gamma=gamma,
        gamma_ci=(_gamma(eta + reach_eta), _gamma(eta - reach_eta)),
        sigma=sigma,
        sigma_ci=(float(sigma * np.exp(-reach_log / 2)), float(sigma * np.exp(reach_log / 2))),
        ks=ks_distance(rho, gamma),
        pixel=math.sqrt(h.pixel[0] * h.pixel[1]),
        shortest=2 * max(h.pixel),
        longest=max(n * d for n, d in zip(h.heights.shape, h.pixel[::-1], strict=True)),
        facets=slope2.size,
        effective_facets=float(effective),
        flat=flat / slope2.size,
        anisotropy=anisotropy_of(p, q, eta, measured),
    )


def _gamma(eta: float) -> float:
    return float(1 + 1 / eta) if eta > _BECKMANN_ETA else float("inf")


def _too_flat(flat: int, facets: int) -> str:
    return (
        f"{flat} of {facets} facets ({flat / facets:.1%}) are flat: no STD fits; there may be a "
        "plateau, a filled gap or a coarse step of heights. Cut it out, or measure heights finer"
    )


def _maximise(slope2: Array, flat: int) -> tuple[float, float]:
    """Return η and ln σ² of the highest likelihood that is a maximum; ``flat`` facets have none.

    Raises
    ------
    InputError
        If it only rises towards the end of the range of η.

    """
    # A start for the inner search; the next is the solution at the last η.
    start = [float(np.log(np.mean(slope2)))]

    def negative(eta: float) -> float:
        start[0] = _best_log_variance(slope2, eta, start[0])
        return start[0] + float(np.mean(_kernel(slope2 * np.exp(-start[0]), eta)))

    # With flat facets short of where the inner equation has no solution any more.
    top = min(_MAX_ETA, 0.999 * (slope2.size - flat) / flat) if flat else _MAX_ETA
    inverse_gammas = np.linspace(0, top / (1 + top), _SEARCH)
    etas = inverse_gammas / (1 - inverse_gammas)
    values = np.array([negative(eta) for eta in etas])
    inner = np.flatnonzero(values[:-1] < np.minimum(values[1:], np.append(np.inf, values[:-2])))
    if inner.size == 0:
        raise InputError(
            _too_flat(flat, slope2.size)
            if top < _MAX_ETA
            else f"the slopes' tail is heavier than any with γ > {1 + 1 / _MAX_ETA:.3g}: no STD "
            "fits; there may be spikes in the heights. Take them out"
        )
    best = int(inner[np.argmin(values[inner])])
    start[0] = _best_log_variance(slope2, etas[best], float(np.log(np.mean(slope2))))
    optimum = minimize_scalar(
        negative,
        bounds=(etas[max(best - 1, 0)], etas[best + 1]),
        method="bounded",
        options={"xatol": 1e-6},
    )
    eta = float(optimum.x)
    return eta, _best_log_variance(slope2, eta, start[0])


def _kernel(x: Array, eta: float) -> Array:
    """γ ln(1 + η x), and its limit x at η = 0."""
    return np.asarray((1 + 1 / eta) * np.log1p(eta * x)) if eta > 0 else x


def _best_log_variance(slope2: Array, eta: float, start: float) -> float:
    """Return ln σ² at which the mean of (1+η) x/(1+ηx) is 1, by Newton's method.

    The mean falls monotonically in σ², from (1+η)/η times the share of facets that
    slope, which must be > 1, to 0.
    """
    t = start
    for _ in range(100):
        x = slope2 * np.exp(-t)
        ratio = x / (1 + eta * x)
        value = (1 + eta) * float(np.mean(ratio)) - 1
        slope = (1 + eta) * float(np.mean(ratio * (1 - eta * ratio)))
        step = float(np.clip(value / slope, -2, 2))
        t += step
        if abs(step) < 1e-12:
            break
    return t


def _covariances(
    slope2: Array, measured: NDArray[np.bool_] | None, eta: float, log_variance: float
) -> tuple[Array, Array]:
    """Covariance of (η, ln σ²) by tiles, and as if facets were independent."""
    x = slope2 * np.exp(-log_variance)
    counted = 1.0 if measured is None else measured

    def score(x: Array, eta: float) -> Array:
        return _score(x, eta) * counted

    first = score(x, eta)
    # The information, by differences of the score: one-sided at Beckmann.
    step = 1e-4 * (1 + eta)
    by_eta = (score(x, eta + step) - first).mean(axis=(1, 2, 3)) / step
    by_log = (score(x * np.exp(-step), eta) - first).mean(axis=(1, 2, 3)) / step
    information = -np.stack([by_eta, by_log], axis=1)
    inverse = np.linalg.inv((information + information.T) / 2) / slope2.size
    tiles = _tile_sums(first.sum(axis=1))
    scores = tiles.reshape(2, -1)
    spread = scores @ scores.T * (scores.shape[1] / max(scores.shape[1] - 2, 1))
    return np.asarray(inverse @ spread @ inverse), np.asarray(inverse)


def _score(x: Array, eta: float) -> Array:
    """Return the derivatives of ln f by η and by ln σ², shape (2, …), at x = |slope|²/σ²."""
    if eta > 1e-6:
        by_eta = np.log1p(eta * x) / eta**2 - (1 + 1 / eta) * x / (1 + eta * x)
    else:
        by_eta = x**2 / 2 - x
    return np.stack([by_eta, (1 + eta) * x / (1 + eta * x) - 1])


def _tile_sums(values: Array) -> Array:
    """Sum (2, rows, columns) over tiles, at most 8 a side."""
    for axis in (1, 2):
        count = values.shape[axis]
        edges = np.unique(np.arange(_TILES) * count // _TILES)
        values = np.add.reduceat(values, edges, axis=axis)
    return values
