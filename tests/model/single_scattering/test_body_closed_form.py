import brute
import numpy as np
import pytest
from mpmath import mp, mpf

from microsurf.model.directions import direction
from microsurf.model.single_scattering import body_closed_form, brdf
from microsurf.model.single_scattering.facets import Facets
from microsurf.physics import fresnel

# The goals set before it was built: rms relative error of f_b over the hemisphere,
# flux-weighted, and relative error of the albedo, up to a roughness.
GOALS = [(0.5, 0.03, 0.02), (1.0, 0.05, 0.02)]


def weighted(power, rise, gamma, sigma):
    """E[s^rise (1 + s²)^(−power/2)] over STD by mpmath, in ln s²."""

    def integrand(y):
        rho2 = mp.exp(y)
        density = mp.exp(-rho2) if np.isinf(gamma) else (1 + rho2 / (gamma - 1)) ** -mpf(gamma)
        s2 = sigma**2 * rho2
        return density * rho2 * s2 ** (rise / 2) * (1 + s2) ** (-mpf(power) / 2)

    return float(mp.quad(integrand, [-60, -20, -5, 0, 5, 20, 60, 200]))


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("sigma", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("gamma", [1.75, 2.0, 8.0, np.inf])
def test_law_keeps_mass_and_second_moments(gamma, sigma, power):
    parameters = body_closed_form._slope_parameters(gamma, sigma, sigma, power)
    assert parameters.mass == pytest.approx(weighted(power, 0, gamma, sigma), rel=1e-9)
    variance = parameters.scale[0] ** 2 / (
        1 - 2 / parameters.nu
    )  # of a t with ν degrees of freedom
    assert 2 * parameters.mass * variance == pytest.approx(
        weighted(power, 2, gamma, sigma), rel=1e-9
    )


def hemisphere(theta_i, nodes=12):
    """i, half the directions o, and their parts of ∫ cosθ_o dω/π."""
    x, weight = np.polynomial.legendre.leggauss(nodes)
    rise, azimuth = np.meshgrid((1 + x) / 2, np.pi * (1 + x) / 2)
    o = direction(np.arcsin(np.sqrt(rise)), azimuth).reshape(-1, 3)
    i = np.broadcast_to(direction(np.radians(theta_i), 0.0), o.shape)
    return i, o, np.outer(weight, weight).ravel() / 4


def errors(body, facets):
    """Rms error of f_b, and of the albedo, over incidences that share the flux evenly."""
    rms, albedo = [], []
    for theta in np.degrees(np.arcsin(np.sqrt([0.1, 0.3, 0.5, 0.7, 0.9]))):
        i, o, flux = hemisphere(theta)
        exact, value = brdf.body(facets, i, o, 0.5), body(facets, i, o)
        rms.append(np.sum(flux * (value / exact - 1) ** 2))
        albedo.append((np.sum(flux * value) / np.sum(flux * exact) - 1) ** 2)
    return np.sqrt(np.mean(rms)), np.sqrt(np.mean(albedo))


def lambertian_with_interface(facets, i, o):
    """Flat facets: what roughness changes."""
    T = fresnel.transmittance(i[:, 2], facets.n) * fresnel.transmittance(o[:, 2], facets.n)
    return T / (np.pi * fresnel.external_diffuse_transmittance(facets.n))


@pytest.mark.parametrize("n", [1.0, 1.5, 4.0])
@pytest.mark.parametrize("gamma", [2.0, 2.7, 8.0, np.inf])
@pytest.mark.parametrize(("sigma", "rms_goal", "albedo_goal"), GOALS)
def test_error_reaches_the_goal(sigma, rms_goal, albedo_goal, gamma, n):
    facets = Facets(n, gamma, sigma, sigma)
    rms, albedo = errors(body_closed_form.body, facets)
    assert rms < rms_goal
    assert albedo < albedo_goal
    assert errors(lambertian_with_interface, facets)[0] > 2 * rms_goal  # negative control


@pytest.mark.parametrize("n", [1.0, 1.5])
def test_anisotropic_error_reaches_the_goal(n):
    facets = Facets(n, 2.5, 0.2, 0.8)
    turn = np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])
    rms, albedo = errors(body_closed_form.body, facets)
    assert rms < 0.05
    assert albedo < 0.02
    i, o, flux = hemisphere(50)
    exact, value = (body(facets, i @ turn, o @ turn) for body in (brdf.body, body_closed_form.body))
    assert np.sqrt(np.sum(flux * (value / exact - 1) ** 2)) < 0.05


@pytest.mark.parametrize("gamma", [2.5, 8.0, np.inf])
@pytest.mark.parametrize("n", [1.0, 1.5, 100.0])
def test_flat_limit(n, gamma):
    """The first change with σ is about σ² tan²θ (γ−1)/(γ−2), and of T, n² times as large."""
    angles = np.radians([[0, 0, 0], [30, 60, 70], [60, 60, 180], [60, 20, 0]])
    i, o = direction(angles[:, 0], 0.0), direction(angles[:, 1], angles[:, 2])
    facets = Facets(n, gamma, 1e-4, 1e-4)
    value, flat = body_closed_form.body(facets, i, o), lambertian_with_interface(facets, i, o)
    np.testing.assert_allclose(value, flat, rtol=1e-6)


def all_directions():
    theta = np.radians([0, 1e-6, 1, 30, 60, 85, 89, 89.9, 89.99999])
    phi = np.radians([0, 1e-6, 45, 90, 135, 179.9999, 180])
    a, b, p = (v.ravel() for v in np.meshgrid(theta, theta, phi))
    return direction(a, 0.3), direction(b, 0.3 + p)


@pytest.mark.parametrize("n", [1.0, 1 + 1e-9, 1.5, 100.0])
@pytest.mark.parametrize("gamma", [1.501, 2.0, 2.5, 30.0, 1e6, 1e9, np.inf])
def test_finite_positive_and_reciprocal_everywhere(gamma, n):
    i, o = all_directions()
    for sigma_x, sigma_y in [(1e-4, 1e-4), (1e-4, 10), (0.1, 0.3), (1, 1), (10, 10)]:
        facets = Facets(n, gamma, sigma_x, sigma_y)
        value = body_closed_form.body(facets, i, o)
        assert np.all(np.isfinite(value))
        assert np.all(value >= 0)
        np.testing.assert_allclose(value, body_closed_form.body(facets, o, i), rtol=1e-12)


@pytest.mark.parametrize("at", [0, 1, 2, 3])
def test_smooth_in_every_parameter(at):
    """Two steps of a central difference differ by their truncation, of the order h²."""
    i, o, _ = hemisphere(55)
    start = np.array([1.5, 2.0, 0.4, 0.3])

    def slope(h):
        step = np.zeros(4)
        step[at] = h
        high, low = (body_closed_form.body(Facets(*(start + s)), i, o) for s in (step, -step))
        return (high - low) / (2 * h)

    coarse, fine = slope(2e-4), slope(1e-4)
    np.testing.assert_allclose(coarse, fine, atol=1e-5 * np.abs(fine).max())


def test_exchanging_the_axes_turns_an_anisotropic_lobe_by_90_degrees():
    i, o = (np.array([brute.direction(60, 20), brute.direction(40, 70)])[[k]] for k in (0, 1))
    value = body_closed_form.body(Facets(1.5, 2.0, 0.2, 0.7), i, o)
    swapped = body_closed_form.body(Facets(1.5, 2.0, 0.7, 0.2), i[:, [1, 0, 2]], o[:, [1, 0, 2]])
    np.testing.assert_allclose(value, swapped, rtol=1e-12)
