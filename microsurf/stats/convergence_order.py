"""What values with errors say of a trend: differences, orders of convergence, powers.

Differences of independent means have Welch's interval (1947). The order of convergence
of v(h) = v(0) + c hᵖ from three mesh widths h, rh, r²h is p = ln((v₃−v₂)/(v₂−v₁)) / ln r
(Richardson), with its error to first order in those of the values. The exponent of
s ~ Nˣ is a weighted least-squares slope of ln s: where s is a standard deviation of ν
degrees of freedom, ln s has the mean ln σ + (ψ(ν/2) − ln(ν/2))/2 and the variance
ψ'(ν/2)/4 (of normal values, about 1/(2ν)).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ..errors import float_array, require
from . import intervals

_SEEN = 3.0
"""A difference counts for an order of convergence from so many standard errors on."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Mean:
    """A mean of ``count`` independent values with its standard error."""

    value: float
    error: float
    count: int


def mean_of(values: NDArray[np.float64]) -> Mean:
    """Mean of two values or more."""
    values = float_array("values", values)
    require(len(values) > 1, "values", values, "two or more")
    error = float(values.std(ddof=1)) / float(np.sqrt(len(values)))
    return Mean(float(values.mean()), error, len(values))


def difference(one: Mean, other: Mean) -> Estimate:
    """Of two independent means: one − other."""
    squares = np.array([one.error, other.error]) ** 2
    dof = intervals.dof_of_sum(squares, [one.count - 1, other.count - 1])
    value = one.value - other.value
    half = intervals.student(float(dof)) * float(np.sqrt(squares.sum()))
    return Estimate(value, value - half, value + half)


def part_and_whole(values: NDArray[np.float64], part: int) -> Estimate:
    """Mean of the first ``part`` of three values or more minus that of all."""
    count = len(values)
    value = float(values[:part].mean() - values.mean())
    # The part is in the spread as well: Thompson's τ (1935), not Student's t.
    t = intervals.student(count - 2)
    tau = t * np.sqrt((count - 1) / (count - 2 + t**2))
    half = float(tau * values.std(ddof=1) * np.sqrt(1 / part - 1 / count))
    return Estimate(value, value - half, value + half)


def order(coarse: Mean, middle: Mean, fine: Mean, ratio: float = 2.0) -> Estimate | None:
    """Order of convergence from three mesh widths, each ``ratio`` times the next.

    None where the data do not allow it: both differences must be of one sign, and each
    three times its standard error at least.
    """
    first, second = coarse.value - middle.value, middle.value - fine.value
    of_first, of_second = (
        float(np.hypot(a.error, b.error)) for a, b in ((coarse, middle), (middle, fine))
    )
    resolved = abs(first) > _SEEN * of_first and abs(second) > _SEEN * of_second
    if not resolved or first * second <= 0:
        return None
    value = float(np.log(first / second) / np.log(ratio))
    # ln(v₃−v₂) − ln(v₂−v₁): the middle value takes part in both, with opposite signs.
    parts = coarse.error / first, middle.error * (1 / first + 1 / second), fine.error / second
    half = intervals.normal() * float(np.linalg.norm(parts)) / float(np.log(ratio))
    return Estimate(value, value - half, value + half)


def power(
    sizes: Sequence[float], deviations: Sequence[float], dof: Sequence[float]
) -> Estimate | None:
    """Exponent x of s ~ Nˣ from independent standard deviations; None from fewer than two."""
    s, nu = float_array("deviations", deviations), float_array("dof", dof)
    use = (s > 0) & (nu >= 1)
    if use.sum() < 2:
        return None
    half_nu = nu[use] / 2
    x = np.log(float_array("sizes", sizes)[use])
    y = np.log(s[use]) - (special.digamma(half_nu) - np.log(half_nu)) / 2
    weight = 4 / special.polygamma(1, half_nu)
    x = x - np.average(x, weights=weight)
    spread = float((weight * x**2).sum())
    value = float((weight * x * y).sum()) / spread
    half = intervals.normal() / float(np.sqrt(spread))
    return Estimate(value, value - half, value + half)
