"""What is best for each channel alone, all channels at a time."""

import numpy as np
from numpy.typing import NDArray

from .materials import Lobes
from .parameters import CONDUCTOR_INDEX
from .problem import Problem

Array = NDArray[np.float64]

_STEPS = 12
_MOST_STEPS = 100  # where n and k know of each other
_DONE = 1e-9
_SMALL = 1e-8  # a step of ln n and ln k
_STUCK = 1e3  # damping


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
    low, high = np.log(CONDUCTOR_INDEX)
    logs = np.log(np.tile([1.0, 3.0], (channels, 1)) if start is None else start)
    logs = np.clip(logs, low, high)
    damping = np.full(channels, 1e-3)
    left = _left(problem, modelled, later, logs)
    live = np.arange(channels)
    for _ in range(_MOST_STEPS):
        some = problem.of_channels(live)
        added = later if isinstance(later, float) else later[:, live]
        at, before = logs[live], left[:, live]
        a, b = _slopes(some, modelled, at, before)
        aa, bb, ab = (np.sum(u * v, axis=0) for u, v in ((a, a), (b, b), (a, b)))
        ar, br = np.sum(a * before, axis=0), np.sum(b * before, axis=0)
        aa, bb = (square * (1 + damping[live]) + 1e-12 for square in (aa, bb))
        by_n, by_k = np.clip([bb * ar - ab * br, aa * br - ab * ar] / (aa * bb - ab**2), -1, 1)
        # What stops at a bound leaves the other its own best step.
        to_n, to_k = np.clip(at[:, 0] + by_n, low, high), np.clip(at[:, 1] + by_k, low, high)
        alone_n = at[:, 0] + np.clip((ar - ab * (to_k - at[:, 1])) / aa, -1, 1)
        alone_k = at[:, 1] + np.clip((br - ab * (to_n - at[:, 0])) / bb, -1, 1)
        stopped_n, stopped_k = to_n != at[:, 0] + by_n, to_k != at[:, 1] + by_k
        trial = np.stack(
            [np.where(stopped_k, alone_n, to_n), np.where(stopped_n, alone_k, to_k)], axis=1
        )
        trial = np.clip(trial, low, high)
        new = _left(some, modelled, added, trial)
        better = np.sum(new**2, axis=0) < np.sum(before**2, axis=0)
        logs[live[better]], left[:, live[better]] = trial[better], new[:, better]
        damping[live] *= np.where(better, 1 / 5, 5)
        # A channel whose next step is this small is at its minimum, up to rounding.
        moves = np.max(np.abs(trial - at), axis=1) > _SMALL
        live = live[moves & (better | (damping[live] < _STUCK))]
        if live.size == 0:
            break
    return np.asarray(np.exp(logs))


def _left(problem: Problem, modelled: Lobes, later: Array | float, logs: Array) -> Array:
    mirrored = np.stack([modelled.mirrored(n, k) for n, k in np.exp(logs)], axis=1)
    return problem.residuals(mirrored + later)


def _slopes(problem: Problem, modelled: Lobes, logs: Array, left: Array) -> Array:
    """Derivatives of the modelled logarithms by ln n and ln k, shape (2, pairs, channels)."""
    rise = np.stack([modelled.derivatives(n, k) for n, k in np.exp(logs)], axis=-1)
    total = np.exp(problem.logs - left)  # what was modelled
    return np.asarray(np.where(problem.known, rise * problem.cosine[:, None] / total, 0.0))
