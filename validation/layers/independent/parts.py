"""Which part of a thick pair of layers the walk is off by, and what the structure does to it.

The closed limit of two layers far apart takes R and r_e′ of the interface, and K of the substrate.
Each is traced on the surfaces and walked; with one of them walked and the others traced the limit
says what that part is worth. Structures have the same slopes as the independent one, which is
all that the walk takes.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cases import KD, THETAS, Parts, traced_parts, walked_parts

Array = NDArray[np.float64]
Row = dict[str, Any]

CASES = (
    (8.0, "independent", 256),
    (2.0, "independent", 256),
    (2.0, "independent", 512),
    (2.0, "tops", 256),
    (2.0, "middle", 256),
    (2.0, "extremes", 256),
)
"""γ, structure, cells a side."""


def off_by_part(traced: Parts, walked: Parts) -> dict[str, Array]:
    """Percent of the traced limit that each part is worth if it is walked, by θ_i."""
    means = Parts(*(part.mean(0, keepdims=True) for part in traced))
    return {
        name: 100 * (means._replace(**{name: getattr(walked, name)}).limit / means.limit - 1)[0]
        for name in ("reflected", "diffuse", "substrate")
    }


def rows() -> Iterator[Row]:
    """One row a case and θ_i; the walk over the traces − 1 and its parts in percent."""
    for gamma, structure, cells in CASES:
        traced, walked = traced_parts(gamma, structure, cells), walked_parts(gamma)
        worth = off_by_part(traced, walked)
        count = len(traced.total)
        for t, theta in enumerate(THETAS):
            total = traced.total[:, t]
            ratio = walked.total[0, t] / total.mean()
            error = ratio * total.std(ddof=1) / np.sqrt(count) / total.mean()
            yield {
                "gamma": gamma, "structure": structure, "cells": cells, "theta_i": theta, "kd": KD,
                "traced": float(total.mean()), "walked": float(walked.total[0, t]),
                "percent": 100 * (ratio - 1), "percent_error": 100 * error,
                **{f"by_{name}": float(values[t]) for name, values in worth.items()},
                "traced_over_limit": 100 * float(total.mean() / traced.limit[:, t].mean() - 1),
                "walked_over_limit": 100 * float(walked.total[0, t] / walked.limit[0, t] - 1),
                "substrate_traced": float(traced.substrate.mean()),
                "substrate_error": float(traced.substrate.std(ddof=1) / np.sqrt(count)),
                "substrate_walked": float(walked.substrate[0, 0]),
            }  # fmt: skip
