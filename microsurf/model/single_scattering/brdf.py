"""First order of a rough interface: the BRDF of interfaced-Lambertian STD facets.

Ribardière et al., Workshop on Material Appearance Modeling 2018, eqs. 1–5;
Meneveaux et al., IEEE TVCG 24(3), 2018. With h the half vector,

    f_s = F(i·h) D(h) G(i, o, h) / (4 i_z o_z),
    f_b = 1/(i_z o_z) ∫ f_b^µ ⟨i·m⟩ ⟨o·m⟩ D(m) G(i, o, m) dm,

f_b^µ = w T(i·m) T(o·m)/(π (1 − r_e)) with the body weight w of `physics.facet`,
since n² (1 − r_i) = 1 − r_e. Body values here are those at w = 1.
"""

import numpy as np
from numpy.typing import NDArray

from ...physics import fresnel, student_t, vcavity
from .body_quadrature import body_integral
from .facets import Facets

Array = NDArray[np.float64]


def white_mirror(facets: Facets, i: Array, o: Array, h: Array | None = None) -> Array:
    """f_s with F = 1, D(h) G/(4 i_z o_z) in sr⁻¹, for unit directions of shape (..., 3), z > 0.

    ``h`` are the half vectors, if they are known.
    """
    if h is None:
        h = i + o
        h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    masking = vcavity.g2(i, o, h) if facets.masking.vcavity else facets.g2(i, o)
    return np.asarray(
        student_t.distribution(h, *facets.std) * masking / (4 * i[..., 2] * o[..., 2])
    )


def specular(facets: Facets, i: Array, o: Array) -> Array:
    """f_s in sr⁻¹ for unit directions of shape (..., 3) with z > 0."""
    half = np.linalg.norm(i + o, axis=-1) / 2  # i·h
    return np.asarray(fresnel.reflectance(half, facets.n, facets.k) * white_mirror(facets, i, o))


def body(facets: Facets, i: Array, o: Array, refinement: float = 1.0) -> Array:
    """f_b in sr⁻¹ at unit body weight, for unit directions of shape (pairs, 3) with z > 0."""
    if facets.masking.body is not None:
        return facets.masking.body(facets, i, o)
    integral = body_integral(
        i, o, *facets.std, facets.n, vcavity=facets.masking.vcavity, refinement=refinement
    )
    escape = np.pi * fresnel.external_diffuse_transmittance(facets.n)
    return np.asarray(integral * facets.g2(i, o) / (escape * i[:, 2] * o[:, 2]))
