"""The step of an instrument's heights: its digits, or the single precision of its file."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ROUNDING = 1e-12  # relative to the largest height: units were converted
_ON_STEPS = 0.01  # of a step


def height_step(heights: Array) -> float | None:
    """Return the distance of the values that heights can take, or None if they have none.

    The smallest difference of two heights is the step if nine in ten of the differences
    of neighbouring values are its multiples.

    Parameters
    ----------
    heights : ndarray
        As they were stored, in any unit: not levelled, no filled ones.

    """
    values = np.unique(heights)
    # Of random heights a quarter and more would be equal to another by chance alone.
    if not 2 < values.size <= 0.75 * heights.size:
        return None
    gaps = np.diff(values)
    gaps = gaps[gaps > _ROUNDING * np.abs(values).max()]
    if gaps.size == 0:
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    multiples = gaps / step
    near = np.abs(multiples - np.rint(multiples)) < _ON_STEPS * np.maximum(multiples, 1)
    return step if np.mean(near) >= 0.9 else None
