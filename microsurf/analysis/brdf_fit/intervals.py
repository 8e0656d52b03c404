"""Intervals of a fit by resampling incidences: the delete-one jackknife over groups.

Residuals of pairs at one incidence share what is wrong with the model there, so one
incidence is one observation (Quenouille and Tukey's jackknife; Efron and Stein, Annals of
Statistics 9(3), 1981: its variance is not too small in the mean). Each group of incidences
is left out in turn and the fit follows from where it was; Student's t gives 95 %. Its degrees
of freedom are not those of the groups: a few steep incidences know γ and σ, so that the
variance is the sum of few squares and scatters by half. The pairs left out judge the fit that
did not see them: that is cross-validation for nothing.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...stats.intervals import dof_of_sum, student
from .nearby import follow
from .solve import Question, Solution, evaluate

Array = NDArray[np.float64]


class Resampled(NamedTuple):
    """Fits that left out one group of incidences each.

    vectors, shape (groups, parameters); channels, shape (groups, channels[, 2]); squares :
    sum of squared logarithmic residuals of each group by the fit without it, and counts :
    of how many values.
    """

    vectors: Array
    channels: Array
    squares: Array
    counts: Array

    @property
    def log_rms(self) -> float:
        """Root mean square over all pairs, each as a fit that never saw its incidence has it."""
        return float(np.sqrt(self.squares.sum() / self.counts.sum()))


def resample(question: Question, solution: Solution) -> Resampled:
    """Fit again without each group of incidences."""
    groups = question.problem.groups
    vectors, channels, squares, counts = [], [], [], []
    for group in np.unique(groups):
        out = groups == group
        fit = follow(question.select(~out), solution)
        left_out = question.select(out)
        squares.append(np.sum(evaluate(left_out, fit.vector, fit.channel) ** 2))
        counts.append(np.count_nonzero(left_out.problem.known))
        vectors.append(fit.vector)
        channels.append(fit.channel)
    return Resampled(np.array(vectors), np.array(channels), np.array(squares), np.array(counts))


def half_width(without: Array) -> Array:
    """Half of the 95 % interval of estimates made without each group, along the first axis."""
    squares = (without - without.mean(axis=0)) ** 2
    groups = len(without)
    error = np.sqrt(squares.sum(axis=0) * (groups - 1) / groups)
    return np.asarray(np.vectorize(student)(_dof(squares)) * error)


def _dof(squares: Array) -> Array:
    """Degrees of freedom of the sum of squares of normal values of unlike variances v, ≥ 2.

    Satterthwaite's (Σv)²/Σv². The fourth power of a normal value is 3v² in the mean: put
    for v², the square of each gives a third of that. One is taken off for their mean.
    """
    dof = dof_of_sum(squares, np.full(len(squares), 3.0)) - 1
    return np.asarray(np.minimum(dof, len(squares) - 1))


def interval(
    value: float, without: Array, low: float = -np.inf, high: float = np.inf
) -> tuple[float, float]:
    """95 % interval of one number, cut to where it may lie."""
    half = float(half_width(without))
    return max(low, value - half), min(high, value + half)
