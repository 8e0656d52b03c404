"""Errors of methods against a reference that has an error itself.

A method is an average of n independent draws (runs of a sampled model, surfaces), or one
exact answer; `squared_error` has its squared error E² and the interval, here made relative. Of
several places (angles, Kd) the largest counts. Two methods share a reference, so one of them
is distinguished from the other by the jackknife of their difference, in which it cancels (Efron and
Stein, Annals of Statistics 9, 1981: its variance is exact or too large).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...stats import intervals, squared_error
from ...stats.squared_error import Interval

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Squared:
    """E² of a method; without bias also with one draw left out, of the method or the reference."""

    interval: Interval
    value: float
    without_own: Array
    without_reference: Array


@dataclass(frozen=True)
class Error:
    """E ≥ 0 with its 95 % interval, and what it stays below with 95 % confidence."""

    value: float
    low: float
    high: float
    below: float


@dataclass(frozen=True)
class MethodPoint:
    """A method: name, cost in seconds with its range low … high, and E²."""

    name: str
    seconds: float
    seconds_low: float
    seconds_high: float
    squared: Squared


def squared(
    places: Sequence[tuple[Array, Array]], draws: float = 1.0, *, absolute: bool = False
) -> Squared:
    """E² of `squared_error` over |r̄|², or of itself if ``absolute``; the largest over some places.

    Parameters
    ----------
    places : sequence of (own, reference)
        Draws of each place, shape (K, components) and (R, components). One own draw is
        exact: it has no noise.
    draws : float
        n, how many draws the method averages.

    Raises
    ------
    ValueError
        If R < 3, or K is neither 1 nor 3 and more: nothing would be known of the error.

    """
    errors = [_place(sample, reference, draws, absolute=absolute) for sample, reference in places]
    ends = np.max([list(vars(f.interval).values()) for f in errors], axis=0)
    return Squared(
        Interval(*(float(end) for end in ends)),
        max(f.value for f in errors),
        np.max([f.without_own for f in errors], axis=0),
        np.max([f.without_reference for f in errors], axis=0),
    )


def _place(sample: Array, reference: Array, draws: float, *, absolute: bool) -> Squared:
    if len(reference) < 3 or len(sample) in (0, 2):
        raise ValueError(
            f"{len(sample)} draws of the method, {len(reference)} of the reference: "
            "must be 1 or at least 3, and at least 3"
        )

    def value(sample: Array, reference: Array) -> float:
        size = 1.0 if absolute else float((reference.mean(axis=0) ** 2).sum())
        return squared_error.value(sample, reference, draws) / size

    size = 1.0 if absolute else float((reference.mean(axis=0) ** 2).sum())
    interval = squared_error.interval(sample, reference, draws)
    return Squared(
        Interval(*(end / size for end in vars(interval).values())),
        value(sample, reference),
        np.array(
            [value(_without(sample, k), reference) for k in range(len(sample)) if len(sample) > 1]
        ),
        np.array([value(sample, _without(reference, k)) for k in range(len(reference))]),
    )


def _without(draws: Array, k: int) -> Array:
    return np.delete(draws, k, axis=0)


def half_width(reference: Array) -> float:
    """95 % half-width of a reference's mean relative to it, in its most uncertain direction.

    Of draws, shape (R, components): what a method can be off by and pass for right. The
    noise of single bins, which all differ, is known and taken out of E².
    """
    count = len(reference)
    mean = reference.mean(axis=0)
    largest = float(np.linalg.norm(reference - mean, ord=2)) / np.sqrt(count - 1)
    factor = intervals.student(count - 1)
    return float(factor * largest / np.sqrt(count) / np.linalg.norm(mean))


def pseudo_values(draws: Array, of: Callable[[Array], Array]) -> Array:
    """Jackknife pseudo-values of a figure of the mean draw, shape (K, components).

    They average to the figure with its bias of order 1/K removed, and spread like draws of
    it (Tukey 1958). ``of`` takes a mean draw; one draw is its own.
    """
    count = len(draws)
    whole = of(draws.mean(axis=0))
    if count == 1:
        return whole[None]
    rest = np.array([of(_without(draws, k).mean(axis=0)) for k in range(count)])
    return np.asarray(count * whole - (count - 1) * rest)


def error(result: Squared) -> Error:
    """E and its limits, out of those of E²."""
    return Error(*(float(np.sqrt(end)) for end in vars(result.interval).values()))


def _spread(*without: Array) -> tuple[float, float]:
    """Standard error from leave-one-out values of independent samples, and its dof."""
    parts = [
        ((len(w) - 1) / len(w) * float(((w - w.mean()) ** 2).sum()), len(w) - 1)
        for w in without
        if len(w) > 1
    ]
    if not parts:
        return 0.0, np.inf
    variances, free = zip(*parts, strict=True)
    return float(np.sqrt(sum(variances))), float(intervals.dof_of_sum(variances, free))


def worse(one: Squared, other: Squared) -> bool:
    """Whether E² of one is above that of the other, beyond the interval of the difference."""
    spread, dof = _spread(
        one.without_own, other.without_own, one.without_reference - other.without_reference
    )
    return one.value - other.value > intervals.student(dof) * spread


def dominated(points: Sequence[MethodPoint]) -> dict[str, str]:
    """For each dominated method the cheapest that is both cheaper and better, beyond doubt.

    Cheaper: the ranges of cost do not overlap. Better: `worse`. What is within its error
    is a tie, and dominates nothing.
    """
    by_name = {}
    for point in points:
        above = [
            other
            for other in points
            if other.seconds_high < point.seconds_low and worse(point.squared, other.squared)
        ]
        if above:
            by_name[point.name] = min(above, key=lambda other: other.seconds).name
    return by_name
