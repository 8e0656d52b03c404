import brute
import numpy as np
import pytest

from microsurf.model import MODELS
from microsurf.model.single_scattering import brdf
from microsurf.model.single_scattering.facets import Facets
from microsurf.model.single_scattering.specular_bins import specular_bins
from microsurf.physics import fresnel
from microsurf.results import detector

MASKINGS = ("approximate", "smith", "smith-separable", "vcavity")


def ring_by_one_rule(facets, theta_i, ring, sector):
    """One bin by a midpoint rule of 1000² in (θ_o, Δ)."""
    k = (np.arange(1000) + 0.5) / 1000
    theta = np.radians(detector.RING_EDGES[ring] + 2 * k)[:, None]
    delta = np.radians(detector.SECTOR_EDGES[sector] + 10 * k)
    o = np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.cos(delta), np.sin(theta) * np.sin(delta), np.cos(theta)
        ),
        axis=-1,
    )
    f = brdf.specular(facets, brute.direction(np.degrees(theta_i), 0), o)
    return np.mean(f * np.cos(theta) * np.sin(theta)) * np.radians(2) * np.radians(10)


@pytest.mark.parametrize("masking", MASKINGS)
@pytest.mark.parametrize("bin_", [(15, 18), (30, 18), (30, 3), (44, 16)])
def test_a_bin_against_a_midpoint_rule(masking, bin_):
    """The rule's error, about (scale of the lobe/1000)², is below 1e−6; at a kink as well."""
    facets = Facets(1.5, 2.0, 0.3, 0.3, MODELS[masking].masking)
    bins, _ = specular_bins(facets, np.radians(60), 0.0)
    expected = ring_by_one_rule(facets, np.radians(60), *bin_)
    assert bins[bin_] == pytest.approx(expected, rel=3e-6)


@pytest.mark.parametrize("theta", [0.0, 40.0, 70.0])
@pytest.mark.parametrize("sigma", [0.001, 0.02])
@pytest.mark.parametrize("masking", MASKINGS)
def test_a_narrow_lobe_is_captured(theta, sigma, masking):
    """Beckmann: Σ bins = ∫ F G ⟨i·m⟩ D dm/i_z over a grid of slopes, without any bin.

    Within |slope| < 6.5 σ no facet turns away and G of V-cavities is 1; the
    trapezoid in azimuth and Gauss–Legendre in ρ hold 1e−10.
    """
    facets = Facets(1.5, np.inf, sigma, sigma, MODELS[masking].masking)
    i = brute.direction(theta, 0)
    x, w = np.polynomial.legendre.leggauss(60)
    rho, weights = 3.25 * (x + 1), 3.25 * w
    alpha = np.arange(64) * 2 * np.pi / 64
    p, q = sigma * rho[:, None] * np.cos(alpha), sigma * rho[:, None] * np.sin(alpha)
    m = np.stack([-p, -q, np.ones_like(p)], axis=-1)
    length = np.linalg.norm(m, axis=-1)
    i_s = m @ i
    o = 2 * (i_s / length**2)[..., None] * m - i
    visible = facets.g2(np.broadcast_to(i, o.shape), o)
    values = fresnel.reflectance(i_s / length, 1.5) * visible * i_s / i[2]
    expected = np.sum(values.mean(axis=1) * weights * 2 * rho * np.exp(-(rho**2)))
    bins, error = specular_bins(facets, np.radians(theta), 0.0)
    # Beyond 6.5 lies e^(−42) of the slopes.
    assert bins.sum() == pytest.approx(expected, rel=2e-7)
    assert error < 1e-6


def test_at_sigma_0_001_the_lobe_is_in_one_bin_and_holds_the_fresnel_reflectance():
    bins, _ = specular_bins(Facets(1.5, 8.0, 0.001, 0.001), np.radians(60), 0.0)
    ring = detector.ring_of(60.0)
    assert bins[ring, 18] == pytest.approx(fresnel.reflectance(0.5, 1.5), rel=1e-4)
    assert bins.argmax() == ring * detector.SECTORS + 18


@pytest.mark.parametrize("masking", MASKINGS)
def test_isotropic_as_a_limit_of_anisotropic(masking):
    """σ_y one rounding off runs the whole circle without the symmetry."""
    isotropic, _ = specular_bins(
        Facets(1.5, 1.75, 0.5, 0.5, MODELS[masking].masking), np.radians(70), 0.0
    )
    turned, _ = specular_bins(
        Facets(1.5, 1.75, 0.5, np.nextafter(0.5, 1), MODELS[masking].masking), np.radians(70), 1.0
    )
    np.testing.assert_allclose(turned, isotropic, rtol=1e-6)
    np.testing.assert_allclose(isotropic[:, 1:18], isotropic[:, :18:-1], rtol=1e-12)


@pytest.mark.parametrize("gamma", [1.505, 2.0, 1e6])
@pytest.mark.parametrize("sigma", [(0.001, 0.001), (5.0, 5.0), (0.05, 0.5)])
@pytest.mark.parametrize("theta", [0.0, 80.0, 89.9])
def test_grazing_heavy_narrow_and_wide(gamma, sigma, theta):
    bins, error = specular_bins(Facets(1.5, gamma, *sigma), np.radians(theta), 0.3)
    assert error < 1e-6
    assert np.all(bins >= 0)
    assert 0 < bins.sum() < 1
