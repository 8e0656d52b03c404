"""How far two layers are from IL facets on the same surfaces."""

import numpy as np
from numpy.typing import NDArray

from microsurf.stats import squared_error

from .cases import projected_solid_angles

Array = NDArray[np.float64]


def relative(ones: Array, others: Array) -> tuple[float, float]:
    """Mean of paired differences over the mean of the others, in percent, and its error."""
    mean = others.mean()
    if mean == 0:
        return np.nan, np.nan
    ratio = (ones - others).mean() / mean
    rest = ones - (1 + ratio) * others
    return 100 * ratio, 100 * rest.std(ddof=1) / np.sqrt(len(rest)) / mean


def apart(ones: Array, others: Array) -> tuple[float, float]:
    """`relative` of values that are not paired."""
    mean = others.mean()
    ratio = ones.mean() / mean
    variances = [np.var(values, ddof=1) / len(values) for values in (ones, others)]
    error = np.sqrt(variances[0] + ratio**2 * variances[1])
    return 100 * (ratio - 1), 100 * error / mean


def lobe_distance(ones: Array, others: Array, *, paired: bool = True) -> tuple[float, float, float]:
    """Root mean square of the differences of two lobes over that of the others, in percent.

    Of means over realisations, without what their scatter adds; and its 95 % interval. Bins
    of light of shape (realisations, bins).
    """
    root = np.sqrt(projected_solid_angles())
    ones, others = ones / root, others / root
    size = float(np.linalg.norm(others.mean(0)))
    if paired:
        squared = squared_error.interval(ones - others, np.zeros_like(ones), np.inf)
    else:
        squared = squared_error.interval(others, ones, np.inf)
    ends = np.sqrt([squared.value, squared.low, squared.high])
    return tuple(float(100 * end / size) for end in ends)  # type: ignore[return-value]
