"""How surprising a deviation is if there is none: p-values, for one question and a family.

All p-values are uniform in 0 … 1 under the null hypothesis, or (where counts are few)
somewhat larger. `validation/calibration/run.py` measures how well.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from ..errors import InputError, float_array, require

Array = NDArray[np.float64]

LEAST = 10.0
"""Expected counts below which neighbouring bins of a chi-square test are pooled."""


def z_test(values: ArrayLike, expected: ArrayLike, errors: ArrayLike) -> Array:
    """Two-sided p-values of estimates that are normal with known standard errors ≥ 0.

    An error of 0 is an exact value: p = 1 if it is as expected, else 0.
    """
    off = np.abs(float_array("values", values) - float_array("expected", expected))
    spread = np.broadcast_to(float_array("errors", errors), off.shape)
    require(bool(np.all(spread >= 0)), "errors", spread, "standard errors ≥ 0")
    z = np.divide(off, spread, out=np.where(off > 0, np.inf, 0.0), where=spread > 0)
    return np.asarray(2 * special.ndtr(-z))


def chi_square(
    observed: ArrayLike, expected: ArrayLike, *, total_fixed: bool, least: float = LEAST
) -> float:
    """p-value of counts against expected counts (Pearson), sparse bins pooled with each other.

    Bins are joined in ascending order of what they expect until each expects ``least``.

    Parameters
    ----------
    observed, expected : array_like
        Counts by bin, of one shape; expected ≥ 0.
    total_fixed : bool
        Whether the bins hold all events, so that their sum says nothing: one degree of
        freedom less. Else the counts are Poisson, or a small part of a fixed total.
    least : float
        Expected count of each pooled bin, > 0.

    Raises
    ------
    InputError
        If fewer than two pooled bins are left, or totals differ though they are fixed.

    """
    counts = np.ravel(float_array("observed", observed))
    means = np.ravel(float_array("expected", expected))
    if np.any((means == 0) & (counts > 0)):
        return 0.0
    order = np.argsort(means, kind="stable")
    counts, means = counts[order], means[order]
    if total_fixed and not np.isclose(counts.sum(), means.sum(), rtol=1e-9):
        raise InputError(f"{counts.sum()} events seen, {means.sum()} expected: totals differ")
    group = _groups(means, least)
    pooled, wanted = (np.bincount(group, weights=a) for a in (counts, means))
    if len(wanted) < 2:
        raise InputError(f"fewer than two bins expect {least} events or more")
    chi2 = np.sum((pooled - wanted) ** 2 / wanted)
    return float(special.chdtrc(len(wanted) - total_fixed, chi2))


def _groups(expected: Array, least: float) -> NDArray[np.int64]:
    """Number of the pooled bin of each bin; what is left over joins the last."""
    group = np.zeros(len(expected), np.int64)
    number, filled = 0, 0.0
    for k, value in enumerate(expected):
        group[k] = number
        filled += value
        if filled >= least:
            number, filled = number + 1, 0.0
    # Only the last group can be too small: it was never filled.
    return np.minimum(group, max(number - 1, 0))


def _probabilities(p_values: ArrayLike) -> Array:
    p = float_array("p_values", p_values)
    require(bool(np.all((p >= 0) & (p <= 1))), "p_values", p, "in 0 … 1")
    return p


def sidak(p_values: ArrayLike) -> float:
    """p-value of a family of independent tests: of its smallest, 1 − (1 − p)^m (Šidák 1967)."""
    p = _probabilities(p_values).ravel()
    if np.any(p == 1) and p.min() == 1:
        return 1.0
    return float(-np.expm1(p.size * np.log1p(-p.min())))


def sidak_level(level: float, tests: int) -> float:
    """Level of each of so many independent tests that together have ``level``."""
    return float(-np.expm1(np.log1p(-level) / tests))


def holm(p_values: ArrayLike) -> Array:
    """p-values adjusted for their family, whatever their dependence (Holm 1979).

    Rejecting those at or below α makes one false rejection or more with a probability
    of at most α. Same shape as given.
    """
    p = _probabilities(p_values)
    order = np.argsort(p, axis=None)
    adjusted = np.empty(p.size)
    factors = np.arange(p.size, 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * p.ravel()[order]), 1)
    return adjusted.reshape(p.shape)
