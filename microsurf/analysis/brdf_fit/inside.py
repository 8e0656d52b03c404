"""What is best for each channel alone, all channels at a time."""

import numpy as np
from numpy.typing import NDArray

from .materials import Lobes
from .parameters import CONDUCTOR_INDEX
from .problem import Problem

Array = NDArray[np.float64]

_STEPS = 12
_DONE = 1e-9
_STEP = 1e-5  # of ln n and ln k, for differences


def best_weights(problem: Problem, fixed: Array, body: Array, start: Array | None) -> Array:
    """Body weights w_λ in [0, 1], shape (channels,), by Gauss–Newton.

    The logarithm is nearly straight where body light is: two to four steps.
    """
    cosine = problem.cosine[:, None]
    offset = 1 + fixed * cosine
    slope = (body * problem.cosine)[:, None]
    weights = np.full(problem.logs.shape[1], 0.5) if start is None else start
    for _ in range(_STEPS):
        total = np.maximum(offset + slope * weights, 1e-3)
        left = np.where(problem.known, problem.logs - np.log(total), 0.0)
        rise = np.where(problem.known, slope / total, 0.0)
        square = np.maximum(np.sum(rise**2, axis=0), 1e-300)
        step = np.clip(weights + np.sum(rise * left, axis=0) / square, 0.0, 1.0) - weights
        weights = weights + step
        if np.max(np.abs(step)) < _DONE:
            break
    return np.asarray(weights)


def best_indices(
    problem: Problem, modelled: Lobes, later: Array | float, start: Array | None
) -> Array:
    """Index n + ik of each channel, shape (channels, 2), by damped Gauss–Newton in ln n, ln k."""
    channels = problem.logs.shape[1]
    logs = np.log(np.tile([1.0, 3.0], (channels, 1)) if start is None else start)
    low, high = np.log(CONDUCTOR_INDEX)
    damping = np.full(channels, 1e-3)
    left = _left(problem, modelled, later, logs)
    for _ in range(_STEPS if start is not None else 4 * _STEPS):
        columns = [
            (_left(problem, modelled, later, logs + _STEP * np.eye(2)[a]) - left) / -_STEP
            for a in range(2)
        ]
        a, b = columns
        aa, bb, ab = (np.sum(u * v, axis=0) for u, v in ((a, a), (b, b), (a, b)))
        ar, br = np.sum(a * left, axis=0), np.sum(b * left, axis=0)
        aa, bb = aa * (1 + damping) + 1e-12, bb * (1 + damping) + 1e-12
        steps = np.stack([bb * ar - ab * br, aa * br - ab * ar], 1) / (aa * bb - ab**2)[:, None]
        trial = np.clip(logs + np.clip(steps, -1, 1), low, high)
        new = _left(problem, modelled, later, trial)
        better = np.sum(new**2, axis=0) < np.sum(left**2, axis=0)
        moved = np.max(np.abs(np.where(better[:, None], trial - logs, 0.0)))
        logs, left = np.where(better[:, None], trial, logs), np.where(better, new, left)
        damping = np.where(better, damping / 5, damping * 5)
        if moved < 1e-7 and np.all(better | (damping > 1e3)):
            break
    return np.asarray(np.exp(logs))


def _left(problem: Problem, modelled: Lobes, later: Array | float, logs: Array) -> Array:
    mirrored = np.stack([modelled.mirrored(n, k) for n, k in np.exp(logs)], axis=1)
    return problem.residuals(mirrored + later)
