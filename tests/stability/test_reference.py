"""The 50-digit laws themselves: against their definitions, by quadrature."""

import numpy as np
import pytest

from microsurf.stability import reference
from microsurf.stability.reference import EXACT, real


@pytest.mark.parametrize("gamma", [1.501, 8.0, 1e9, np.inf])
@pytest.mark.parametrize("x", [0.01, 12.0])
def test_lambda_is_its_definition(gamma, x):
    """(1/x) ∫_x^∞ (p − x) t_ν(p) dp, in p = x + e^y; 25 digits, 20 hold."""
    nu, x = real(2 * gamma - 2), real(x)

    def density(p):
        constant = reference.student_constant(nu)
        if EXACT.isinf(nu):
            return constant * EXACT.exp(-(p**2) / 2)
        return constant * (1 + p**2 / nu) ** (-(nu + 1) / 2)

    unit = density(x)
    # The tail falls as e^(−(ν−1)y): 60 digits of e at ν − 1 = 1.
    top = 5 if gamma > 30 else 8 + 60 / min(float(nu) - 1, 20)
    edges = [real(y) for y in (*np.linspace(-60, 10, 40), *np.linspace(10, top, 30)[1:])]
    edges = [y for y in edges if y <= top]
    with EXACT.workdps(25):
        found = EXACT.quad(lambda y: EXACT.exp(2 * y) * density(x + EXACT.exp(y)) / unit, edges)
    exact = reference.lambda_of_x(x, nu)
    assert abs(found * unit / x / exact - 1) < 1e-18


@pytest.mark.parametrize("gamma", [1.6, 1e6, np.inf])
@pytest.mark.parametrize(("sigma", "rho"), [(0.02, 2.0), (10.0, 3.0)])
def test_area_beyond_is_its_integral(gamma, sigma, rho):
    """∫ √(1+σ²ρ²) over the probability 1 − F = e^(−s), from the slope on."""
    gamma, sigma = real(gamma), real(sigma)

    def area(rho):
        start = rho**2 if EXACT.isinf(gamma) else (gamma - 1) * EXACT.log(1 + rho**2 / (gamma - 1))

        def integrand(s):
            u2 = s if EXACT.isinf(gamma) else (gamma - 1) * EXACT.expm1(s / (gamma - 1))
            return EXACT.sqrt(1 + sigma**2 * u2) * EXACT.exp(-s)

        # e^(−s(1 − 1/(2a))) is left of it far out; a = γ − 1.
        end = 60 if EXACT.isinf(gamma) else 60 / (1 - 0.5 / (gamma - 1))
        edges = [start + end * k**3 for k in EXACT.linspace(0, 1, 24)]
        return EXACT.quad(integrand, edges)

    with EXACT.workdps(25):
        assert abs(area(real(0)) / reference.mean_area(gamma, sigma) - 1) < 1e-16
        share = area(real(rho)) / area(real(0))
    assert abs(share / reference.area_beyond(gamma, sigma, sigma * real(rho)) - 1) < 1e-16


def test_series_and_hypergeometric_function_agree():
    for c, z in ((31.0, 0.999), (100.0, -0.3), (1e6, 0.5)):
        exact = EXACT.hyp2f1(-EXACT.mpf("0.5"), 1, real(c), real(z))
        assert abs(reference._series(real(c), real(z)) / exact - 1) < 1e-70


def test_slopes_by_their_definition():
    """D integrates to 1 over projected area; the CDF is the integral of the density."""
    gamma, sigma, r = real(2.5), real(0.5), real(0.7)
    with EXACT.workdps(25):
        inside = EXACT.quad(
            lambda s: 2 * EXACT.pi * s * reference.slope_density(gamma, sigma, sigma, s, 0), [0, r]
        )
    assert abs(inside / reference.slope_cdf(gamma, sigma, r) - 1) < 1e-20
    u = reference.slope_cdf(gamma, sigma, r)
    assert abs(reference.slope_quantile(gamma, sigma, u) / r - 1) < 1e-60
    mz = 1 / EXACT.sqrt(1 + r**2)
    tilted = reference.distribution(gamma, sigma, sigma, r * mz, 0, mz) * mz**4
    assert abs(tilted / reference.slope_density(gamma, sigma, sigma, r, 0) - 1) < 1e-60


def test_duntley_is_the_average_of_fresnel():
    n = real(1.5)
    with EXACT.workdps(25):
        brewster = 1 / EXACT.sqrt(n**2 + 1)
        average = EXACT.quad(
            lambda mu: 2 * mu * reference.reflectance(mu, n), [0, brewster / 2, brewster, 1]
        )
    assert abs(average / reference.external_reflectance(n) - 1) < 1e-15
    assert reference.transmittance(real(0.3), real(1)) == 1
    whole = reference.albedo(real(0.3), n, real(1))
    assert abs(whole - 1) < 1e-70
