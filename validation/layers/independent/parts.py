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
from scipy import stats

from ..measures import relative
from .cases import KD, THETAS, WALKS, Parts, traced_parts, walked_parts

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
        for t, theta in enumerate(THETAS):
            total, limits = traced.total[:, t], (traced.limit[:, t], walked.limit[:, t])
            percent, error = relative(walked.total[:, t], total, paired=False, walks=WALKS)
            yield {
                "gamma": gamma, "structure": structure, "cells": cells, "theta_i": theta, "kd": KD,
                "traced": float(total.mean()), "walked": float(walked.total[0, t]),
                "percent": percent, "percent_error": error,
                **{f"by_{name}": float(values[t]) for name, values in worth.items()},
                "traced_over_limit": relative(total, limits[0])[0],
                "walked_over_limit": 100 * float(walked.total[0, t] / limits[1][0] - 1),
                "substrate_traced": float(traced.substrate.mean()),
                "substrate_error": float(stats.sem(traced.substrate[:, 0])),
                "substrate_walked": float(walked.substrate[0, 0]),
            }  # fmt: skip
