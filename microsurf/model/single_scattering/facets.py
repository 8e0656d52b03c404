"""Facets of the single-scattering models: their material, slopes and masking."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...physics import smith

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Masking:
    """How facets hide one another, see `model.registry`.

    ``g2(i, o, gamma, sigma_x, sigma_y)`` is a G2 of the directions alone, as Smith's; None is
    that of V-cavities (Torrance and Sparrow 1967), which depends on the facet too.
    ``body(facets, i, o)`` is a closed form in place of the body integral, if there is one.
    """

    g2: Callable[..., Array] | None
    body: Callable[..., Array] | None = None

    @property
    def vcavity(self) -> bool:
        """Whether G depends on the facet, as that of V-cavities."""
        return self.g2 is None


SMITH = Masking(smith.g2_height_correlated)
"""Height-correlated (Heitz 2014, eq. 99)."""


@dataclass(frozen=True)
class Facets:
    """Facets and how they hide one another.

    Relative index n ≥ 1, or n + ik of a conductor (k > 0); STD shape γ in (3/2, ∞] and
    roughness σ > 0 along x and y; masking, by default Smith's.
    """

    n: float
    gamma: float
    sigma_x: float
    sigma_y: float
    masking: Masking = SMITH
    k: float = 0.0

    @property
    def isotropic(self) -> bool:
        """Whether only the azimuth between i and o matters."""
        return self.sigma_x == self.sigma_y

    @property
    def std(self) -> tuple[float, float, float]:
        """Parameters γ, σ_x, σ_y."""
        return self.gamma, self.sigma_x, self.sigma_y

    def g2(self, i: Array, o: Array) -> Array:
        """G2 of the directions alone; 1 for V-cavities, whose G depends on m."""
        if self.masking.g2 is None:
            return np.ones(np.broadcast_shapes(i.shape, o.shape)[:-1])
        return self.masking.g2(i, o, *self.std)
