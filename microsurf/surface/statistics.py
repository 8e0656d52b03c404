"""What a surface realises: its slopes against STD, its heights, its height parameters."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..errors import InputError
from ..physics import student_t
from .gaussian_field import threads_for
from .heightfield import Heightfield, facet_slopes, measured_facets, unfolded

Array = NDArray[np.float64]

QUANTILES = (0.5, 0.9, 0.99, 0.999)
"""Parts of the projected area at which slopes are compared."""


def surface_statistics(
    h: Heightfield, gamma: float, sigma_x: float, sigma_y: float | None = None
) -> dict[str, Any]:
    """Compare a surface's facets with STD, per unit of projected area.

    Filled points and their facets have no say, but in the correlation lengths.

    With ρ² = (p/σ_x)² + (q/σ_y)² and φ the azimuth of (p/σ_x, q/σ_y). All values
    are plain numbers, or None where there is nothing to compare (a flat surface).

    Parameters
    ----------
    h : Heightfield
        The surface.
    gamma, sigma_x, sigma_y : float
        STD as in `physics.student_t` with γ > 3/2, or σ = 0 for a flat one.

    Returns
    -------
    dict
        ks: Kolmogorov–Smirnov distance of ρ.
        quantiles: {"0.5": relative error of that quantile of ρ, …}.
        tail: max_slope, the largest |slope|; area_beyond, the share of STD's
        microsurface area at ρ above the largest of the mesh, which the mesh can't
        hold; area_of_mesh, the mesh's area over STD's.
        harmonics: means of cosφ, sinφ, cos2φ, sin2φ; 0 if isotropic.
        height_slope: Spearman's rank correlation over facets of ρ with height, positive
        if the steep ones are high, and (distance) with |height − its median|, positive
        if they are far from mean height; both near 0 if slope knows nothing of height.
        correlation, correlation_x, correlation_y: lengths in cells at which the
        heights' autocorrelation falls to 1/e, and their geometric mean; None if
        it does not.
        Sq, Sa: rms and mean absolute deviation of the heights from their mean, in
        the user's unit. Sdq: rms slope; it certifies nothing for γ ≤ 2, where STD's
        is infinite. Sdr: area over projected area − 1. gradient: the operator
        behind Sdq and Sdr, "facet": both triangles of every cell.
        (ISO 25178-2:2021 for the S-parameters.)

    Raises
    ------
    InputError
        If γ ≤ 3/2: STD's area, which the tail is compared with, is infinite; or no facet
        has three measured corners.

    """
    sigma_y = sigma_x if sigma_y is None else sigma_y
    if not gamma > 1.5:
        raise InputError(f"gamma = {gamma}: must be > 1.5 (below, STD's area is infinite)")
    lengths = height_parameters(h)
    p, q = facet_slopes(h)
    height_slope = _height_slope(h, p / (sigma_x or 1.0), q / (sigma_y or 1.0))
    measured = measured_facets(h)
    if measured is not None:
        p, q = p[measured], q[measured]
    slope2 = p**2 + q**2
    area = float(np.mean(np.sqrt(1 + slope2)))
    max_slope = float(np.sqrt(slope2.max()))
    tail = {"max_slope": max_slope, "area_beyond": 0.0, "area_of_mesh": area}
    against = _against_flat(slope2)
    if sigma_x > 0:
        against = _against_std(p, q, gamma, sigma_x, sigma_y)
        tail["area_beyond"] = _area_beyond(against.pop("rho_max"), gamma, sigma_x, sigma_y)
        tail["area_of_mesh"] = area / mean_area(gamma, sigma_x, sigma_y)
    along_x, along_y = correlation_lengths(h)
    return {
        **against,
        "tail": tail,
        "height_slope": height_slope,
        "correlation": None if along_x is None or along_y is None else (along_x * along_y) ** 0.5,
        "correlation_x": along_x,
        "correlation_y": along_y,
        **lengths,
    }


def height_parameters(h: Heightfield) -> dict[str, Any]:
    """Sq, Sa, Sdq, Sdr and gradient as in `surface_statistics`, of what was measured."""
    p, q = facet_slopes(h)
    measured = measured_facets(h)
    slope2 = p**2 + q**2 if measured is None else (p**2 + q**2)[measured]
    if slope2.size == 0:
        raise InputError("no facet has three measured corners; measure again, or crop the voids")
    heights = h.heights if h.filled is None else h.heights[~h.filled]
    deviation = heights - heights.mean()
    return {
        "Sq": float(np.sqrt(np.mean(deviation**2))),
        "Sa": float(np.mean(np.abs(deviation))),
        "Sdq": float(np.sqrt(np.mean(slope2))),
        "Sdr": float(np.mean(slope2 / (1 + np.sqrt(1 + slope2)))),
        "gradient": "facet",
    }


def ks_distance(rho: Array, gamma: float) -> float:
    """Kolmogorov–Smirnov distance of *sorted* ρ to STD's distribution (σ = 1)."""
    gap = student_t.slope_cdf(rho, gamma)
    gap -= (np.arange(rho.size) + 0.5) / rho.size
    np.abs(gap, out=gap)
    # Half a step to either side of each step of the empirical distribution.
    return float(gap.max()) + 0.5 / rho.size


def _against_std(
    p: Array, q: Array, gamma: float, sigma_x: float, sigma_y: float
) -> dict[str, Any]:
    u, v = p / sigma_x, q / sigma_y
    rho2 = u**2 + v**2
    rho = np.sqrt(np.sort(rho2, axis=None))
    position = np.asarray(QUANTILES) * rho.size - 0.5  # rank k lies at (k+½)/N
    on_mesh = np.interp(position, np.arange(rho.size), rho)
    error = on_mesh / student_t.slope_quantile(QUANTILES, gamma) - 1
    # A facet without slope has no azimuth.
    inverse = np.divide(1.0, rho2, out=np.zeros_like(rho2), where=rho2 > 0)
    root = np.sqrt(inverse)
    return {
        "ks": ks_distance(rho, gamma),
        "quantiles": {f"{u:g}": float(e) for u, e in zip(QUANTILES, error, strict=True)},
        "rho_max": float(rho[-1]),
        "harmonics": {
            "cos1": float(np.mean(u * root)),
            "sin1": float(np.mean(v * root)),
            "cos2": float(np.mean((u**2 - v**2) * inverse)),
            "sin2": float(np.mean(2 * u * v * inverse)),
        },
    }


def _against_flat(slope2: Array) -> dict[str, Any]:
    return {
        "ks": float(np.mean(slope2 > 0)),
        "quantiles": {f"{u:g}": None for u in QUANTILES},
        "harmonics": dict.fromkeys(("cos1", "sin1", "cos2", "sin2")),
    }


def mean_area(gamma: float, sigma_x: float, sigma_y: float) -> float:
    """STD's microsurface area per projected area, ∫ √(1+p²+q²) dF, for γ > 3/2."""
    return float(
        np.mean([student_t.mean_area(gamma, sigma) for sigma in _azimuths(sigma_x, sigma_y)])
    )


def _area_beyond(rho: float, gamma: float, sigma_x: float, sigma_y: float) -> float:
    sigmas = _azimuths(sigma_x, sigma_y)
    areas = np.array([student_t.mean_area(gamma, sigma) for sigma in sigmas])
    shares = np.array([student_t.area_beyond(rho * sigma, gamma, sigma) for sigma in sigmas])
    return float(np.sum(areas * shares) / np.sum(areas))


def _azimuths(sigma_x: float, sigma_y: float) -> Array:
    """σ(φ) at azimuths that average any smooth function over φ (midpoint rule, one quadrant).

    64 reach 1e−10 up to σ_x/σ_y of 10: the function's nearest singularities in complex
    φ lie at a distance of about σ_y/σ_x.
    """
    if sigma_x == sigma_y:
        return np.array([sigma_x])
    phi = (np.arange(64) + 0.5) * np.pi / 128
    return np.asarray(np.hypot(sigma_x * np.cos(phi), sigma_y * np.sin(phi)))


def _height_slope(h: Heightfield, u: Array, v: Array) -> dict[str, float | None]:
    """Rank correlations of facets' ρ = |(u, v)| with their height, see `surface_statistics`."""
    from scipy.stats import rankdata  # noqa: PLC0415 - late: scipy.stats takes 0.2 s to load

    heights = h.heights
    if h.boundary == "periodic":
        heights = np.pad(heights, ((0, 1), (0, 1)), mode="wrap")
    # A million cells tell a correlation to 1e−3, and ranking all of them may take minutes.
    step = -(-max(u.shape[1:]) // 1024)
    low, high = heights[:-1, :-1], heights[1:, 1:]
    thirds = np.stack([low + high + heights[:-1, 1:], low + high + heights[1:, :-1]])
    measured = measured_facets(h)
    taken = np.ones_like(u, dtype=np.bool_) if measured is None else measured
    taken = taken[:, ::step, ::step]
    level = thirds[:, ::step, ::step][taken]
    rank = rankdata(np.hypot(u[:, ::step, ::step], v[:, ::step, ::step])[taken])
    distance = np.abs(level - np.median(level))
    return {
        "height": _correlation(rank, rankdata(level)),
        "distance": _correlation(rank, rankdata(distance)),
    }


def _correlation(a: Array, b: Array) -> float | None:
    """Pearson's coefficient; None if either does not vary."""
    if a.size == 0 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return None
    return float(np.corrcoef(a, b)[0, 1])


def correlation_lengths(h: Heightfield) -> tuple[float | None, float | None]:
    """1/e lengths in cells of the heights' autocorrelation along x and y, over one period."""
    heights, _ = unfolded(h)
    threads = threads_for(heights.size)
    power = np.abs(fft.rfft2(heights - heights.mean(), workers=threads)) ** 2
    covariance = fft.irfft2(power, heights.shape, workers=threads)
    return _first_crossing(covariance[0]), _first_crossing(covariance[:, 0])


def lengths_across(h: Heightfield) -> float:
    """The fewest correlation lengths across the surface, x or y; 0 if one is never reached."""
    sides = zip(h.heights.shape[::-1], correlation_lengths(h), strict=True)
    return min(side / length if length else 0.0 for side, length in sides)


def correlation_areas(h: Heightfield) -> float:
    """Area over the product of both correlation lengths; a missing one is its side."""
    sides = h.heights.shape[::-1]
    lengths = zip(sides, correlation_lengths(h), strict=True)
    return float(np.prod([side / (length or side) for side, length in lengths]))


def _first_crossing(covariance: Array) -> float | None:
    half = covariance[: covariance.size // 2 + 1]
    below = np.flatnonzero(half < half[0] / np.e)
    if below.size == 0:
        return None
    k = int(below[0])
    fraction = (half[k - 1] - half[0] / np.e) / (half[k - 1] - half[k])
    return float(k - 1 + fraction)
