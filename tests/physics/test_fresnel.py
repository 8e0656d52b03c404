"""Fresnel's equations and their diffuse averages against mpmath and published figures."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from microsurf.physics import fresnel, metals

EPS = np.finfo(float).eps
INDICES = (1 + 1e-12, 1 + 1e-9, 1 + 1e-5, 1.0003, 1.33, 1.5, 2.0, 2.4, 4.0, 10.0, 100.0)
COSINES = (1e-9, 1e-6, 1e-3, 0.01, 0.1, 0.3, 0.5547, 0.7, 0.9, 0.999, 1.0)

mp.mp.dps = 60


def textbook(mu, n):
    """Fresnel reflectance from the amplitude ratios with Snell's cosine (Born & Wolf, 1.5.2)."""
    mu, n = mp.mpf(mu), mp.mpf(n)
    inside = mp.sqrt(1 - (1 - mu**2) / n**2)
    r_s = (mu - n * inside) / (mu + n * inside)
    r_p = (n * mu - inside) / (n * mu + inside)
    return (r_s**2 + r_p**2) / 2


def metal_textbook(mu, n, k):
    """The same with a complex index, and 60 digits to lose."""
    mu, eta = mp.mpf(mu), mp.mpc(n, k)
    inside = mp.sqrt(1 - (1 - mu**2) / eta**2)
    r_s = (mu - eta * inside) / (mu + eta * inside)
    r_p = (eta * mu - inside) / (eta * mu + inside)
    return (abs(r_s) ** 2 + abs(r_p) ** 2) / 2


def duntley(n):
    """Return r_e in closed form (Duntley 1942)."""
    n = mp.mpf(n)
    return (
        mp.mpf(1) / 2
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * mp.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * mp.log(n)
    )


@pytest.mark.parametrize("n", INDICES)
def test_reflectance_and_transmittance_are_exact_to_rounding(n):
    for mu in COSINES:
        exact = textbook(mu, n)
        # About ten roundings, none of them of a difference that cancels: near Brewster's
        # angle r_p cancels, but there r_s is the larger part of F.
        assert float(abs(fresnel.reflectance(mu, n) / exact - 1)) <= 12 * EPS, mu
        assert float(abs(fresnel.transmittance(mu, n) / (1 - exact) - 1)) <= 12 * EPS, mu


def test_known_points():
    np.testing.assert_allclose(fresnel.reflectance(1.0, 1.5), 0.04, rtol=4 * EPS)
    # At Brewster's angle F is half of r_s² = ((n²−1)/(n²+1))².
    n = 1.5
    brewster = 1 / np.sqrt(n**2 + 1)
    expected = ((n**2 - 1) / (n**2 + 1)) ** 2 / 2
    assert float(fresnel.reflectance(brewster, n)) == pytest.approx(expected, rel=8 * EPS)
    assert float(fresnel.reflectance(0.0, 1.5)) == pytest.approx(1, abs=4 * EPS)
    assert fresnel.transmittance(0.0, 1.5) == 0


@pytest.mark.parametrize("n", [1e-3, 0.21, 0.9999, 1.0, 1.5, 7.4, 100.0])
@pytest.mark.parametrize("k", [1e-9, 1e-3, 0.3, 1.0, 3.272, 100.0])
def test_conductors_are_exact_to_rounding(n, k):
    for mu in COSINES:
        exact = metal_textbook(mu, n, k)
        # n² − 1 − k² + μ² cancels where n < 1 reflects totally, at μ² = 1 + k² − n²: there
        # g, and with it T, has the digits of its conditioning and no more.
        real, imaginary = (n - 1) * (n + 1) - k**2 + mu**2, 2 * n * k
        condition = 1 + (n**2 + k**2 + 1 + mu**2) / np.hypot(real, imaginary)
        allowed = 16 * EPS * condition
        assert float(abs(fresnel.transmittance(mu, n, k) / (1 - exact) - 1)) <= allowed, mu
        # F where it is small carries the error of r_p's zero; T's bound is absolute there.
        off = float(abs(fresnel.reflectance(mu, n, k) - exact))
        assert off <= allowed * float(min(1, exact + abs(1 - exact))), mu


@pytest.mark.parametrize("k", [0.02, 0.5, 6.0])
@pytest.mark.parametrize("n", [0.05, 1.0, 3.0])
def test_derivatives_of_conductors(n, k):
    for mu in (1e-3, 0.3, 0.99, 1.0):
        found = fresnel.conductor_derivatives(mu, n, k)
        exact = [
            mp.diff(lambda x, mu=mu: metal_textbook(mu, x, k), n),
            mp.diff(lambda x, mu=mu: metal_textbook(mu, n, x), k),
        ]
        scale = max(abs(float(e)) for e in exact)
        assert [float(x) for x in found] == pytest.approx(list(map(float, exact)), abs=1e-9 * scale)


def test_a_conductor_of_small_index_keeps_its_digits_at_normal_incidence():
    """g has 10 digits there, in r_s and r_p one by one, but F is even in the angle."""
    for n, k in ((1e-3, 1e-6), (1e-3, 1e-9), (0.01, 1e-4)):
        for mu in (1.0, 1 - 1e-10):
            exact = metal_textbook(mu, n, k)
            # Both 1 − F and what is left of it have a few roundings, F is above 1/2.
            assert float(abs(fresnel.reflectance(mu, n, k) / exact - 1)) <= 16 * EPS


def test_a_conductor_of_no_extinction_is_the_dielectric():
    mu = np.linspace(0.01, 1, 50)
    for n in (1.33, 1.5, 4.0):
        metal, glass = fresnel.reflectance(mu, n, 1e-12), fresnel.reflectance(mu, n)
        np.testing.assert_allclose(metal, glass, atol=1e-11)
    with pytest.raises(ValueError, match=r"\(n, k\) = \(0.0, 1.0\): must be > 0, both"):
        fresnel.reflectance(0.5, 0.0, 1.0)


def test_metals_at_normal_incidence():
    """((n−1)² + k²)/((n+1)² + k²), and published reflectances: aluminium 0.91 in the visible."""
    for name, indices in metals.METALS.items():
        for index in indices:
            n, k = index.n, index.k
            expected = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
            assert float(fresnel.reflectance(1.0, n, k)) == pytest.approx(expected, rel=1e-14)
            if name == "aluminium":
                assert expected == pytest.approx(0.915, abs=0.01)
    red = [float(fresnel.reflectance(1.0, m[-1].n, m[-1].k)) for m in metals.METALS.values()]
    blue = [float(fresnel.reflectance(1.0, m[0].n, m[0].k)) for m in metals.METALS.values()]
    assert red[0] > 0.92  # gold is yellow …
    assert blue[0] < 0.45
    assert red[1] > 0.88  # … and copper red
    assert blue[1] < 0.6


def test_without_an_interface_nothing_is_reflected():
    mu = np.array([0.0, 1e-9, 0.5, 1.0])
    np.testing.assert_array_equal(fresnel.reflectance(mu, 1), 0)
    np.testing.assert_array_equal(fresnel.transmittance(mu, 1), 1)
    assert fresnel.external_diffuse_reflectance(1) == 0
    assert fresnel.external_diffuse_transmittance(1) == 1
    assert fresnel.internal_diffuse_reflectance(1) == 0


def test_transmittance_is_largest_at_normal_incidence_only_up_to_2_plus_root_3():
    """F(μ) first falls away from the normal for larger n: a sampler may not rely on T(1)."""
    mu = np.linspace(0, 1, 10_001)
    border = 2 + np.sqrt(3)
    for n in (1.1, 1.5, 2.4, border - 1e-3):
        assert np.argmax(fresnel.transmittance(mu, n)) == 10_000
    for n in (border + 1e-3, 4.0, 100.0):
        assert np.argmax(fresnel.transmittance(mu, n)) < 10_000


def test_duntleys_form_is_the_integral():
    """The oracle of the next test, itself checked on the definition."""
    with mp.workdps(30):
        for n in (1.01, 1.5, 10.0):
            brewster = 1 / mp.sqrt(mp.mpf(n) ** 2 + 1)
            edges = [0, brewster / 2, brewster, 1]
            integral = mp.quad(lambda mu, n=n: 2 * mu * textbook(mu, n), edges)
            assert abs(integral - duntley(n)) < 1e-18


@pytest.mark.parametrize("n", [*INDICES, 1e3, 1e4])
def test_diffuse_averages(n):
    exact = duntley(n)
    inside = 1 - (1 - exact) / mp.mpf(n) ** 2
    # 12 ε of the integrand and as much for 600 weighted nodes.
    for value, target in (
        (fresnel.external_diffuse_reflectance(n), exact),
        (fresnel.external_diffuse_transmittance(n), 1 - exact),
        (fresnel.internal_diffuse_reflectance(n), inside),
    ):
        assert float(abs(value / target - 1)) <= 24 * EPS


def test_published_figures():
    assert float(fresnel.external_diffuse_reflectance(1.5)) == pytest.approx(0.091778, abs=5e-7)
    assert float(fresnel.internal_diffuse_reflectance(1.5)) == pytest.approx(0.596346, abs=5e-7)
    # Leading order of both as n → 1.
    n = 1 + 2.0**-30
    assert float(fresnel.external_diffuse_reflectance(n)) == pytest.approx(2**-30 / 3, rel=1e-7)


def test_arrays_broadcast():
    mu, n = np.linspace(0.1, 1, 4)[:, None], np.array([1.0, 1.5, 3.0])
    assert fresnel.reflectance(mu, n).shape == (4, 3)
    for average in (
        fresnel.external_diffuse_reflectance,
        fresnel.external_diffuse_transmittance,
        fresnel.internal_diffuse_reflectance,
    ):
        many = average(n.reshape(3, 1))
        assert many.shape == (3, 1)
        np.testing.assert_allclose(many.ravel(), [average(v) for v in n], rtol=2 * EPS)


@given(st.floats(0, 1), st.floats(1, 100))
def test_nothing_is_lost_in_the_whole_box(mu, n):
    reflected, transmitted = fresnel.reflectance(mu, n), fresnel.transmittance(mu, n)
    assert 0 <= reflected <= 1 + 12 * EPS
    assert 0 <= transmitted <= 1 + 12 * EPS
    assert abs(reflected + transmitted - 1) <= 12 * EPS


@given(st.floats(1, 100))
def test_averages_are_fractions(n):
    outside = fresnel.external_diffuse_reflectance(n)
    assert 0 <= outside < 1
    assert 0 <= fresnel.internal_diffuse_reflectance(n) < 1
    assert abs(outside + fresnel.external_diffuse_transmittance(n) - 1) <= 24 * EPS


@pytest.mark.parametrize("n", [0.99, -1.5, np.nan])
def test_an_index_below_one_is_refused(n):
    for call in (
        lambda: fresnel.reflectance(0.5, n),
        lambda: fresnel.transmittance(0.5, [1.5, n]),
        lambda: fresnel.internal_diffuse_reflectance(n),
        lambda: fresnel.external_diffuse_reflectance(n),
        lambda: fresnel.external_diffuse_transmittance(n),
    ):
        with pytest.raises(ValueError, match=f"n = {n}"):
            call()
