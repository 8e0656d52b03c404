"""STD fitted to the facets of a surface, by maximum likelihood, and whether it has a direction.

See `slope_likelihood` for the likelihood and the intervals. The axes are those of the
scatter of the slopes: σ_x is that of the axis nearer to x, `azimuth` the angle to it
from +x towards +y (as seen from above, where y is down, clockwise), −45° … 45°, less the lean
of facets towards the grid, see `lay`.
Every cell is split by either diagonal, so that a mesh's own does not pass for a lay.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ..errors import InputError
from ..stats import intervals
from .heightfield import Heightfield, slopes_of_both_splits
from .lay import lean
from .slope_likelihood import FEW_TILES, MAX_ETA, TILES, Maximum, covariance, maximise
from .statistics import correlation_areas, ks_distance, lengths_across

Array = NDArray[np.float64]
Interval = tuple[float, float]

MIN_FACETS = 2 * TILES**2
LEAST_LENGTHS = 16
"""Correlation lengths across a surface below which its eighths know of each other: the tiles of the
intervals are quarters there, and no interval is narrower than one facet of each correlation area
would make it. Scores of tiles that are one length wide say too little of how they hang together."""
LEAST_AREAS = 2.0
"""Correlation areas that a surface is taken to have at least."""
ISOTROPY_LEVEL = 0.01
"""Probability with which an isotropic surface is called one with a direction."""
_BECKMANN_ETA = 1e-3
"""Smallest 1/(γ−1) distinguished from Beckmann: KS between the two is then below 3e−4."""
_FLAT = 1e-6
"""Of the median slope: STD has one facet in 1e12 below, so what lies there does not slope."""
_SAME = 1e-9  # relative: differences of heights round so
_ONE_LINE = 1e-12  # of σ² along the axes


@dataclass(frozen=True)
class StdFit:
    """STD that fits the measured facets of a surface best.

    gamma in (1.05, ∞], ∞ standing for 1e3 and more; sigma = √(σ_x σ_y); each with its
    95 % interval, of sampling only. azimuth in degrees is None for an isotropic fit.
    isotropy is the p-value of "the slopes have no direction" (Hotelling's T²): the fit is
    isotropic above 0.01. ks is the distance of the facets to the fit, in-sample. facets:
    how many there are; effective_facets: how many independent ones would know σ as well.
    flat is the share of facets without slope, which no STD has: a plateau, a filled gap, a
    coarse step of heights. A fit depends on scale, so it states pixel = √(dx dy), shortest
    = 2 pixels and longest = the longer side, wavelengths in the user's unit.
    """

    gamma: float
    gamma_ci: Interval
    sigma: float
    sigma_ci: Interval
    sigma_x: float
    sigma_x_ci: Interval
    sigma_y: float
    sigma_y_ci: Interval
    azimuth: float | None
    azimuth_ci: Interval | None
    isotropy: float
    ks: float
    facets: int
    effective_facets: float
    flat: float
    pixel: float
    shortest: float
    longest: float

    @property
    def isotropic(self) -> bool:
        """Whether no direction was found."""
        return self.azimuth is None


def fit_std(h: Heightfield) -> StdFit:
    """Fit STD to the facets of a surface that touch no filled point. Level a measured one first.

    Raises
    ------
    InputError
        If there are fewer than 128 facets, half of them do not slope at all, all slopes
        are one or lie along one line, or the likelihood has no maximum, which flat facets
        and tails below γ = 1.05 cause.

    """
    p, q, measured = slopes_of_both_splits(h)
    flat = _flatten(p, q, measured)
    sloping = (p, q) if measured is None else (p[measured], q[measured])
    general = _checked(*sloping, flat)
    narrow = lengths_across(h) < LEAST_LENGTHS
    tiles = FEW_TILES if narrow else TILES
    cov, naive, dof = covariance(p, q, general, measured, tiles)
    isotropy = _isotropy(general, cov, dof)
    result = general
    if isotropy > ISOTROPY_LEVEL:
        result = maximise(*sloping, isotropic=True)
        cov, naive, dof = covariance(p, q, result, measured, tiles)
    jacobian = _jacobian(result.scatter)
    sizes = _axes(result.scatter)
    reach = _reach(cov, dof, jacobian)
    if narrow:
        areas = max(correlation_areas(h), LEAST_AREAS)
        few = _reach(naive * (sloping[0].size / areas), areas - 1, jacobian)
        reach = np.maximum(reach, few)
    by_eta, by_m, errors = reach[0], reach[1], reach[2:]
    sigma = float(np.exp((sizes[0] + sizes[1]) / 2))
    directed = result is general
    if not directed:
        errors[:2] = by_m / 2  # both are σ
    gamma = gamma_of(result.eta)
    effective = sloping[0].size * naive[1, 1] / cov[1, 1] if cov[1, 1] > 0 else np.nan
    if not np.isfinite([sigma, by_eta, by_m, *errors, effective]).all():
        raise InputError(
            f"γ = {gamma:.4g}, σ = {sigma:.4g}: their likelihood gives no interval, so these are "
            "no fit; take a larger surface"
        )
    azimuth = sizes[2]
    if directed:
        leaning = lean(h, p, q, general, np.linalg.inv(naive) / sloping[0].size)
        # The lean is least where the axes change their names.
        azimuth = np.clip(azimuth - jacobian[2] @ leaning[1:], -np.pi / 4, np.pi / 4)
    degrees = np.degrees([azimuth, azimuth - errors[2], azimuth + errors[2]])
    dx, dy = h.pixel
    return StdFit(
        gamma=gamma,
        gamma_ci=(gamma_of(result.eta + by_eta), gamma_of(result.eta - by_eta)),
        sigma=sigma,
        sigma_ci=_around(sigma, by_m / 2),
        sigma_x=float(np.exp(sizes[0])),
        sigma_x_ci=_around(float(np.exp(sizes[0])), errors[0]),
        sigma_y=float(np.exp(sizes[1])),
        sigma_y_ci=_around(float(np.exp(sizes[1])), errors[1]),
        azimuth=float(degrees[0]) if directed else None,
        azimuth_ci=(float(degrees[1]), float(degrees[2])) if directed else None,
        isotropy=isotropy,
        ks=ks_distance(np.sqrt(np.sort(rho2(*sloping, result.scatter))), gamma),
        facets=sloping[0].size // 2,
        effective_facets=float(effective / 2),
        flat=flat,
        pixel=dx if dx == dy else math.sqrt(dx) * math.sqrt(dy),
        shortest=2 * max(dx, dy),
        longest=max(n * d for n, d in zip(h.heights.shape, (dy, dx), strict=True)),
    )


def slopes_to_fit(h: Heightfield) -> tuple[Array, Array]:
    """Slopes along x and y that `fit_std` fits, flat."""
    p, q, measured = slopes_of_both_splits(h)
    return (p.ravel(), q.ravel()) if measured is None else (p[measured], q[measured])


def gamma_of(eta: float) -> float:
    """γ = 1 + 1/η; ∞ where it can't be distinguished from Beckmann."""
    return float(1 + 1 / eta) if eta > _BECKMANN_ETA else float("inf")


def rho2(p: Array, q: Array, scatter: Array) -> Array:
    """ρ² = sᵀ S⁻¹ s of slopes, flat."""
    a, b, _, c = np.linalg.inv(scatter).ravel()
    return np.asarray(a * p**2 + 2 * b * p * q + c * q**2).ravel()


def _flatten(p: Array, q: Array, measured: NDArray[np.bool_] | None) -> float:
    """Set slopes that are rounding to zero; the share of measured facets that have none."""
    everywhere = p**2 + q**2
    slope2 = everywhere.ravel() if measured is None else everywhere[measured]
    if slope2.size < 2 * MIN_FACETS:
        raise InputError(
            f"{slope2.size // 2} facets: a fit needs {MIN_FACETS}; take a larger surface"
        )
    least = _FLAT**2 * np.median(slope2)
    flat = int(np.count_nonzero(slope2 <= least))
    if flat >= slope2.size // 2:
        raise InputError(_too_flat(flat, slope2.size))
    if np.ptp(slope2) <= _SAME * slope2.max():
        raise InputError(
            f"all facets slope by {np.sqrt(slope2.max()):.4g}: no STD fits; level the surface"
        )
    if flat:
        p[everywhere <= least] = 0.0
        q[everywhere <= least] = 0.0
    return flat / slope2.size


def _too_flat(flat: int, facets: int) -> str:
    return (
        f"{flat // 2} of {facets // 2} facets ({flat / facets:.1%}) are flat: no STD fits; there "
        "may be a plateau, a filled gap or a coarse step of heights. Cut it out, or measure "
        "heights finer"
    )


def _checked(p: Array, q: Array, flat: float) -> Maximum:
    """The fit with any axes, if there is one."""
    result = maximise(p, q)
    if result.eta >= 0.999 * result.eta_limit:
        raise InputError(
            _too_flat(round(flat * p.size), p.size)
            if result.eta_limit < MAX_ETA
            else f"the slopes' tail is heavier than any with γ > {1 + 1 / MAX_ETA:.3g}: no STD "
            "fits; there may be spikes in the heights. Take them out"
        )
    least, most = np.linalg.eigvalsh(result.scatter)
    if least <= _ONE_LINE * most:
        raise InputError(
            "all slopes lie along one line, as of scratches: no STD fits; "
            "`microsurf measure --surface` needs none"
        )
    return result


def _reach(cov: Array, dof: float, jacobian: Array) -> Array:
    """Halves of the intervals of η, m and `_axes`, shape (5,)."""
    axes = np.diagonal(jacobian @ cov[1:, 1:] @ jacobian.T)
    return np.asarray(intervals.student(dof) * np.sqrt([*np.diagonal(cov)[:2], *axes]))


def _around(value: float, reach: float) -> Interval:
    return float(value * np.exp(-reach)), float(value * np.exp(reach))


def _axes(scatter: Array) -> Array:
    """(ln σ_x, ln σ_y, azimuth in radians −π/4 … π/4)."""
    azimuth = np.arctan2(2 * scatter[0, 1], scatter[0, 0] - scatter[1, 1]) / 2
    mean, half = np.trace(scatter) / 2, np.hypot((scatter[0, 0] - scatter[1, 1]) / 2, scatter[0, 1])
    # Not mean − half, which cancels where one axis is far rougher.
    major, minor = mean + half, np.linalg.det(scatter) / (mean + half)
    if abs(azimuth) <= np.pi / 4:
        return np.array([np.log(major) / 2, np.log(minor) / 2, azimuth])
    return np.array(
        [np.log(minor) / 2, np.log(major) / 2, azimuth - np.copysign(np.pi / 2, azimuth)]
    )


def _jacobian(scatter: Array) -> Array:
    """Derivatives of `_axes` by (m, d, e), see `covariance`; by differences."""
    root = np.linalg.cholesky(scatter)
    step = 1e-6
    columns = []
    for basis in (np.eye(2), np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])):
        ahead, behind = (_axes(root @ (np.eye(2) + s * basis) @ root.T) for s in (step, -step))
        change = ahead - behind
        if abs(change[2]) > np.pi / 4:  # across 45° the axes change their names
            ahead = np.array([ahead[1], ahead[0], ahead[2] - np.copysign(np.pi / 2, change[2])])
            change = np.asarray(ahead - behind)
        columns.append(change / (2 * step))
    return np.stack(columns, axis=1)


def _isotropy(result: Maximum, cov: Array, dof: float) -> float:
    """p-value of S being a multiple of the unit matrix, from its two deviations."""
    root = np.linalg.cholesky(result.scatter)

    def deviations(s: Array) -> Array:
        return np.asarray([s[0, 0] - s[1, 1], 2 * s[0, 1]]) / float(np.trace(s))

    step = 1e-6
    at = deviations(result.scatter)
    jacobian = np.stack(
        [
            (deviations(root @ (np.eye(2) + step * basis) @ root.T) - at) / step
            for basis in (np.eye(2), np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]]))
        ],
        axis=1,
    )
    spread = jacobian @ cov[1:, 1:] @ jacobian.T
    squared = float(at @ np.linalg.solve(spread, at))
    # Hotelling's T² of two components is an F of one degree of freedom less.
    rest = max(dof - 1, 1.0)
    return float(special.fdtrc(2, rest, squared * rest / (2 * dof)))
