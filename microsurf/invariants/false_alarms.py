"""When a difference that ought to be chance is none: the false-alarm rate of a report."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..stats import intervals
from .invariant import Invariant

Array = NDArray[np.float64]

RATE = 1e-4
"""Chance that a report calls at least one invariant broken that holds."""
TESTS = 10
"""At most so many invariants of a report are decided by chance; each has its share of RATE."""
MOST = 38.0
"""Standard errors beyond which the chance is below any float."""
_ROUNDING = 1e-12  # of the sums: differences below are none


def critical(comparisons: int, rate: float = RATE / TESTS) -> float:
    """Largest |z| of so many comparisons that is called chance (Bonferroni)."""
    return intervals.normal_of_tails(rate / comparisons)


def standardised(t: ArrayLike, dof: ArrayLike) -> Array:
    """The normal deviate as unlikely as Student's t of so many degrees of freedom."""
    return np.asarray(np.sign(t) * np.minimum(intervals.normal_deviate(t, dof), MOST))


def against(a: Array, expected: ArrayLike) -> Array:
    """z of the mean of independent runs, shape (runs, …), against what is expected."""
    count = len(a)
    error = np.hypot(a.std(axis=0, ddof=1) / np.sqrt(count), _ROUNDING * np.abs(expected))
    return standardised((a.mean(axis=0) - expected) / _positive(error), count - 1)


def between(a: Array, b: Array) -> Array:
    """z of the difference of two means of independent runs, each of shape (runs, …) (Welch)."""
    of_a, of_b = (x.var(axis=0, ddof=1) / len(x) for x in (a, b))
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    both = _positive(of_a + of_b)
    share = of_a / both  # where both are 0 there are degrees of freedom, too
    dof = intervals.dof_of_sum([share, 1 - share], [len(a) - 1, len(b) - 1])
    error = np.hypot(np.sqrt(both), _ROUNDING * (np.abs(mean_a) + np.abs(mean_b)))
    return standardised((mean_a - mean_b) / error, dof)


def _positive(values: Array) -> Array:
    return np.maximum(values, np.finfo(float).tiny)


def by_chance(
    name: str,
    statement: str,
    z: ArrayLike,
    basis: str,
    figures: Mapping[str, float] | None = None,
    *,
    rate: float = RATE / TESTS,
    among: str = f"one report of {TESTS / RATE:.0e}",
) -> Invariant:
    """An invariant that is decided by the largest of several |z|; chance passes at ``rate``."""
    size = np.abs(np.asarray(z, float)).ravel()
    allowed = critical(size.size, rate)
    return Invariant(
        name,
        statement,
        float(size.max()),
        allowed,
        f"largest |z| of {size.size} comparisons: {basis}. Chance passes {allowed:.2f} in {among}",
        figures or {},
    )
