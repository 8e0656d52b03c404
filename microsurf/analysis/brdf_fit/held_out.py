"""Angles that a fit does not see, and distributions side by side on them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...stats import intervals
from .intervals import Resampled
from .nearby import follow
from .problem import LEAST_INCIDENCES, Problem
from .solve import Question, Solution, evaluate

Array = NDArray[np.float64]

HELD_OUT = (30.0, 60.0)
"""Incidences held out if nothing else is asked, degrees."""

_NEAR = 7.5  # degrees from what was asked to what was measured
_BAND = 2.5  # degrees either side, where incidences are a continuum
_EXACT = 0.1


class Evidence(NamedTuple):
    """One distribution against STD, incidence by incidence, each left out of its fit.

    gain : mean of (its squares − STD's) over the sum of both means, positive where STD is
    better; p : of no difference, by a paired t over incidences; better : incidences at
    which STD is.
    """

    gain: float
    p: float
    better: int
    of: int


def held_out(problem: Problem, wanted: tuple[float, ...]) -> tuple[NDArray[np.bool_], list[float]]:
    """Mask of the pairs at the incidences nearest to those wanted, and these in degrees.

    None where nothing is near, or too few incidences would be left.

    Raises
    ------
    InputError
        If an angle is not in 0 … 90.

    """
    for angle in wanted:
        if not 0 <= angle < 90:
            raise InputError(f"--hold-out {angle:g}: must be 0 ≤ θ < 90 degrees")
    theta = np.degrees(np.arccos(np.clip(problem.i[:, 2], -1, 1)))
    several = len(np.unique(np.round(theta, 1)))
    band = _EXACT if several <= np.unique(problem.groups).size else _BAND
    mask = np.zeros(len(theta), bool)
    angles: list[float] = []
    for angle in wanted:
        nearest = float(theta[np.argmin(np.abs(theta - angle))])
        new = mask | (np.abs(theta - nearest) <= band)
        left = len(np.unique(problem.groups[~new]))
        if (
            abs(nearest - angle) <= _NEAR
            and left >= LEAST_INCIDENCES
            and not mask[np.argmin(np.abs(theta - angle))]
        ):
            mask, angles = new, [*angles, round(nearest, 2)]
    return mask, angles


def held_out_log_rms(question: Question, solution: Solution, mask: NDArray[np.bool_]) -> float:
    """Root mean square at the pairs of a mask, by a fit of the others from a known solution."""
    fit = follow(question.select(~mask), solution)
    held = question.select(mask)
    return held.problem.rms(evaluate(held, fit.vector, fit.channel))


def evidence(other: Resampled, std: Resampled) -> Evidence:
    """Compare what two distributions leave at incidences that they did not see."""
    a, b = other.squares / other.counts, std.squares / std.counts
    difference = a - b
    total = float(a.mean() + b.mean())
    spread = float(difference.std(ddof=1))
    groups = len(difference)
    if spread == 0:
        p = 1.0
    else:
        t = difference.mean() / (spread / np.sqrt(groups))
        p = intervals.two_sided_p(t, groups - 1)
    gain = float(difference.mean() / total) if total > 0 else 0.0
    return Evidence(gain, p, int(np.count_nonzero(difference > 0)), groups)
