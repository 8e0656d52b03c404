"""Intervals of a fit by resampling: two delete-one jackknives, of which the wider one counts.

Residuals of pairs at one incidence share what is wrong with the model there, so one
incidence is one observation (Quenouille and Tukey's jackknife; Efron and Stein, Annals of
Statistics 9(3), 1981: its variance is not too small in the mean). Each group of incidences
is left out in turn and the fit follows from where it was; Student's t gives 95 %. Its degrees
of freedom are not those of the groups: a few steep incidences know γ and σ, so that the
variance is the sum of few squares and scatters by half. The pairs left out judge the fit that
did not see them: that is cross-validation for nothing.

Of few squares the sum is often too small. So the pairs are dealt to as many hands as well, each
with some of every incidence: that says how far the noise of single pairs alone moves the fit,
from many more pairs, and no interval may be narrower than that. Where incidences share
nothing, both estimate the same.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...stats.intervals import dof_of_sum, student
from .nearby import derivatives, follow
from .problem import Problem
from .solve import Question, Solution, evaluate

Array = NDArray[np.float64]

HANDS = 20
"""Groups that pairs are dealt to."""


class Refits(NamedTuple):
    """Fits that left out one group of pairs each.

    vectors, shape (groups, parameters); channels, shape (groups, channels[, 2]).
    """

    vectors: Array
    channels: Array


class Resampled(NamedTuple):
    """Refits without one group of incidences each, and without one hand of dealt pairs each.

    squares : sum of squared logarithmic residuals of each group of incidences by the fit
    without it, and counts : of how many values.
    """

    incidences: Refits
    hands: Refits
    squares: Array
    counts: Array

    @property
    def log_rms(self) -> float:
        """Root mean square over all pairs, each as a fit that never saw its incidence has it."""
        return float(np.sqrt(self.squares.sum() / self.counts.sum()))

    def half_width(self, of: Callable[[Refits], Array]) -> Array:
        """Half of the 95 % interval of what ``of`` makes of refits, groups along its first axis."""
        return np.maximum(half_width(of(self.incidences)), half_width(of(self.hands)))

    def interval(
        self, value: float, index: int, low: float = -np.inf, high: float = np.inf
    ) -> tuple[float, float]:
        """95 % interval of one entry of the vector, cut to where it may lie."""
        half = float(self.half_width(lambda refits: refits.vectors[:, index]))
        return max(low, value - half), min(high, value + half)


def resample(question: Question, solution: Solution) -> Resampled:
    """Fit again without each group of incidences, and without each hand of pairs."""
    problem = question.problem
    slopes = derivatives(question, solution)
    incidences = _refits(question, solution, slopes, problem.groups)
    squares, counts = [], []
    for group, vector, channel in zip(np.unique(problem.groups), *incidences, strict=True):
        left_out = question.select(problem.groups == group)
        squares.append(np.sum(evaluate(left_out, vector, channel) ** 2))
        counts.append(np.count_nonzero(left_out.problem.known))
    hands = _refits(question, solution, slopes, dealt(problem))
    return Resampled(incidences, hands, np.array(squares), np.array(counts))


def _refits(
    question: Question, solution: Solution, slopes: Array, groups: NDArray[np.intp]
) -> Refits:
    fits = []
    for group in np.unique(groups):
        rest = groups != group
        fits.append(
            follow(question.select(rest), solution, slopes[:, rest].reshape(len(slopes), -1))
        )
    return Refits(np.array([fit.vector for fit in fits]), np.array([fit.channel for fit in fits]))


def dealt(problem: Problem) -> NDArray[np.intp]:
    """Hand of each pair: neighbours of one incidence, by their brightness, go to different ones."""
    order = np.lexsort((problem.logs.sum(axis=1), problem.groups))
    hands = np.empty(len(order), np.intp)
    hands[order] = np.arange(len(order)) % HANDS
    return hands


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
