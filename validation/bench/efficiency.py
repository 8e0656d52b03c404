"""Efficiency, 1/(variance × time), of what a report prints: ratios of two sides, with intervals.

Variances are those of independent batches of as many paths on both sides, by the same
estimator. A single figure's ratio of variances follows F if batches are normal, which sums
over 10⁵ paths are. Bins have one ratio each, of which the median is given; its interval is
by bootstrap over the batches, since neighbouring bins and mirrored ones go together.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from microsurf.results import detector
from microsurf.stats.intervals import CONFIDENCE, normal

Array = NDArray[np.float64]

BRIGHT = 10
"""Paths a batch that must reach an order on both sides for it to be judged: nearly normal."""
BRIGHT_BIN = 3
"""The same for a bin, of which only the median over all of a lobe is given."""
RESAMPLES = 400

_ORDERS = [f"{order}" for order in detector.ORDERS[:-1]] + [f"{detector.ORDERS[-1]}+"]
FIGURES = (
    "total albedo",
    *(f"albedo of order {order}" for order in _ORDERS),
    *(f"{kind} albedo of order {order}" for kind in detector.KINDS for order in _ORDERS),
)
LOBES = tuple(f"bins of the order-1 {kind} lobe" for kind in detector.KINDS)


def figures(flux: Array) -> Array:
    """FIGURES of fluxes of shape (..., order, kind, ring, sector), shape (..., figures)."""
    by_kind = flux.sum((-2, -1))
    by_order = by_kind.sum(-1)
    return np.concatenate(
        [by_order.sum(-1, keepdims=True), by_order, *np.moveaxis(by_kind, -1, 0)], axis=-1
    )


def lobes(flux: Array) -> Array:
    """LOBES of fluxes of shape (batches, order, kind, ring, sector), (lobes, batches, bins)."""
    first = flux[:, 0]
    return np.moveaxis(first.reshape(*first.shape[:2], -1), 1, 0)


@dataclass(frozen=True)
class Ratio:
    """Efficiency of ours over theirs, with its interval; ``bins`` > 1: the median over so many."""

    value: float
    low: float
    high: float
    bins: int = 1


def figure_ratio(ours: Array, theirs: Array, speed: float, paths: int) -> Ratio | None:
    """Compare one figure's batches, arrays of one dimension; None if it is too dim to judge.

    ``speed`` is the ratio of batches a second, ``paths`` are those of a batch.
    """
    if min(ours.mean(), theirs.mean()) * paths < BRIGHT:
        return None
    # The ratio of variances over the true one follows F(batches − 1).
    value = float(speed * theirs.var(ddof=1) / ours.var(ddof=1))
    low, high = stats.f.interval(CONFIDENCE, len(theirs) - 1, len(ours) - 1)
    return Ratio(value, value / high, value / low)


def lobe_ratio(
    ours: Array, theirs: Array, speed: float, paths: int, rng: np.random.Generator
) -> Ratio | None:
    """Compare a lobe's bins, arrays (batches, bins): the median; None if no bin is bright."""
    bright = np.minimum(ours.mean(0), theirs.mean(0)) * paths >= BRIGHT_BIN
    count = int(np.count_nonzero(bright))
    if count == 0:
        return None
    ours, theirs = ours[:, bright], theirs[:, bright]
    # The median of F(a, b) is not quite 1 if a ≠ b.
    skew = float(stats.f.median(len(theirs) - 1, len(ours) - 1))

    def median(mine: Array, other: Array) -> float:
        return float(speed * np.median(other / mine) / skew)

    value = median(ours.var(0, ddof=1), theirs.var(0, ddof=1))
    draws = [
        median(_resampled_variance(ours, rng), _resampled_variance(theirs, rng))
        for _ in range(RESAMPLES)
    ]
    # In logarithms, about the estimate: resampling adds noise of its own to every bin.
    spread = normal() * float(np.std(np.log(draws), ddof=1))
    return Ratio(value, value * float(np.exp(-spread)), value * float(np.exp(spread)), count)


def _resampled_variance(batches: Array, rng: np.random.Generator) -> Array:
    """Variance of each bin over batches drawn with replacement."""
    times = np.bincount(rng.integers(len(batches), size=len(batches)), minlength=len(batches))
    mean = times @ batches / len(batches)
    squares = times @ (batches - mean) ** 2
    # A bin that all drawn batches agree on says nothing: keep it from dividing by zero.
    return np.asarray(np.maximum(squares, np.finfo(float).tiny) / (len(batches) - 1))


def agreement(ours: Array, theirs: Array, paths: int) -> Array:
    """z of the difference of means of figures, (batches, figures); NaN where too dim to judge."""
    error = np.sqrt(ours.var(0, ddof=1) / len(ours) + theirs.var(0, ddof=1) / len(theirs))
    bright = np.minimum(ours.mean(0), theirs.mean(0)) * paths >= BRIGHT
    difference = ours.mean(0) - theirs.mean(0)
    return np.asarray(np.divide(difference, error, out=np.full_like(error, np.nan), where=bright))
