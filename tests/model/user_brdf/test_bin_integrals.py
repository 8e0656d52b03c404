"""Bins of any function, against a closed form and the lobe's own quadrature."""

import numpy as np
import pytest

from microsurf import model
from microsurf.model.single_scattering import brdf
from microsurf.model.single_scattering.specular_bins import specular_bins
from microsurf.model.user_brdf.bin_integrals import integrate
from microsurf.results import detector


def test_a_constant_fills_the_bins_by_their_projected_solid_angle():
    bins, error = integrate(lambda o: np.full((1, len(o)), 1 / np.pi), 0.7, 0.2)
    exact = np.repeat(detector.projected_solid_angles(), detector.SECTORS, axis=1) / np.pi
    np.testing.assert_allclose(bins[0], exact, rtol=1e-12)
    assert error[0] < 1e-9


@pytest.mark.parametrize("gamma", [2.0, 1e9])
@pytest.mark.parametrize("sigma", [1e-4, 0.02])
@pytest.mark.parametrize("theta", [0.0, 85.0])
def test_spikes_come_out_as_from_the_quadrature_that_knows_them(gamma, sigma, theta):
    """`specular_bins` knows the lobe's scale and is good to 1e−7; here nothing is known of it.

    The stated error must cover the real one, up to what the other leaves.
    """
    facets = brdf.Facets(1.5, gamma, sigma, sigma)
    i = model.direction(np.radians(theta), 0.3)

    def lobe(o):
        return brdf.specular(facets, np.broadcast_to(i, o.shape), o)[None]

    bins, error = integrate(lobe, np.radians(theta), 0.3)
    known, _ = specular_bins(facets, np.radians(theta), 0.3)
    off = np.abs(bins[0] - known).sum() / known.sum()
    assert off <= error[0] + 1e-6
    assert off < 1e-4
    assert error[0] < 2e-3


def test_parts_are_integrated_together_but_know_their_own_errors():
    def two(o):
        return np.stack([np.ones(len(o)), np.exp(-1e3 * o[:, 0] ** 2)])

    bins, error = integrate(two, 0.3, 0.0)
    assert bins.shape == (2, detector.RINGS, detector.SECTORS)
    assert error[0] < 1e-6 < error[1] < 1e-3
    # ∫ exp(−a x²) over the projected disc: strips of height 2 √(1 − x²).
    x, w = np.polynomial.legendre.leggauss(400)
    strip = 0.3 * np.sum(w * np.exp(-1e3 * (0.3 * x) ** 2) * 2 * np.sqrt(1 - (0.3 * x) ** 2))
    assert bins[1].sum() == pytest.approx(strip, rel=2e-4)
