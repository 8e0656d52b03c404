import brute
import numpy as np
import pytest
from mpmath import mp, mpf

from microsurf.model.single_scattering.body_quadrature import body_integral

# (θ_i, θ_o, φ_o − φ_i, φ_i), γ, (σ_x, σ_y), n: in and out of the plane of incidence,
# heavy and Gaussian tails, with and without interface, isotropic and not.
CASES = [
    ((0, 45, 0, 0), 2.0, (0.5, 0.5), 1.5),
    ((60, 30, 180, 0), 2.0, (0.5, 0.5), 1.5),
    ((60, 30, 0, 0), 1.75, (0.5, 0.5), 1.5),
    ((60, 40, 100, 0), 1.6, (0.5, 0.5), 1.5),
    ((80, 70, 30, 0), 8.0, (0.7, 0.7), 1.0),
    ((50, 20, 70, 25), 1.75, (0.2, 0.8), 1.5),
    ((30, 60, 120, 10), np.inf, (0.3, 0.3), 1.5),
    ((40, 40, 0, 0), 3.0, (0.4, 0.4), 1.0),
]

# Each alone at the edge of what is promised; pairs in, near and out of the plane.
HARD = [
    (1.505, (0.001, 0.001), 1.5),
    (1.505, (0.5, 0.5), 1.0),
    (2.0, (5.0, 5.0), 1.5),
    (1e6, (0.05, 0.05), 1.0),
    (np.inf, (0.5, 0.5), 1.5),
    (1.75, (0.1, 0.6), 1.5),
]


def pair(angles):
    theta_i, theta_o, delta, phi_i = angles
    return brute.direction(theta_i, phi_i), brute.direction(theta_o, phi_i + delta)


def integral(i, o, gamma, sigma, n, **how):
    return body_integral(np.atleast_2d(i), np.atleast_2d(o), gamma, *sigma, n, **how)


@pytest.mark.parametrize("vcavity", [False, True])
@pytest.mark.parametrize(("angles", "gamma", "sigma", "n"), CASES)
def test_against_adaptive_quadrature_in_cartesian_slopes(angles, gamma, sigma, n, vcavity):
    """The reference asks for 1e−9; the sum of its pieces is allowed 1e−8."""
    i, o = pair(angles)
    reference = brute.body_integral(i, o, gamma, *sigma, n, vcavity=vcavity)
    assert integral(i, o, gamma, sigma, n, vcavity=vcavity)[0] == pytest.approx(reference, rel=1e-8)


@pytest.mark.parametrize("gamma", [1.505, 1.6, 2.0, 8.0, 1e6])
@pytest.mark.parametrize("sigma", [0.001, 0.5, 5.0])
def test_at_normal_incidence_against_mpmath(gamma, sigma):
    """i = o = n, n = 1: I = ∫ (1 + σ²ρ²)^(−1/2) dF(ρ), with s = 1 − F one integral on 0 … 1."""
    mp.dps = 30
    g, s2 = mpf(gamma), mpf(sigma) ** 2

    def integrand(x):  # 1 − F = e^(−x)
        return mp.exp(-x) / mp.sqrt(1 + s2 * (g - 1) * mp.expm1(x / (g - 1)))

    reference = mp.quad(integrand, [0, 1e-6, 1e-3, 0.1, 1, 5, 20, 60, mp.inf])
    up = brute.direction(0, 0)
    assert integral(up, up, gamma, (sigma, sigma), 1.0)[0] == pytest.approx(
        float(reference), rel=1e-8
    )


def hard_pairs():
    angles = [
        (theta_i, theta_o, delta, 0)
        for theta_i in (0, 45, 89.9)
        for theta_o in (1, 60.3, 89.7)
        for delta in (0, 0.5, 90, 175, 180)
    ]
    both = [pair(a) for a in angles]
    return np.array([i for i, _ in both]), np.array([o for _, o in both])


@pytest.mark.parametrize("vcavity", [False, True])
@pytest.mark.parametrize(("gamma", "sigma", "n"), HARD)
def test_doubling_every_number_of_nodes_changes_less_than_1e_6(gamma, sigma, n, vcavity):
    i, o = hard_pairs()
    once = integral(i, o, gamma, sigma, n, vcavity=vcavity)
    twice = integral(i, o, gamma, sigma, n, vcavity=vcavity, refinement=2)
    np.testing.assert_allclose(once, twice, rtol=1e-6)


@pytest.mark.parametrize("vcavity", [False, True])
@pytest.mark.parametrize(("gamma", "sigma", "n"), HARD)
def test_reciprocity(gamma, sigma, n, vcavity):
    i, o = hard_pairs()
    there = integral(i, o, gamma, sigma, n, vcavity=vcavity)
    back = integral(o, i, gamma, sigma, n, vcavity=vcavity)
    np.testing.assert_allclose(there, back, rtol=1e-6)


def test_half_the_nodes_would_not_do():
    """Negative control: the comparison above sees a rule that is too coarse."""
    i, o = hard_pairs()
    coarse = integral(i, o, 1.505, (0.001, 0.001), 1.5, refinement=0.5)
    fine = integral(i, o, 1.505, (0.001, 0.001), 1.5, refinement=2)
    assert np.max(np.abs(coarse / fine - 1)) > 1e-6
