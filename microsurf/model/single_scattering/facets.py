"""Facets of the single-scattering models: their material, slopes and masking."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics import smith, smith_fit

Array = NDArray[np.float64]

MASKINGS = ("approximate", "smith", "smith-separable", "vcavity")
FITTED = ("smith-fit", "smith-separable-fit")
"""The same with Λ by the published fit: measured beside the exact ones, never a default."""
_SMITH = {
    "smith-separable": smith.g2_separable,
    "smith-fit": smith_fit.g2_height_correlated,
    "smith-separable-fit": smith_fit.g2_separable,
}
"""Smith's G2 by masking, if it is not the exact height-correlated one."""


@dataclass(frozen=True)
class Facets:
    """Facets and how they hide one another.

    Relative index n ≥ 1, or n + ik of a conductor (k > 0); STD shape γ in (3/2, ∞] and
    roughness σ > 0 along x and y; ``masking`` one of MASKINGS or FITTED: Smith's G2
    height-correlated (Heitz 2014, eq. 99) or separable, that of V-cavities (Torrance
    and Sparrow 1967), or "approximate": the first with a closed form in place of the
    body integral. FITTED take Λ from `smith_fit`.
    """

    n: float
    gamma: float
    sigma_x: float
    sigma_y: float
    masking: str = "smith"
    k: float = 0.0

    @property
    def isotropic(self) -> bool:
        """Whether only the azimuth between i and o matters."""
        return self.sigma_x == self.sigma_y

    @property
    def std(self) -> tuple[float, float, float]:
        """Parameters γ, σ_x, σ_y."""
        return self.gamma, self.sigma_x, self.sigma_y

    def smith(self, i: Array, o: Array) -> Array:
        """Smith's G2; 1 for V-cavities, whose G depends on m."""
        if self.masking == "vcavity":
            return np.ones(np.broadcast_shapes(i.shape, o.shape)[:-1])
        return _SMITH.get(self.masking, smith.g2_height_correlated)(i, o, *self.std)
