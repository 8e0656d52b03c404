import brute
import numpy as np
import pytest
from mpmath import mp, mpf

from microsurf.model import MODELS
from microsurf.model.single_scattering import brdf
from microsurf.model.single_scattering.facets import Facets

MASKINGS = ("approximate", "smith", "smith-separable", "vcavity")
EXACT = [masking for masking in MASKINGS if masking != "approximate"]
PAIRS = [(20, 35, 150), (60, 60, 180), (75, 40, 20), (85, 88, 170)]


def lobe(angles, phi_i=0.0):
    theta_i, theta_o, delta = angles
    return brute.direction(theta_i, phi_i), brute.direction(theta_o, phi_i + delta)


def smith_lambda(w, gamma, sigma):
    """(1/x) ∫_x^∞ (p − x) t_ν(p) dp by mpmath in ln p, x = √2 cotθ/σ."""
    x = mp.sqrt(2) * w[2] / (sigma * mp.hypot(w[0], w[1]))
    nu = 2 * mpf(gamma) - 2
    height = mp.gamma((nu + 1) / 2) / (mp.sqrt(nu * mp.pi) * mp.gamma(nu / 2))

    def integrand(u):
        p = x * mp.exp(u)
        return (p / x - 1) * height * mp.exp(-(nu + 1) / 2 * mp.log1p(p**2 / nu)) * p

    return mp.quad(integrand, [0, 0.5, 2, 5, 20, 80, mp.inf])


def exact_specular(i, o, n, gamma, sigma, masking):
    """F D G/(4 i_z o_z) from the papers' formulas, all in mpmath."""
    i, o = ([mpf(float(v)) for v in w] for w in (i, o))
    h = [a + b for a, b in zip(i, o, strict=True)]
    length = mp.sqrt(sum(v**2 for v in h))
    h = [v / length for v in h]
    mu = sum(a * b for a, b in zip(i, h, strict=True))
    inside = mp.sqrt(1 - (1 - mu**2) / mpf(n) ** 2)
    F = (
        ((mu - n * inside) / (mu + n * inside)) ** 2 + ((n * mu - inside) / (n * mu + inside)) ** 2
    ) / 2
    g, s = mpf(gamma), mpf(sigma)
    tan2 = (1 - h[2] ** 2) / h[2] ** 2
    D = (g - 1) ** g * s ** (2 * g - 2) / (mp.pi * h[2] ** 4 * ((g - 1) * s**2 + tan2) ** g)
    if masking == "vcavity":
        G = min(1, 2 * h[2] * i[2] / mu, 2 * h[2] * o[2] / mu)
    else:
        at_i, at_o = smith_lambda(i, gamma, s), smith_lambda(o, gamma, s)
        cross = at_i * at_o if masking == "smith-separable" else 0
        G = 1 / (1 + at_i + at_o + cross)
    return float(F * D * G / (4 * i[2] * o[2]))


@pytest.mark.parametrize("masking", MASKINGS)
@pytest.mark.parametrize("gamma", [1.6, 2.0, 8.0])
@pytest.mark.parametrize("angles", PAIRS)
def test_specular_against_mpmath(angles, gamma, masking):
    mp.dps = 30
    i, o = lobe(angles)
    value = brdf.specular(Facets(1.5, gamma, 0.4, 0.4, MODELS[masking].masking), i, o)
    assert value == pytest.approx(exact_specular(i, o, 1.5, gamma, 0.4, masking), rel=1e-11)


@pytest.mark.parametrize("gamma", [1.501, 2.0, 1e4])
@pytest.mark.parametrize("sigma", [1e-4, 10.0])
@pytest.mark.parametrize("n", [1 + 1e-9, 100.0])
@pytest.mark.parametrize("angles", [(89.99999, 89.9999, 179.9), (0.0, 89.99999, 0.0)])
def test_specular_in_the_corners(angles, n, sigma, gamma):
    """Under V-cavities: Smith's Λ has corners and tests of its own, in `physics`.

    1e−12 for each factor e of D; that unit vectors have a length of 1 ± 1e−16 changes i·h
    by 1e−16/(i·h)², and what tan² of h loses D multiplies by γ.
    """
    mp.dps = 50
    i, o = lobe(angles)
    exact = exact_specular(i, o, n, gamma, sigma, "vcavity")
    value = float(brdf.specular(Facets(n, gamma, sigma, sigma, MODELS["vcavity"].masking), i, o))
    if exact < 1e-290:
        assert 0 <= value < 1e-280
        return
    h, mu = (i + o) / np.linalg.norm(i + o), np.linalg.norm(i + o) / 2
    rho2 = (np.hypot(h[0], h[1]) / h[2] / sigma) ** 2
    lost = 1e-15 * (1 / mu**2 + gamma * min(1, rho2) / max(np.hypot(h[0], h[1]), 1e-8))
    assert value == pytest.approx(exact, rel=1e-12 * (1 + abs(np.log(exact))) + lost)


@pytest.mark.parametrize("masking", MASKINGS)
def test_specular_reciprocity(masking):
    facets = Facets(1.5, 1.75, 0.3, 0.8, MODELS[masking].masking)
    i, o = (np.array(w) for w in zip(*(lobe(a, 33.0) for a in PAIRS), strict=True))
    there, back = brdf.specular(facets, i, o), brdf.specular(facets, o, i)
    np.testing.assert_allclose(there, back, rtol=1e-12)


def exact_body(i, o, n, gamma, sigma, masking):
    """Body BRDF at unit weight: QUADPACK for the facets, mpmath for Λ, a sum for r_e."""
    integral = brute.body_integral(i, o, gamma, sigma, sigma, n, vcavity=masking == "vcavity")
    escape = brute.pieces(lambda mu: 2 * mu * brute.transmittance(mu, n), [0, 0.1, 1], 1e-12)
    if masking != "vcavity":
        at_i, at_o = (float(smith_lambda(w, gamma, sigma)) for w in (i, o))
        integral /= 1 + at_i + at_o + (at_i * at_o if masking == "smith-separable" else 0)
    return integral / (np.pi * escape * i[2] * o[2])


@pytest.mark.parametrize("masking", EXACT)
@pytest.mark.parametrize("n", [1.0, 1.5])
def test_body_against_adaptive_quadrature(masking, n):
    i, o = lobe((65, 50, 140))
    value = brdf.body(Facets(n, 1.75, 0.6, 0.6, MODELS[masking].masking), i[None], o[None])[0]
    assert value == pytest.approx(exact_body(i, o, n, 1.75, 0.6, masking), rel=1e-8)


def test_wrong_masking_is_told_apart():
    """Negative control: the references differ between the maskings far beyond the tolerances."""
    mp.dps = 30
    i, o = lobe((65, 50, 140))
    for reference in (exact_specular, exact_body):
        values = [reference(i, o, 1.5, 1.75, 0.6, masking) for masking in EXACT]
        assert min(abs(values[0] / v - 1) for v in values[1:]) > 1e-3


@pytest.mark.parametrize("masking", MASKINGS)
def test_isotropic_lobes_depend_on_the_azimuth_between_the_directions_alone(masking):
    facets = Facets(1.5, 2.0, 0.5, 0.5, MODELS[masking].masking)
    i, o = lobe((60, 40, 50))
    turned_i, turned_o = lobe((60, 40, 50), 77.0)
    _, mirrored = lobe((60, 40, -50))
    for part in (brdf.specular, brdf.body):
        value = part(facets, i[None], o[None])
        np.testing.assert_allclose(part(facets, turned_i[None], turned_o[None]), value, rtol=1e-8)
        np.testing.assert_allclose(part(facets, i[None], mirrored[None]), value, rtol=1e-8)


@pytest.mark.parametrize("masking", MASKINGS)
def test_exchanging_the_axes_turns_an_anisotropic_lobe_by_90_degrees(masking):
    i, o = lobe((60, 40, 50), 20.0)
    swapped_i, swapped_o = i[[1, 0, 2]], o[[1, 0, 2]]
    for part in (brdf.specular, brdf.body):
        value = part(Facets(1.5, 2.0, 0.2, 0.7, MODELS[masking].masking), i[None], o[None])
        swapped = part(
            Facets(1.5, 2.0, 0.7, 0.2, MODELS[masking].masking), swapped_i[None], swapped_o[None]
        )
        np.testing.assert_allclose(value, swapped, rtol=1e-7)
