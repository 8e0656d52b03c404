"""One interfaced-Lambertian (IL) facet: a flat Fresnel interface over a Lambertian substrate.

Simonot, Applied Optics 48(30), 5793, 2009; Meneveaux et al., IEEE TVCG 24(3),
2018. Specular: F(i·m) into the mirror direction. Body (Ribardière et al. 2018,
eq. 5): f_b = T(i·m) T(o·m) Kd / (π n² (1 − Kd r_i)).

Its albedo F + T·w has the *body weight* w = Kd (1−r_i)/(1−Kd r_i), which is 1 at
Kd = 1. If the exit direction is drawn ∝ T(o·m) o·m every body event weighs w,
whatever the directions, so a path's weight is w^(number of body events).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import float_array, require
from . import fresnel

Array = NDArray[np.float64]


def body_weight(n: ArrayLike, kd: ArrayLike) -> Array:
    """Weight w of one body event, in [0, 1]; n ≥ 1, Kd in [0, 1]; exactly 1 at Kd = 1.

    Kd = 0 is no substrate: w = 0 whatever n, also for the n < 1 of a conductor.
    """
    kd = _albedo(kd)
    n = np.where(kd == 0, 1.0, float_array("n", n))
    escape = fresnel.external_diffuse_transmittance(n) / n**2
    return np.asarray(kd * escape / ((1 - kd) + kd * escape))


def _albedo(kd: ArrayLike) -> Array:
    """Return Kd as an array; refuse what is not the albedo of a substrate."""
    kd = float_array("kd", kd)
    require(bool(np.all((kd >= 0) & (kd <= 1))), "kd", kd, "0 … 1, the albedo of the substrate")
    return kd


def body(cos_i: ArrayLike, cos_o: ArrayLike, n: float, kd: ArrayLike) -> Array:
    """Body BRDF f_b of the facet in sr⁻¹; cosines to its normal; 0 where one is ≤ 0."""
    cos_i, cos_o = float_array("cos_i", cos_i), float_array("cos_o", cos_o)
    kd = _albedo(kd)
    front = (cos_i > 0) & (cos_o > 0)
    pair = fresnel.transmittance(np.where(front, cos_i, 1), n) * fresnel.transmittance(
        np.where(front, cos_o, 1), n
    )
    # n²(1 − Kd r_i) with 1 − r_i = (1 − r_e)/n² put in: no difference of near equals.
    trapped = n**2 * (1 - kd) + kd * fresnel.external_diffuse_transmittance(n)
    return np.where(front, pair * kd / (np.pi * trapped), 0.0)


def albedo(cos_i: ArrayLike, n: float, kd: ArrayLike) -> Array:
    """Directional albedo F(i·m) + T(i·m) w; exactly 1 at Kd = 1."""
    transmitted = fresnel.transmittance(cos_i, n)
    weight = body_weight(n, kd)
    # The first is exact at w = 1, the second keeps its digits where F and w are small.
    return np.where(
        weight > 0.5,
        1 - transmitted * (1 - weight),
        fresnel.reflectance(cos_i, n) + transmitted * weight,
    )


def mirror(i: ArrayLike, m: ArrayLike) -> Array:
    """Mirror direction 2 (i·m) m − i, shape (..., 3)."""
    i, m = float_array("i", i), float_array("m", m)
    return np.asarray(2 * np.sum(i * m, axis=-1, keepdims=True) * m - i)


def sample(
    i: ArrayLike, m: ArrayLike, n: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    """Draw what one facet event does to light from i: directions o and whether it was a body event.

    Specular with probability F(i·m), else a body event with o ∝ T(o·m) o·m by
    rejection (acceptance (1 − r_e)/max T). Weights: 1 for specular, `body_weight` for body.

    Parameters
    ----------
    i, m : array_like, shape (..., 3)
        Towards the light, and facet normals with i·m > 0.
    n : float
        Relative index, ≥ 1.
    rng : numpy.random.Generator
        Source of randomness.

    """
    i, m = np.broadcast_arrays(float_array("i", i), float_array("m", m))
    o = mirror(i, m)
    is_body = rng.random(i.shape[:-1]) < fresnel.transmittance(np.sum(i * m, axis=-1), n)
    pending = np.flatnonzero(is_body)
    bound = fresnel.transmittance_bound(n)
    out, normal = o.reshape(-1, 3), m.reshape(-1, 3)
    while pending.size:
        direction = _cosine_lobe(normal[pending], rng)
        mu = np.sum(direction * normal[pending], axis=-1)
        passed = fresnel.transmittance(np.clip(mu, 0, 1), n)
        accepted = rng.random(pending.size) * bound < passed
        out[pending[accepted]] = direction[accepted]
        pending = pending[~accepted]
    return out.reshape(i.shape), is_body


def _cosine_lobe(m: Array, rng: np.random.Generator) -> Array:
    """Return directions of density (o·m)/π about normals m: from a sphere tangent to the facet."""
    z = 2 * rng.random(len(m)) - 1
    azimuth = 2 * np.pi * rng.random(len(m))
    ring = np.sqrt(np.maximum(0, 1 - z**2))
    point = np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), z], axis=-1) + m
    return np.asarray(point / np.linalg.norm(point, axis=-1, keepdims=True))
