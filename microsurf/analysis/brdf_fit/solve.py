"""Least squares in logarithms, what belongs to one channel solved inside (`inside`).

Variable projection (Golub and Pereyra, Inverse Problems 19, 2003): for every trial of the
shared parameters the weights w_λ, or the indices n_λ + ik_λ of a conductor, are the best
there are, so that a search over two to six numbers remains whatever the number of channels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .inside import best_indices, best_weights
from .materials import Lobes, Material, lobes
from .parameters import Layout
from .problem import Problem

Array = NDArray[np.float64]

_SIGMAS = (0.01, 0.03, 0.08, 0.2, 0.5)
_ETAS = (0.1, 1.0)
_REFINED = 3  # of the starts, the best ones
_TOLERANCE = 1e-5
_FEW = 400  # pairs that tell starts apart
_ROUGH = 1e-4
_FLAT = 1e-14  # a gradient of rounding: data without noise
_SAME = 1e-3  # relative: minima of the same sum of squares


@dataclass(frozen=True)
class Question:
    """What is fitted: pairs, material, free parameters, and light that is added unchanged.

    ``later`` is that of later orders in sr⁻¹, shape (pairs, channels).
    """

    problem: Problem
    material: Material
    layout: Layout
    later: Array | float = 0.0

    def select(self, rows: NDArray[np.bool_]) -> "Question":
        """Return the question for some of the pairs."""
        later = self.later if isinstance(self.later, float) else self.later[rows]
        return Question(self.problem.select(rows), self.material, self.layout, later)


@dataclass(frozen=True)
class Solution:
    """Best parameters found.

    ``channel`` holds the body weight w of each channel, shape (channels,), or a conductor's
    n and k, shape (channels, 2). Of ``starts``, the best ``refined`` were followed, and
    ``agreeing`` of those ended at the same minimum.
    """

    vector: Array
    channel: Array
    residuals: Array
    rms: float
    starts: int = 1
    refined: int = 1
    agreeing: int = 1


def model(question: Question, modelled: Lobes, vector: Array, channel: Array) -> Array:
    """BRDF of order 1 and what is added, shape (pairs, channels)."""
    if modelled.body is None:
        mirrored = np.stack([modelled.mirrored(n, k) for n, k in channel], axis=1)
        return np.asarray(mirrored + question.later)
    return np.asarray(
        _mirrored(question, modelled, vector)[:, None]
        + modelled.body[:, None] * channel
        + question.later
    )


def _mirrored(question: Question, modelled: Lobes, vector: Array) -> Array:
    of = question.layout.values(vector)
    return modelled.mirrored(of["n"], of.get("k", 0.0))


def evaluate(question: Question, vector: Array, channel: Array) -> Array:
    """Residuals of given parameters, nothing solved: for pairs that were held out."""
    modelled = lobes(question.problem, question.material, question.layout, vector)
    return question.problem.residuals(model(question, modelled, vector, channel))


def inner(question: Question, vector: Array, start: Array | None) -> tuple[Array, Array]:
    """Return what is best for each channel, and the residuals with it."""
    modelled = lobes(question.problem, question.material, question.layout, vector)
    if modelled.body is None:
        channel = best_indices(question.problem, modelled, question.later, start)
    else:
        fixed = _mirrored(question, modelled, vector)[:, None] + question.later
        channel = best_weights(question.problem, fixed, modelled.body, start)
    return channel, question.problem.residuals(model(question, modelled, vector, channel))


def refine(
    question: Question, vector: Array, channel: Array | None = None, tolerance: float = _TOLERANCE
) -> Solution:
    """Follow the squares down from one start; ``tolerance`` is that of the parameters."""
    low, high = question.layout.bounds
    last = [channel]

    def residuals(x: Array) -> Array:
        last[0], solution = inner(question, x, last[0])
        return solution.ravel()

    room = 1e-6 * (high - low)
    inside = np.clip(vector, low + room, high - room)
    solution = least_squares(
        residuals, inside, bounds=(low, high), x_scale="jac", xtol=tolerance,
        ftol=tolerance**1.5, gtol=_FLAT, max_nfev=40,
    )  # fmt: skip
    best, left = inner(question, solution.x, last[0])
    return Solution(solution.x, best, left, question.problem.rms(left))


def solve(question: Question, known: Sequence[Array] = ()) -> Solution:
    """Fit from several starts.

    A coarse grid and ``known`` vectors are tried on some of the pairs, the brightest of
    each incidence among them; the best are refined there, and then on all pairs.
    """
    few = question.select(_some(question.problem))
    tried = []
    for vector in [*_grid(question), *known]:
        channel, left = inner(few, vector, None)
        tried.append((few.problem.rms(left), vector, channel))
    order = sorted(range(len(tried)), key=lambda k: tried[k][0])
    # What is known is never left out: a family holds its members, and fits no worse.
    chosen = [*order[:_REFINED], *(k for k in order[_REFINED:] if k >= len(tried) - len(known))]
    rough = [refine(few, *tried[k][1:], _ROUGH) for k in chosen]
    rough.sort(key=lambda row: row.rms)
    agreeing = sum(row.rms <= rough[0].rms * (1 + _SAME) for row in rough)
    ends = [rough[0], *(row for row in rough[1:2] if row.rms > rough[0].rms * (1 + _SAME))]
    solutions = [refine(question, row.vector, row.channel) for row in ends]
    best = min(solutions, key=lambda row: row.rms)
    return replace(best, starts=len(tried), refined=len(chosen), agreeing=agreeing)


def _grid(question: Question) -> list[Array]:
    layout = question.layout
    low, high = layout.bounds
    sigmas = [s for s in np.log(_SIGMAS) if low[0] <= s <= high[0]] or [(low[0] + high[0]) / 2]
    etas = [(eta,) for eta in _ETAS] if layout.eta is None else [()]
    stretched = [()] if layout.isotropic else [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.0, -0.3)]
    return [
        np.array([sigma, *stretch, *eta, *optics])
        for sigma, stretch, eta, optics in product(sigmas, stretched, etas, question.material.start)
    ]


def _some(problem: Problem) -> NDArray[np.bool_]:
    """Mask of at most _FEW pairs, with the brightest of each group."""
    pairs = len(problem.i)
    if pairs <= _FEW:
        return np.ones(pairs, bool)
    mask = np.zeros(pairs, bool)
    mask[np.random.default_rng(5).choice(pairs, _FEW, replace=False)] = True
    bright = problem.logs.sum(axis=1)
    for group in np.unique(problem.groups):
        mine = np.flatnonzero(problem.groups == group)
        mask[mine[np.argsort(bright[mine])[-3:]]] = True
    return mask
