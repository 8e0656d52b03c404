import numpy as np
import pytest
from brute import pieces, transmittance

from microsurf.model.single_scattering import flat
from microsurf.results import detector


@pytest.mark.parametrize("n", [1.0, 1.0001, 1.5, 4.0])
def test_body_rings_against_adaptive_quadrature(n):
    escape = pieces(lambda mu: 2 * mu * transmittance(mu, n), [0, 1e-3, 1e-2, 0.1, 1], 1e-13)
    bins = flat.body_bins(np.cos(1.0), n)
    for ring in (0, 20, detector.RINGS - 1):
        low, high = np.cos(np.radians(detector.RING_EDGES[[ring + 1, ring]]))
        inside = pieces(lambda mu: mu * transmittance(mu, n), [low, high], 1e-13)
        expected = transmittance(np.cos(1.0), n) * inside / (np.pi * escape) * np.radians(10)
        # The reference takes 1 − F from F, good to a few 1e−16 of 1, not of T.
        np.testing.assert_allclose(bins[ring], expected, rtol=1e-11)


@pytest.mark.parametrize("n", [1.0, 1.0001, 1.5, 4.0])
@pytest.mark.parametrize("theta", [0.0, 30.0, 60.0, 89.9])
def test_a_white_substrate_loses_nothing(n, theta):
    cosine = np.cos(np.radians(theta))
    total = flat.specular_bins(cosine, n, 0.0).sum() + flat.body_bins(cosine, n).sum()
    assert total == pytest.approx(1, abs=1e-12)


def test_the_specular_part_is_in_the_bin_of_the_mirror_direction():
    bins = flat.specular_bins(np.cos(np.radians(60)), 1.5, 0.0)
    assert np.flatnonzero(bins).tolist() == [30 * detector.SECTORS + detector.SECTORS // 2]
    assert detector.RING_EDGES[30] < 60 < detector.RING_EDGES[31]
