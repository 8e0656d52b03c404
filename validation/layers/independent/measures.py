"""How far two sources of light are from each other."""

import numpy as np
from numpy.typing import NDArray

from .cases import WALKS

Array = NDArray[np.float64]


def over(ones: Array, others: Array) -> tuple[float, float]:
    """Mean of ones over that of others, less 1, in percent, and its standard error.

    Traces of the same realisations are paired; of a theory there is one value, of WALKS walks.
    """
    ratio = ones.mean() / others.mean()
    variance = 0.0
    if len(ones) == len(others):
        variance = float(np.var(ones - ratio * others, ddof=1)) / len(others)
    else:
        for values, factor in ((ones, 1.0), (others, ratio)):
            mean = values.mean()
            one = len(values) == 1
            spread = mean * (1 - mean) / WALKS if one else np.var(values, ddof=1) / len(values)
            variance += float(factor**2 * spread)
    return 100 * (ratio - 1), 100 * float(np.sqrt(variance)) / others.mean()
