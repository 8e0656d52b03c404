"""A distribution of slopes of a mesh as ratios to STD, bin by bin of ρ = |(p/σ_x, q/σ_y)|.

Bins hold equal parts of STD, and log-even parts of its tail. A bin's ratio is that of
facets in it; in the tail that of their mean ρ, since a steep facet is met as often as its
slope is large. Beyond the steepest facet the ratio is 0: the tail a mesh can't hold.
Within a bin the slopes are taken to follow STD.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BULK = 200  # bins above _TAIL of the facets
_TAIL = 0.01
_PER_DECADE = 8  # bins of the tail
_NODES = 6  # of the quadrature in a bin
_LAST_NODES = 40  # in the last one, which has no end
_TABLE = 1025


class SlopeBins(NamedTuple):
    """A distribution of slopes for `reweighted_kernels`.

    ``edges2`` squared lower ends of the bins and ``ratios`` to STD, shape (bins,);
    ``table`` E[(ρ cosφ − c)₊] less that of STD at even c/(1+c).
    """

    edges2: Array
    ratios: Array
    table: Array


def slope_bins(rho: Array, gamma: float) -> SlopeBins:
    """Ratios of a distribution to STD of shape γ > 3/2, ∞ for Beckmann.

    ``rho`` are |(p/σ_x, q/σ_y)| of its facets, of one weight; azimuths are taken to be
    spread evenly in that frame.
    """
    ends = _ends(0.25 / rho.size)
    nodes, masses = _quadrature(ends, gamma)
    edges = _quantile(ends[:-1], gamma)
    of_theory = np.array([(m * n).sum() for n, m in zip(nodes, masses, strict=True)])
    ratios = _ratios(rho, edges, -np.diff(ends), of_theory, ends[:-1] <= _TAIL)
    cotangent = np.linspace(0, 1, _TABLE)[:-1]
    cotangent = cotangent / (1 - cotangent)
    excess = [_excess(n, cotangent) @ m for n, m in zip(nodes, masses, strict=True)]
    table = np.append((ratios - 1) @ np.array(excess), 0.0)  # 0 at c = ∞
    return SlopeBins(edges**2, ratios, table)


def _ends(last: float) -> Array:
    """Parts of STD beyond the ends of the bins, from 1 down to 0."""
    decades = max(np.log10(_TAIL / last), 1.0)
    tail = np.geomspace(_TAIL, min(last, _TAIL / 10), int(_PER_DECADE * decades) + 1)
    return np.concatenate([np.linspace(1, _TAIL, _BULK + 1), tail[1:], [0.0]])


def _quantile(beyond: Array, gamma: float) -> Array:
    """ρ that a part ``beyond`` of STD exceeds, with relative accuracy in the tail."""
    if np.isinf(gamma):
        return np.asarray(np.sqrt(-np.log(beyond)))
    return np.asarray(np.sqrt((gamma - 1) * np.expm1(-np.log(beyond) / (gamma - 1))))


def _quadrature(ends: Array, gamma: float) -> tuple[list[Array], list[Array]]:
    """Nodes ρ and masses of each bin, Gauss–Legendre in the part beyond."""
    x, w = np.polynomial.legendre.leggauss(_NODES)
    nodes, masses = [], []
    for high, low in pairwise(ends[:-1]):
        nodes.append(_quantile((high + low) / 2 + (high - low) / 2 * x, gamma))
        masses.append(w / 2 * (high - low))
    # ρ grows as beyond^(−1/(2γ−2)): a power of the variable takes the pole out of ∫ρ.
    power = 2.0 if np.isinf(gamma) else np.ceil(2 / (1 - 1 / (2 * gamma - 2)))
    x, w = np.polynomial.legendre.leggauss(_LAST_NODES)
    v = (1 + x) / 2
    nodes.append(_quantile(ends[-2] * v**power, gamma))
    masses.append(w / 2 * ends[-2] * power * v ** (power - 1))
    return nodes, masses


def _ratios(
    rho: Array, edges: Array, parts: Array, of_theory: Array, tail: NDArray[np.bool_]
) -> Array:
    bin_of = np.searchsorted(edges, rho, side="right") - 1
    bin_of = np.maximum(bin_of, 0)
    count = np.bincount(bin_of, minlength=len(edges)) / rho.size
    slope = np.bincount(bin_of, rho, minlength=len(edges)) / rho.size
    ratio = np.where(tail, slope / of_theory, count / parts)
    # Mean slopes in the tail need not add up to its facets: the bulk makes up for it.
    ratio[~tail] *= (1 - ratio[tail] @ parts[tail]) / (ratio[~tail] @ parts[~tail])
    return np.asarray(ratio)


def _excess(rho: Array, c: Array) -> Array:
    """Mean of (ρ cosφ − c)₊ over azimuths φ, shape (c, ρ)."""
    c = c[:, None]
    with np.errstate(over="ignore"):
        part = np.minimum(c / rho, 1.0)
    return np.asarray((rho * np.sqrt((1 - part) * (1 + part)) - c * np.arccos(part)) / np.pi)
