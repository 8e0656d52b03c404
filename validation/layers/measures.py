"""How far two sources of light are from each other."""

import numpy as np
from numpy.typing import NDArray

from microsurf.stats import squared_error

from .cases import projected_solid_angles

Array = NDArray[np.float64]


def relative(
    ones: Array, others: Array, *, paired: bool = True, walks: int = 0
) -> tuple[float, float]:
    """Mean of ones over that of others, less 1, in percent, and its standard error.

    NaN if the others are dark.

    Parameters
    ----------
    ones, others : array, shape (realisations,)
        Albedos.
    paired : bool
        Whether both are of the same realisations, of one number; else both scatter on their own.
    walks : int
        Of how many walks a single value is that is not paired: each gives all or nothing, which
        bounds its variance.

    """
    mean = others.mean()
    if mean == 0:
        return np.nan, np.nan
    ratio = ones.mean() / mean
    if paired:
        variance = np.var(ones - ratio * others, ddof=1) / len(ones)
    else:
        variance = _of_mean(ones, walks) + ratio**2 * _of_mean(others, walks)
    return 100 * float(ratio - 1), 100 * float(np.sqrt(variance) / mean)


def _of_mean(values: Array, walks: int) -> float:
    """Variance of the mean, of several realisations or of a value by walks."""
    if len(values) == 1:
        return float(values[0] * (1 - values[0]) / walks)
    return float(np.var(values, ddof=1) / len(values))


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
