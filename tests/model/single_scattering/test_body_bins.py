import numpy as np
import pytest

from microsurf.model import MODELS
from microsurf.model.directions import direction
from microsurf.model.single_scattering import brdf, flat
from microsurf.model.single_scattering.body_bins import body_bins
from microsurf.model.single_scattering.facets import Facets
from microsurf.results import detector

MASKINGS = ("approximate", "smith", "smith-separable", "vcavity")


def albedo(facets, theta_i, phi_i):
    """Body albedo without bins: Gauss–Legendre in o_z on both sides of θ_i and in Δ."""
    x, w = np.polynomial.legendre.leggauss(24)
    total = 0.0
    for low, high in ((0, np.cos(theta_i)), (np.cos(theta_i), 1)):
        mu = (low + (high - low) * (1 + x) / 2)[:, None]
        for start in (0, np.pi):
            o = direction(np.arccos(mu), phi_i + start + np.pi / 2 * (1 + x))
            i = np.broadcast_to(direction(theta_i, phi_i), o.shape)
            f = brdf.body(facets, i.reshape(-1, 3), o.reshape(-1, 3)).reshape(24, 24)
            total += w @ (f * mu) @ w * (high - low) / 2 * np.pi / 2
    return total


@pytest.mark.parametrize(("masking", "sigma"), [("smith", (0.5, 0.5)), ("smith", (0.3, 0.5)),
                                                ("vcavity", (0.5, 0.5))])  # fmt: skip
def test_bins_sum_to_the_albedo_integrated_without_them(masking, sigma):
    facets = Facets(1.5, 2.0, *sigma, MODELS[masking].masking)
    bins, error = body_bins(facets, np.radians(40), 0.4)
    expected = albedo(facets, np.radians(40), 0.4)
    assert bins.sum() == pytest.approx(expected, rel=1e-7)
    assert abs(bins.sum() / expected - 1) < error < 1e-4


@pytest.mark.parametrize("bin_", [(0, 4), (15, 18), (20, 0), (44, 9)])
def test_a_bin_against_its_own_gauss_rule(bin_):
    facets = Facets(1.5, 2.0, 0.5, 0.5, MODELS["smith"].masking)
    bins, _ = body_bins(facets, np.radians(40), 0.0)
    x, w = np.polynomial.legendre.leggauss(5)
    low, high = np.radians(detector.RING_EDGES[[bin_[0], bin_[0] + 1]])
    theta = (low + high) / 2 + (high - low) / 2 * x[:, None]
    delta = np.radians(10 * bin_[1] + 5 * x)
    o = direction(theta, delta)
    i = np.broadcast_to(direction(np.radians(40), 0.0), o.shape)
    f = brdf.body(facets, i.reshape(-1, 3), o.reshape(-1, 3)).reshape(5, 5)
    density = f * np.cos(theta) * np.sin(theta)
    expected = w @ density @ w * (high - low) / 2 * np.radians(5)
    assert bins[bin_] == pytest.approx(expected, rel=2e-6)


def test_refinement_changes_no_bin_by_more_than_1e_6():
    facets = Facets(1.5, 2.0, 0.5, 0.5, MODELS["smith"].masking)
    once, _ = body_bins(facets, np.radians(60), 0.0)
    twice, _ = body_bins(facets, np.radians(60), 0.0, refinement=2)
    np.testing.assert_allclose(once, twice, rtol=1e-6)


@pytest.mark.parametrize("masking", MASKINGS)
def test_small_roughness_approaches_the_flat_interface(masking):
    """Slopes of 1e−3 change cosines by 1e−3 relative to their distance from grazing."""
    bins, _ = body_bins(Facets(1.5, 8.0, 1e-3, 1e-3, MODELS[masking].masking), np.radians(50), 0.0)
    plane = flat.body_bins(np.cos(np.radians(50)), 1.5)
    np.testing.assert_allclose(bins[:40], plane[:40], rtol=1e-4)
    assert bins.sum() == pytest.approx(plane.sum(), rel=1e-4)


def test_isotropic_as_a_limit_of_anisotropic():
    isotropic, _ = body_bins(Facets(1.5, 2.0, 0.5, 0.5), np.radians(50), 0.0)
    turned, _ = body_bins(Facets(1.5, 2.0, 0.5, np.nextafter(0.5, 1)), np.radians(50), 1.0)
    np.testing.assert_allclose(turned, isotropic, rtol=2e-6)
    np.testing.assert_allclose(isotropic[:, 1:18], isotropic[:, :18:-1], rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("masking", ["smith", "vcavity"])
@pytest.mark.parametrize(("gamma", "sigma"), [(1.505, 0.001), (1.75, 0.7), (np.inf, 0.05), (2, 5)])
@pytest.mark.parametrize("theta", [0.0, 60.0, 80.0, 89.9])
def test_refinement_at_the_edges(masking, gamma, sigma, theta):
    """Albedos to 1e−7; bins to 1e−5 of their ring's mean: some at grazing hold little."""
    facets = Facets(1.5, gamma, sigma, sigma, MODELS[masking].masking)
    once, error = body_bins(facets, np.radians(theta), 0.0)
    fine, _ = body_bins(facets, np.radians(theta), 0.0, refinement=1.5)
    assert once.sum() == pytest.approx(fine.sum(), rel=1e-7)
    assert np.all(np.abs(once - fine) < 1e-5 * fine.mean(axis=1, keepdims=True))
    assert error < 1e-4
