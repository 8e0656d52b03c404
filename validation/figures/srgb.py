"""What a screen is given for light."""

import numpy as np
from numpy.typing import NDArray


def encode(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Encode linear light, any shape, 0 … 1, what lies outside cut off: IEC 61966-2-1:1999, 5.2."""
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
