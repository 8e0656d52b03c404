"""The exact body term as a closed form times a table: fast, and nearly as right as the integral.

The closed form of `single_scattering.body_closed_form` is a few per cent off and has all the
shape there is, so that its error is smooth and few nodes hold it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..single_scattering.body_closed_form import APPROXIMATE
from ..single_scattering.brdf import body
from ..single_scattering.facets import SMITH, Facets
from .pair_table import PairTable, tabulate

Array = NDArray[np.float64]

_POLAR, _TURNS = 16, 13
_POLAR_OF_FOUR, _TURNS_OF_FOUR = 12, 9  # where φ_i matters too


@dataclass(frozen=True)
class TabulatedBody:
    """f_b of Smith's height-correlated masking at unit body weight."""

    facets: Facets
    ratio: PairTable

    def evaluate(self, i: Array, o: Array) -> Array:
        """Values in sr⁻¹ for unit directions, shape (pairs, 3), z > 0."""
        return np.asarray(body(self.facets, i, o) * self.ratio.at(i, o))


def tabulated_body(facets: Facets) -> TabulatedBody:
    """Make the table for facets: some 3000 integrals if they are isotropic, else 12000."""
    exact, closed = replace(facets, masking=SMITH), replace(facets, masking=APPROXIMATE)
    few = facets.isotropic
    table = tabulate(
        lambda i, o: body(exact, i, o) / body(closed, i, o),
        isotropic=few,
        polar=_POLAR if few else _POLAR_OF_FOUR,
        turns=_TURNS if few else _TURNS_OF_FOUR,
    )
    return TabulatedBody(closed, table)
