"""A BRDF of one's own to be tested: GGX facets, each a flat interface over a substrate.

    microsurf validate validation/examples/ggx.toml --model validation.examples.user_brdf:brdf

Nothing of microsurf is used. The pair that `brdf` returns is order 1: one bounce, off the
interface and out of the substrate.
"""

import numpy as np

N, KD, ALPHA = 1.5, 0.8, 0.3  # those of ggx.toml


def fresnel(cosine):
    """Reflectance of unpolarised light from outside."""
    g = np.sqrt(N**2 - 1 + cosine**2)
    ratio = (g - cosine) / (g + cosine)
    swap = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return ratio**2 * (1 + swap**2) / 2


def _internal_diffuse():
    """r_i: what the interface sends back of diffuse light from inside."""
    x, w = np.polynomial.legendre.leggauss(200)
    mu = (x + 1) / 2
    return 1 - (1 - np.sum(w * mu * fresnel(mu))) / N**2


R_I = _internal_diffuse()


def ggx(cosine):
    """Distribution of the facets' normals, by their cosine to the mean one."""
    return ALPHA**2 / (np.pi * (cosine**2 * (ALPHA**2 - 1) + 1) ** 2)


def masking(i, o):
    """Smith's height-correlated G."""
    of_i, of_o = (
        (np.sqrt(1 + ALPHA**2 * (1 - w[:, 2] ** 2) / w[:, 2] ** 2) - 1) / 2 for w in (i, o)
    )
    return 1 / (1 + of_i + of_o)


def specular(i, o):
    """F D G/(4 i_z o_z)."""
    h = (i + o) / np.linalg.norm(i + o, axis=1, keepdims=True)
    return fresnel(np.sum(i * h, axis=1)) * ggx(h[:, 2]) * masking(i, o) / (4 * i[:, 2] * o[:, 2])


def _facets():
    """Slopes of some facets, equally probable but for the weights of the rule."""
    x, w = np.polynomial.legendre.leggauss(10)
    u = (x[:, None] + 1) / 2
    radius = ALPHA * np.sqrt(u / (1 - u))
    phi = 2 * np.pi * (np.arange(16) + 0.5) / 16
    p, q = radius * np.cos(phi), radius * np.sin(phi)
    return np.stack([-p, -q, np.ones_like(p)], axis=-1).reshape(-1, 3), np.repeat(w / 32, 16)


def body(i, o):
    """Sum over the facets of T T Kd/(π n² (1 − Kd r_i)), as i and o see them."""
    total = np.zeros(len(i))
    for slope, weight in zip(*_facets(), strict=True):
        length = np.sqrt(slope @ slope)
        of_i, of_o = (np.maximum(w @ slope, 0) / length for w in (i, o))
        # A facet's area is ``length`` times what it covers.
        total += weight * length * of_i * of_o * (1 - fresnel(of_i)) * (1 - fresnel(of_o))
    lambertian = KD / (np.pi * N**2 * (1 - KD * R_I))
    return lambertian * total * masking(i, o) / (i[:, 2] * o[:, 2])


def brdf(i, o):
    """Order 1 in sr⁻¹ at unit directions of shape (n, 3): specular and body."""
    return specular(i, o), body(i, o)
