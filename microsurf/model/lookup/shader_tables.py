"""Tables on even grids, for renderers whose kernels look up and multiply.

With a = tanθ σ(φ) and u = a/(1 + a), Smith's Λ(1 − u) is smooth and bounded on [0, 1]. The body
term without its masking, f_b i_z o_z/G2, is smooth and bounded over all pairs of directions.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...physics import smith, visible_normals
from ..single_scattering.facets import Facets
from .body_ratio import tabulated_body
from .pair_table import PairTable, tabulate

Array = NDArray[np.float64]

LAMBDA_STEPS = 1024
POLAR, TURNS = 44, 33
POLAR_OF_FOUR, TURNS_OF_FOUR, AZIMUTHS = 40, 37, 21  # where φ_i matters too


@dataclass(frozen=True)
class ShaderTables:
    """What a shader of order 1 looks up.

    Attributes
    ----------
    masking : array, shape (LAMBDA_STEPS + 1,)
        Λ(1 − u) at even u.
    body : PairTable or None
        f_b i_z o_z/G2 in sr⁻¹ at unit body weight; None of facets without a substrate.

    """

    masking: Array
    body: PairTable | None


def masking_table(gamma: float) -> Array:
    """Λ(1 − u) at even u in [0, 1] for STD of γ > 3/2; linear between them, below 1e−4 of Λ + 1."""
    u = np.linspace(0, 1, LAMBDA_STEPS + 1)[1:-1]
    nu = 2 * gamma - 2
    inner = smith.lambda_of_x(np.sqrt(2) * (1 - u) / u, nu) * (1 - u)
    return np.concatenate([[0.0], inner, [visible_normals.mean_excess(nu) / np.sqrt(2)]])


def body_table(facets: Facets) -> PairTable:
    """Body term without its masking on an even grid, by way of `tabulated_body`."""
    exact, few = tabulated_body(facets), facets.isotropic

    def bare(i: Array, o: Array) -> Array:
        return exact.evaluate(i, o) * i[:, 2] * o[:, 2] / exact.facets.g2(i, o)

    return tabulate(
        bare,
        isotropic=few,
        polar=POLAR if few else POLAR_OF_FOUR,
        turns=TURNS if few else TURNS_OF_FOUR,
        azimuths=AZIMUTHS,
    )


@lru_cache(8)
def shader_tables(facets: Facets) -> ShaderTables:
    """Both, of height-correlated Smith masking; the last few are remembered."""
    return ShaderTables(masking_table(facets.gamma), None if facets.k > 0 else body_table(facets))
