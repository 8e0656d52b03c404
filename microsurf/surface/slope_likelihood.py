"""Likelihood of facet slopes under STD with any axes: its maximum, and how well that is known.

With the scatter matrix S, ρ² = sᵀ S⁻¹ s and η = 1/(γ−1) a facet of slope s has

    −ln f = ln π + ½ ln det S + (1 + 1/η) ln(1 + η ρ²)

(the bivariate Student t; Ribardière et al. 2017). η = 0 is Beckmann, an inner value of
the search's closed range and not a limit to run after. S has the eigenvalues σ_x² and
σ_y²; isotropic it is σ² times the unit matrix.

Facets of one surface are far from independent: covariances come from a sandwich
estimator (White, Econometrica 50(1), 1982) with scores summed over tiles of the surface.
Neighbouring tiles are still correlated: their products count with Bartlett's weights, ½
across a side and ¼ across a corner (Conley, Journal of Econometrics 92(1), 1999). It holds
for surfaces whose correlation is short against a tile, an eighth of a side; narrow ones get
fewer and larger tiles, and with them a wider Student's t.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TILES = 8
"""Tiles a side: 64 observations for the covariance of four parameters."""
FEW_TILES = 4
"""Of a surface so narrow that its eighths know of each other."""
MAX_ETA = 20.0
"""γ = 1.05: beyond, there is no mean slope for a mesh to show."""
_FEW = 30_000  # facets of the first search
_PROFILE = 24
"""Values of 1/γ at which the isotropic likelihood is looked at first: it may have several tops."""


@dataclass(frozen=True, eq=False)
class Maximum:
    """The highest likelihood: η, scatter S of shape (2, 2), the largest η that was allowed."""

    eta: float
    scatter: Array
    eta_limit: float


def maximise(p: Array, q: Array, *, isotropic: bool = False, eta: float | None = None) -> Maximum:
    """Find η and S of the highest likelihood, S isotropic or η given if asked.

    Where a share f₀ of the facets does not slope at all, the likelihood has a pole at
    S = 0 beyond η = (1 − f₀)/f₀: the search stays on this side of it.

    Parameters
    ----------
    p, q : ndarray, one shape
        Slopes along x and y; not all zero.

    """
    products = np.stack([p.ravel() ** 2, (p * q).ravel(), q.ravel() ** 2])
    scale = float(np.mean(products[0] + products[2])) / 2
    products /= scale
    limit = _limit(products[0] + products[2])
    few = products[:, :: max(products.shape[1] // _FEW, 1)]
    top = min(limit, _limit(few[0] + few[2]))
    low, high = (0.0, limit) if eta is None else (eta, eta)
    first, u = _start(few[0] + few[2], (low, min(high, top)))
    if eta is None and first == top:
        return Maximum(limit, scale * np.eye(2), limit)
    start = [first, u] if isotropic else [first, u, 0.0, u]
    if products.shape[1] > 2 * _FEW:
        # From the solution of a part it takes a third of the steps.
        start = _search(few, start, (low, high), 1e-9)
    best, u, v, w = (*_search(products, start, (low, high), 1e-13), 0.0, 0.0)[:4]
    root = np.array([[np.exp(u), 0.0], [v, np.exp(u if isotropic else w)]])
    return Maximum(float(best), scale * np.linalg.inv(root @ root.T), limit)


def _limit(slope2: Array) -> float:
    """The largest η that is looked at: short of the pole that flat facets make."""
    flat = float(np.mean(slope2 == 0))
    return min(MAX_ETA, 0.99 * (1 - flat) / flat) if flat > 0 else MAX_ETA


def _start(slope2: Array, etas: tuple[float, float]) -> tuple[float, float]:
    """η and u = −ln σ of the highest isotropic likelihood inside the range, roughly.

    Flat facets make the likelihood rise at the end of the range, towards a pole: that is no
    maximum. Without one inside, the end.
    """
    low, high = etas
    inverse = np.linspace(low / (1 + low), high / (1 + high), _PROFILE if high > low else 1)
    tried = inverse / (1 - inverse)
    logs = np.empty(len(tried))
    values = np.empty(len(tried))
    log = float(np.log(np.mean(slope2) / 2))
    for k, eta in enumerate(tried):
        logs[k] = log = _log_variance(slope2, eta, log)
        values[k] = log + float(np.mean(_kernel(slope2 * np.exp(-log), eta)[0]))
    before, after = np.append(np.inf, values[:-1]), np.append(values[1:], -np.inf)
    inside = np.flatnonzero((values < before) & (values <= after))
    best = int(inside[np.argmin(values[inside])]) if inside.size else len(tried) - 1
    return float(tried[best]), -logs[best] / 2


def _log_variance(slope2: Array, eta: float, start: float) -> float:
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
        if abs(step) < 1e-6:
            break
    return t


def _search(
    products: Array, start: list[float], etas: tuple[float, float], tolerance: float
) -> list[float]:
    """Return η, u, v, w of the highest likelihood, S⁻¹ = L Lᵀ with L = [eᵘ 0; v eʷ].

    Only η and u = w if isotropic, as ``start`` is; ``products`` p², pq and q² of order 1.
    """
    isotropic = len(start) == 2

    def negative(at: Array) -> tuple[float, Array]:
        """−ln f less its constant, and its gradient."""
        eta, u, v, w = (*at, 0.0, at[1])[:4] if isotropic else at
        eu, ew = np.exp(u), np.exp(w)
        # Not @: BLAS splits sums by its threads, whose number would change their last digits.
        rho2 = np.einsum("i,ij", [eu * eu, 2 * eu * v, v * v + ew * ew], products)
        value, by_eta, weight = _kernel(rho2, eta)
        pp, pq, qq = np.einsum("ij,j", products, weight) / weight.size
        by_u = 2 * (eu * eu * pp + eu * v * pq) - 1
        by_w = 2 * ew * ew * qq - 1
        mean = float(np.mean(value)) - u - w
        if isotropic:
            return mean, np.array([np.mean(by_eta), by_u + by_w])
        return mean, np.array([np.mean(by_eta), by_u, 2 * (eu * pq + v * qq), by_w])

    result = minimize(
        negative, start, jac=True, method="L-BFGS-B",
        bounds=[etas, *[(-20.0, 20.0)] * (len(start) - 1)],
        options={"ftol": tolerance, "gtol": 1e-7, "maxiter": 200, "maxls": 40},
    )  # fmt: skip
    return [float(x) for x in result.x]


def _kernel(rho2: Array, eta: float) -> tuple[Array, Array, Array]:
    """(1 + 1/η) ln(1 + η ρ²), its derivative by η, and its derivative by ρ²."""
    weight = (1 + eta) / (1 + eta * rho2)
    if eta > 1e-6:
        log = np.log1p(eta * rho2)
        return (1 + 1 / eta) * log, weight * rho2 / eta - log / eta**2, weight
    return rho2, rho2 - rho2**2 / 2, weight


def covariance(
    p: Array, q: Array, result: Maximum, measured: Mask | None = None, tiles: int = TILES
) -> tuple[Array, Array, float]:
    """Covariance of (η, m, d, e) about a maximum, S → R exp[m+d, e; e, m−d] Rᵀ, S = R Rᵀ.

    Parameters
    ----------
    p, q : ndarray, shape (splits, rows, columns)
        Slopes of all facets, see `heightfield.slopes_of_both_splits`.
    result : Maximum
        Of those that were measured.
    measured : ndarray of bool, shape (splits, rows, columns), optional
        Which were.
    tiles : int
        How many a side.

    Returns
    -------
    by tiles, as if facets were independent : ndarray, shape (4, 4)
    dof : float
        Degrees of freedom of the first, as of a quadratic form of independent tiles.

    """
    root = np.linalg.cholesky(result.scatter)
    u, v = np.einsum("ij,j...->i...", np.linalg.inv(root), np.stack([p, q]))
    if measured is None:
        measured = np.ones(p.shape, dtype=np.bool_)

    def score(u: Array, v: Array, eta: float) -> Array:
        return np.where(measured, _scores(u, v, eta), 0.0)

    first = score(u, v, result.eta)
    step = 1e-4
    moved = (
        score(u, v, result.eta + step * (1 + result.eta)),
        score(u * (1 - step / 2), v * (1 - step / 2), result.eta),
        score(u * (1 - step / 2), v * (1 + step / 2), result.eta),
        score(u - step / 2 * v, v - step / 2 * u, result.eta),
    )
    sizes = (step * (1 + result.eta), step, step, step)
    information = -np.stack(
        [(m - first).sum(axis=(1, 2, 3)) / s for m, s in zip(moved, sizes, strict=True)], axis=1
    )
    inverse = np.linalg.inv((information + information.T) / 2)
    there = _tile_sums(measured.sum(axis=0)[None].astype(np.float64), tiles)[0] > 0
    weights = _bartlett(there)
    sums = _tile_sums(first.sum(axis=1), tiles)[:, there]
    count = sums.shape[1]
    # The scores add up to zero, which takes its share from their products.
    meat = sums @ weights @ sums.T / max(1 - weights.sum() / count**2, 0.1)
    dof = max(count**2 / float(np.sum(weights**2)) - 1, 1.0)
    return np.asarray(inverse @ meat @ inverse), np.asarray(inverse), dof


def moved(before: Array, after: Array, result: Maximum, information: Array) -> Array:
    """How a maximum moves in (η, m, d, e), see `covariance`, where all slopes change a little.

    One step of Newton's method.

    Parameters
    ----------
    before, after : ndarray, shapes (2, splits, count) and (2, count)
        Slopes (p, q) of some cells: of their facets, and what these become.
    result : Maximum
        Of all facets.
    information : ndarray, shape (4, 4)
        Of one facet.

    """
    whiten = np.linalg.inv(np.linalg.cholesky(result.scatter))
    (u, v), (u_after, v_after) = (
        np.einsum("ij,j...->i...", whiten, slopes) for slopes in (before, after)
    )
    old, new = _scores(u, v, result.eta), _scores(u_after, v_after, result.eta)
    difference = new.mean(axis=-1) - old.mean(axis=(-2, -1))
    return np.asarray(np.linalg.solve(information, difference))


def _scores(u: Array, v: Array, eta: float) -> Array:
    """Derivatives of ln f by (η, m, d, e) at whitened slopes, shape (4, …)."""
    _, by_eta, weight = _kernel(u * u + v * v, eta)
    return np.stack(
        [
            -by_eta,
            weight * (u * u + v * v) - 1,
            weight * (u * u - v * v),
            weight * 2 * u * v,
        ]
    )


def _bartlett(there: Mask) -> Array:
    """Weights of the products of tiles, (1 − |Δy|/2)(1 − |Δx|/2) or 0; those ``there`` only."""
    y, x = np.nonzero(there)
    apart = [np.maximum(1 - np.abs(np.subtract.outer(a, a)) / 2, 0) for a in (y, x)]
    return np.asarray(apart[0] * apart[1])


def _tile_sums(values: Array, tiles: int) -> Array:
    """Sum (…, rows, columns) over at most so many tiles a side."""
    for axis in (-2, -1):
        count = values.shape[axis]
        edges = np.unique(np.arange(tiles) * count // tiles)
        values = np.add.reduceat(values, edges, axis=axis)
    return values
