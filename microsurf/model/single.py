"""First order of a rough interface: the BRDF of interfaced-Lambertian STD facets.

Ribardière et al., Workshop on Material Appearance Modeling 2018, eqs. 1–5;
Meneveaux et al., IEEE TVCG 24(3), 2018. With h the half vector,

    f_s = F(i·h) D(h) G(i, o, h) / (4 i_z o_z),
    f_b = 1/(i_z o_z) ∫ f_b^µ ⟨i·m⟩ ⟨o·m⟩ D(m) G(i, o, m) dm,

f_b^µ = w T(i·m) T(o·m)/(π (1 − r_e)) with the body weight w of `physics.facet`,
since n² (1 − r_i) = 1 − r_e. Body values here are those at w = 1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..physics import fresnel, smith, smith_fit, std, vcavity
from . import approximate
from .quadrature import body_integral

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


def white_mirror(facets: Facets, i: Array, o: Array) -> Array:
    """f_s with F = 1, D(h) G/(4 i_z o_z) in sr⁻¹, for unit directions of shape (..., 3), z > 0."""
    h = i + o
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    masking = vcavity.g2(i, o, h) if facets.masking == "vcavity" else facets.smith(i, o)
    return np.asarray(std.distribution(h, *facets.std) * masking / (4 * i[..., 2] * o[..., 2]))


def specular(facets: Facets, i: Array, o: Array) -> Array:
    """f_s in sr⁻¹ for unit directions of shape (..., 3) with z > 0."""
    half = np.linalg.norm(i + o, axis=-1) / 2  # i·h
    return np.asarray(fresnel.reflectance(half, facets.n, facets.k) * white_mirror(facets, i, o))


def body(facets: Facets, i: Array, o: Array, refinement: float = 1.0) -> Array:
    """f_b in sr⁻¹ at unit body weight, for unit directions of shape (pairs, 3) with z > 0."""
    if facets.masking == "approximate":
        return approximate.body(facets, i, o)
    integral = body_integral(
        i, o, *facets.std, facets.n, vcavity=facets.masking == "vcavity", refinement=refinement
    )
    escape = np.pi * fresnel.external_diffuse_transmittance(facets.n)
    return np.asarray(integral * facets.smith(i, o) / (escape * i[:, 2] * o[:, 2]))
