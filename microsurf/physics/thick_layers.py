"""Two layers that know nothing of each other: albedo in closed form.

Where an interface lies far above a substrate, and their reliefs are independent, light meets
either as Lambertian light, whatever it was sent by. What returns is then a geometric series.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def thick_albedo(
    reflected: ArrayLike, diffuse_reflected: ArrayLike, substrate: ArrayLike, n: float
) -> NDArray[np.float64]:
    """Albedo R + (1 − R) K (1 − r′)/(1 − K r′), r′ = 1 − (1 − r_e′)/n², by reciprocity.

    Of two planes it is the interfaced-Lambertian facet's albedo, `physics.facet.albedo`.

    Parameters
    ----------
    reflected, diffuse_reflected : array
        R and r_e′: parts of the beam, and of light from the Lambertian hemisphere, that the
        interface sends back without a substrate event.
    substrate : array
        K: albedo of the substrate alone, under Lambertian light at n = 1. At K = 1 it is 1.
    n : float
        Index of what lies between, ≥ 1.

    """
    beam, diffuse, k = (
        np.asarray(values, float) for values in (reflected, diffuse_reflected, substrate)
    )
    out = (1 - diffuse) / n**2  # 1 − r′: what passes from below
    return np.asarray(beam + (1 - beam) * k * out / (1 - k + k * out))
