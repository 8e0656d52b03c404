"""Expectations over the facets that two directions see, against 50-digit quadrature."""

import numpy as np
import pytest
from mpmath import mp, mpf

from microsurf.model.single_scattering import seen_by_both


def student(u, nu):
    """Density of Student's t, of the normal law at ν = ∞."""
    if mp.isinf(nu):
        return mp.exp(-(u**2) / 2) / mp.sqrt(2 * mp.pi)
    height = mp.gamma((nu + 1) / 2) / (mp.sqrt(nu * mp.pi) * mp.gamma(nu / 2))
    return height * (1 + u**2 / nu) ** (-(nu + 1) / 2)


@pytest.mark.parametrize("c", [-3.0, -0.2, 0.7, 4.0])
@pytest.mark.parametrize("nu", [3.5, 5.0, 40.0, np.inf])
def test_partial_moments_against_mpmath(nu, c):
    found = seen_by_both.partial_moments(np.array([c]), nu, 3)
    for k, value in enumerate(found):
        exact = mp.quad(lambda u, k=k: u**k * student(u, nu), [-mp.inf, -10, -1, c])
        # Each step k − 2 → k adds rounding of terms no larger than 10, over ν − k ≥ 0.5.
        assert value[0] == pytest.approx(float(exact), abs=1e-13)


def in_one_plane(a, b, side, nu):
    """E[(1 − a u)₊ (1 ∓ b u)₊] by mpmath."""
    low = -mp.inf if side > 0 else -1 / mpf(b)
    high = 1 / mpf(max(a, b)) if side > 0 else 1 / mpf(a)
    cuts = [low, -5, -1, high] if side > 0 else [low, 0, high]
    return float(mp.quad(lambda u: (1 - a * u) * (1 - side * b * u) * student(u, nu), cuts))


@pytest.mark.parametrize("nu", [2.5, 6.0, np.inf])
@pytest.mark.parametrize(("a", "b"), [(0.3, 0.3), (0.5, 3.0), (20.0, 4.0)])
def test_expectation_in_one_plane_is_exact(a, b, nu):
    pair = seen_by_both.pair_of(np.array([a]), np.array([b]), nu, 2)
    minus, _, plus = seen_by_both.expectations(pair)[:, 0]
    assert plus == pytest.approx(in_one_plane(a, b, 1, nu), rel=1e-10)
    # Kept above 1e−10 of the other.
    assert minus == pytest.approx(in_one_plane(a, b, -1, nu) + 1e-10 * plus, rel=1e-8)


@pytest.mark.parametrize(("a", "b"), [(2.0, 0.0), (2.0, 1e6)])
def test_expectation_across_is_exact_where_it_says(a, b):
    """E[(1 − a u)₊ (1 − b v)₊] for uncorrelated u and v, ν = 4, v given u by closed form.

    What is left out at b → ∞ is of the relative order b⁻².
    """
    nu = mpf(4)

    def given(u):
        width = mp.sqrt((nu + u**2) / (nu + 1)) * b
        height = student(0, nu + 1) * (nu + 1) / nu
        if width == 0:
            return mpf(1)
        c = 1 / width
        z = (nu + 1) / (nu + 1 + c**2)
        below = 1 - mp.betainc((nu + 1) / 2, 0.5, 0, z, regularized=True) / 2
        return below + width * height * (1 + c**2 / (nu + 1)) ** (-nu / 2)

    exact = mp.quad(lambda u: (1 - a * u) * student(u, nu) * given(u), [-mp.inf, -3, 0, 1 / a])
    sides = (seen_by_both.side_of(np.array([steepness]), 4.0, 2) for steepness in (a, b))
    value = seen_by_both.joined(*sides, 4.0, 1)[0]
    assert value == pytest.approx(float(exact), rel=1e-9)
