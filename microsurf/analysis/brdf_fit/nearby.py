"""Follow a known solution to a problem nearby: some pairs left out, or later orders changed.

Gauss–Newton steps, damped where they must be: what changes a fit by a part of its interval
needs two of them, where a search with bounds and tests of its end takes ten evaluations more.
Of many problems around one solution the derivatives there serve all: steps with them end at
the same point, if they end, and cost a third.
"""

import numpy as np
from numpy.typing import NDArray

from .solve import Question, Solution, inner

Array = NDArray[np.float64]

_STEPS = 5
_DIFFERENCE = 1e-5
_DONE = 1e-3
"""Change of the parameters after which the next, of its square, does not matter."""
_DAMPINGS = (0.0, 1e-3, 1e-1, 10.0, 1e3)


def follow(question: Question, near: Solution, slopes: Array | None = None) -> Solution:
    """Solve a question from the solution of one nearby.

    ``slopes`` are derivatives of its residuals near there, if they are known, see `derivatives`.
    """
    low, high = question.layout.bounds
    vector = near.vector
    channel, left = inner(question, vector, near.channel)
    for _ in range(_STEPS):
        jacobian = slopes
        if jacobian is None:
            jacobian = _jacobian(question, vector, channel, left)
        square, slope = jacobian @ jacobian.T, jacobian @ left.ravel()
        before = float(np.sum(left**2))
        for damping in _DAMPINGS:
            new = _step(vector, square, slope, damping, low, high)
            new_channel, new_left = inner(question, new, channel)
            if np.sum(new_left**2) <= before:
                break
        else:
            break  # at a minimum, up to rounding
        size = float(np.max(np.abs(new - vector)))
        vector, channel, left = new, new_channel, new_left
        if size < _DONE:
            break
    return Solution(vector, channel, left, question.problem.rms(left))


def derivatives(question: Question, at: Solution) -> Array:
    """Derivatives of the residuals by the vector, shape (parameters, pairs, channels)."""
    channel, left = inner(question, at.vector, at.channel)
    rows = _jacobian(question, at.vector, channel, left)
    return rows.reshape(-1, *left.shape)


def _step(
    vector: Array, square: Array, slope: Array, damping: float, low: Array, high: Array
) -> Array:
    """Make a damped step; what would leave its bounds stops there, and the rest is solved again."""
    new, free = vector.copy(), np.diag(square) > 0
    for _ in vector:
        inside = np.flatnonzero(free)
        moved = new - vector
        target = slope[inside] + square[np.ix_(inside, np.flatnonzero(~free))] @ moved[~free]
        matrix = square[np.ix_(inside, inside)]
        matrix = matrix + damping * np.diag(np.diag(matrix))
        new[inside] = vector[inside] - np.linalg.lstsq(matrix, target, rcond=1e-14)[0]
        out = free & ((new < low) | (new > high))
        new = np.clip(new, low, high)
        if not out.any():
            break
        free = free & ~out
    return new


def _jacobian(question: Question, vector: Array, channel: Array, left: Array) -> Array:
    """Derivatives of the residuals, what is solved inside following."""
    high = question.layout.bounds[1]
    rows = np.zeros((len(vector), left.size))
    for k, value in enumerate(vector):
        step = _DIFFERENCE if value + _DIFFERENCE < high[k] else -_DIFFERENCE
        moved = vector.copy()
        moved[k] += step
        rows[k] = ((inner(question, moved, channel)[1] - left) / step).ravel()
    return rows
