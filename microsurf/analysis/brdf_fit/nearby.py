"""Follow a known solution to a problem nearby: some pairs left out, or later orders changed.

Gauss–Newton steps from where the solution was: what changes a fit by a part of its interval
needs two of them, where a search with bounds and tests of its end takes ten evaluations more.
"""

import numpy as np
from numpy.typing import NDArray

from .solve import Question, Solution, inner

Array = NDArray[np.float64]

_STEPS = 5
_DIFFERENCE = 1e-5
_DONE = 1e-3
"""Change of the parameters after which the next, of its square, does not matter."""
_HALVINGS = 4


def follow(question: Question, near: Solution) -> Solution:
    """Solve a question from the solution of one nearby."""
    low, high = question.layout.bounds
    vector = near.vector
    channel, left = inner(question, vector, near.channel)
    for _ in range(_STEPS):
        jacobian = _jacobian(question, vector, channel, left)
        square = jacobian @ jacobian.T
        step = np.linalg.lstsq(square, jacobian @ left.ravel(), rcond=1e-12)[0]
        before = np.sum(left**2)
        for _halving in range(_HALVINGS):
            new = np.clip(vector - step, low, high)
            new_channel, new_left = inner(question, new, channel)
            if np.sum(new_left**2) <= before:
                break
            step = step / 2
        else:
            break
        size = float(np.max(np.abs(new - vector)))
        vector, channel, left = new, new_channel, new_left
        if size < _DONE:
            break
    return Solution(vector, channel, left, question.problem.rms(left))


def _jacobian(question: Question, vector: Array, channel: Array, left: Array) -> Array:
    """Derivatives of the residuals, what is solved inside following; 0 at a bound."""
    low, high = question.layout.bounds
    rows = np.zeros((len(vector), left.size))
    for k, value in enumerate(vector):
        if low[k] < value < high[k]:
            step = _DIFFERENCE if value + _DIFFERENCE < high[k] else -_DIFFERENCE
            moved = vector.copy()
            moved[k] += step
            rows[k] = ((inner(question, moved, channel)[1] - left) / step).ravel()
    return rows
