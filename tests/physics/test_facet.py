"""One interfaced-Lambertian facet: energy by evaluation, and what is sampled."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from microsurf.physics import facet, fresnel
from microsurf.stats import hypothesis_tests

EPS = np.finfo(float).eps
INDICES = (1.0, 1.33, 1.5, 2.4)
ALBEDOS = (0.5, 0.8, 1.0)


def textbook_transmittance(mu, n):
    """Return 1 − F by Snell's cosine and the amplitude ratios."""
    inside = mp.sqrt(1 - (1 - mp.mpf(mu) ** 2) / mp.mpf(n) ** 2)
    r_s = (mu - n * inside) / (mu + n * inside)
    r_p = (n * mu - inside) / (n * mu + inside)
    return 1 - (r_s**2 + r_p**2) / 2


def exact_escape(n):
    """Return 1 − r_i = (1 − r_e)/n² by mpmath's quadrature, split at Brewster's angle."""
    n = mp.mpf(n)
    brewster = 1 / mp.sqrt(n**2 + 1)
    edges = [0, brewster / 8, brewster / 2, brewster, 2 * brewster, 1]
    edges = [mu for mu in edges if mu <= 1]
    return mp.quad(lambda mu: 2 * mu * textbook_transmittance(mu, n), sorted(edges)) / n**2


def fitted_body(cos_i, cos_o, n, kd):
    """Return f_b with a polynomial for r_i (Egan & Hilgeman 1973), as plastic BRDFs use it."""
    inside = -1.4399 / n**2 + 0.7099 / n + 0.6681 + 0.0636 * n
    pair = fresnel.transmittance(cos_i, n) * fresnel.transmittance(cos_o, n)
    return pair * kd / (np.pi * n**2 * (1 - kd * inside))


@pytest.mark.parametrize("n", [1.0, 1 + 1e-9, 1.33, 1.5, 4.0, 100.0])
def test_body_and_its_weight_are_exact_to_rounding(n):
    with mp.workdps(50):  # 1 − T costs 20 of them at n = 1 + 1e−9
        escape = exact_escape(n)
        for kd in (0.0, 1e-9, 0.5, 0.999999, 1.0):
            inside = 1 - escape
            weight = mp.mpf(kd) * escape / (1 - mp.mpf(kd) * inside)
            # 24 ε of the average, of which 1 − Kd r_i is made without a difference.
            assert abs(float(facet.body_weight(n, kd)) - weight) <= 32 * EPS * weight
            for cos_i, cos_o in ((1.0, 1.0), (0.5, 0.01), (1e-6, 0.3)):
                pair = textbook_transmittance(cos_i, n) * textbook_transmittance(cos_o, n)
                exact = pair * kd / (mp.pi * mp.mpf(n) ** 2 * (1 - mp.mpf(kd) * inside))
                assert abs(float(facet.body(cos_i, cos_o, n, kd)) - exact) <= 64 * EPS * exact
                transmitted = textbook_transmittance(cos_i, n)
                albedo = 1 - transmitted + transmitted * weight
                value = float(facet.albedo(cos_i, n, kd))
                assert abs(value - albedo) <= 64 * EPS * albedo


@pytest.mark.parametrize("n", [*INDICES, 10.0])
@pytest.mark.parametrize("kd", ALBEDOS)
def test_albedo_is_reflectance_and_the_integral_of_body(n, kd):
    """∫ f_b cosθ_o do by quadrature in √μ; Fresnel is smooth there beyond a few nodes."""
    x, w = np.polynomial.legendre.leggauss(200)
    s, w = (1 + x) / 2, w / 2
    for cos_i in (0.02, 0.3, 1.0):
        body = np.sum(2 * np.pi * s**2 * facet.body(cos_i, s**2, n, kd) * 2 * s * w)
        expected = float(fresnel.reflectance(cos_i, n) + body)
        assert float(facet.albedo(cos_i, n, kd)) == pytest.approx(expected, rel=1e-13)


@pytest.fixture(scope="module")
def lambert_cosines(new_seed):
    """Cosines to the normal of directions drawn by their cosine."""
    return np.sqrt(np.random.default_rng(new_seed(11)).random(3_000_000))


def furnace_errors(law, cos_i, n, kd, cosines):
    """p-values of F + mean of f·cos/pdf against the closed albedo, per Kd."""
    kd = np.asarray(kd)
    # pdf = cosθ/π; body depends on o by its cosine only, and at n = 1 not at all: rounding.
    values = law(cos_i, cosines, n, kd[:, None]) * np.pi
    error = np.hypot(values.std(axis=1) / np.sqrt(len(cosines)), 1e-12)
    measured = values.mean(axis=1) + fresnel.reflectance(cos_i, n)
    return hypothesis_tests.z_test(measured, facet.albedo(cos_i, n, kd), error)


@pytest.mark.parametrize("n", INDICES)
def test_energy_by_evaluation(n, lambert_cosines, judge):
    judge.keeps(furnace_errors(facet.body, 0.7, n, ALBEDOS, lambert_cosines))


@pytest.mark.parametrize("n", [1.0, 1.5, 2.4])
def test_energy_made_by_a_fitted_internal_reflectance_is_noticed(n, lambert_cosines, judge):
    """The fit makes 0.1 % of energy at n = 1.5 and Kd = 1."""
    judge.catches(furnace_errors(fitted_body, 0.7, n, [1.0], lambert_cosines))


@pytest.mark.parametrize("n", [1.0, 1 + 1e-12, 1.5, 100.0])
def test_nothing_is_lost_at_a_white_substrate(n):
    assert facet.body_weight(n, 1.0) == 1
    np.testing.assert_array_equal(facet.albedo(np.linspace(1e-9, 1, 101), n, 1.0), 1)


def test_limits():
    # n = 1: a Lambertian facet.
    np.testing.assert_allclose(facet.body([0.1, 1.0], 0.3, 1.0, 0.7), 0.7 / np.pi, rtol=2 * EPS)
    np.testing.assert_allclose(facet.body_weight(1.0, [0.0, 0.7, 1.0]), [0, 0.7, 1], rtol=2 * EPS)
    # Kd = 0: only the mirror.
    assert facet.body(0.5, 0.5, 1.5, 0.0) == 0
    assert facet.body_weight(1.5, 0.0) == 0
    for n in (1.0003, 1.5):
        assert facet.albedo(0.5, n, 0.0) == fresnel.reflectance(0.5, n)


def test_body_is_dark_from_behind_and_reciprocal():
    np.testing.assert_array_equal(facet.body([-0.5, 0.5, 0.0], [0.5, -0.5, 0.5], 1.5, 0.8), 0)
    mu = np.linspace(0.01, 1, 50)
    there = facet.body(mu[:, None], mu, 1.5, 0.8)
    np.testing.assert_array_equal(there, there.T)


def test_scalars_and_arrays():
    kd = np.array([0.2, 0.5, 1.0])
    mu = np.linspace(0.1, 1, 4)[:, None]
    assert facet.body_weight(1.5, 0.5).shape == ()
    assert facet.body_weight(np.array([1.0, 1.5])[:, None], kd).shape == (2, 3)
    assert facet.body(mu, 0.5, 1.5, kd).shape == (4, 3)
    assert facet.albedo(mu, 1.5, kd).shape == (4, 3)
    assert facet.body(0.3, 0.5, 1.5, 0.5) == facet.body([0.3], [0.5], 1.5, [0.5])[0]
    i, m = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.0, 1.0])
    o, is_body = facet.sample(i, np.broadcast_to(m, (2, 5, 3)), 1.5, np.random.default_rng(0))
    assert o.shape == (2, 5, 3)
    assert is_body.shape == (2, 5)
    o, is_body = facet.sample(i, m, 1.5, np.random.default_rng(0))
    assert o.shape == (3,)
    assert is_body.shape == ()


def test_mirror():
    i = np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(facet.mirror(i, [0.0, 0.0, 1.0]), [-0.6, 0.0, 0.8], atol=EPS)
    m = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]])
    o = facet.mirror(i, m)
    np.testing.assert_allclose(np.linalg.norm(o, axis=-1), 1, rtol=4 * EPS)
    np.testing.assert_allclose(o @ m.T * np.eye(2), (m @ i) * np.eye(2), atol=4 * EPS)
    np.testing.assert_allclose(facet.mirror(o, m), np.broadcast_to(i, (2, 3)), atol=8 * EPS)


NORMAL = np.array([0.48, -0.6, 0.64])
ACROSS = np.array([0.8, 0.0, -0.6])


def sampled(n, size, seed):
    """Return cosines and azimuths about a tilted normal, of what `facet.sample` draws as body."""
    i = 0.5 * NORMAL + np.sqrt(0.75) * ACROSS
    o, is_body = facet.sample(i, np.broadcast_to(NORMAL, (size, 3)), n, np.random.default_rng(seed))
    body = o[is_body]
    azimuth = np.arctan2(body @ np.cross(NORMAL, ACROSS), body @ ACROSS)
    return i, o, is_body, body @ NORMAL, azimuth


def chi_square(cosines, azimuths, density):
    """Return the p-value of 40 × 8 bins in μ² and φ, for a density over μ."""
    edges = np.sqrt(np.linspace(0, 1, 41))
    counts, _, _ = np.histogram2d(cosines, azimuths, bins=[edges, np.linspace(-np.pi, np.pi, 9)])
    x, w = np.polynomial.legendre.leggauss(32)
    half = np.diff(edges)[:, None] / 2
    share = np.sum(density(edges[:-1, None] + half * (1 + x)) * half * w, axis=1)
    expected = np.repeat(share[:, None] / share.sum() / 8, 8, axis=1) * len(cosines)
    assert expected.min() > 10
    return hypothesis_tests.chi_square(counts, expected, total_fixed=True)


@pytest.mark.parametrize("n", [1.0, 1.5, 2.4, 4.0, 20.0])
def test_body_directions_follow_transmittance_times_cosine(n, judge):
    i, o, is_body, cosines, azimuths = sampled(n, 1_000_000, judge.seed(5))
    assert np.all(cosines >= 0)
    np.testing.assert_allclose(np.linalg.norm(o, axis=-1), 1, rtol=8 * EPS)
    np.testing.assert_allclose(
        o[~is_body], np.broadcast_to(facet.mirror(i, NORMAL), o[~is_body].shape), atol=4 * EPS
    )
    p = chi_square(cosines, azimuths, lambda mu: fresnel.transmittance(mu, n) * mu)
    judge.keeps(p)
    share = min(1.0, float(fresnel.transmittance(i @ NORMAL, n)))  # 1 passes it by rounding
    judge.keeps(stats.binomtest(int(is_body.sum()), len(is_body), share).pvalue)


def test_other_densities_are_noticed(judge):
    _, _, _, cosines, azimuths = sampled(1.5, 400_000, judge.seed(5))
    judge.catches(chi_square(cosines, azimuths, lambda mu: mu))
    other = np.where(azimuths > 3, -azimuths, azimuths)  # 5 % of them mirrored
    weighted = chi_square(cosines, other, lambda mu: fresnel.transmittance(mu, 1.5) * mu)
    judge.catches(weighted)


def test_rejection_against_normal_incidence_would_be_noticed(judge):
    """For n > 2 + √3, T passes T(1): drawing against T(1) would cut its top off."""
    _, _, _, cosines, azimuths = sampled(20.0, 400_000, judge.seed(5))

    def cut(mu):
        return np.minimum(fresnel.transmittance(mu, 20.0), fresnel.transmittance(1.0, 20.0)) * mu

    judge.catches(chi_square(cosines, azimuths, cut))


def test_samples_repeat():
    first = facet.sample(NORMAL, np.tile(NORMAL, (9, 1)), 1.5, np.random.default_rng(2))
    again = facet.sample(NORMAL, np.tile(NORMAL, (9, 1)), 1.5, np.random.default_rng(2))
    np.testing.assert_array_equal(first[0], again[0])


@given(st.floats(1e-7, 1), st.floats(1e-7, 1), st.floats(1, 100), st.floats(0, 1))
def test_nothing_is_lost_in_the_whole_box(cos_i, cos_o, n, kd):
    value = facet.body(cos_i, cos_o, n, kd)
    assert np.isfinite(value)
    assert value >= 0
    assert 0 <= facet.body_weight(n, kd) <= 1
    assert 0 <= facet.albedo(cos_i, n, kd) <= 1 + 12 * EPS


@pytest.mark.parametrize("kd", [-0.1, 1.1, np.nan, [0.5, 1.5]])
def test_an_impossible_substrate_is_refused(kd):
    for call in (
        lambda: facet.body(0.5, 0.5, 1.5, kd),
        lambda: facet.body_weight(1.5, kd),
        lambda: facet.albedo(0.5, 1.5, kd),
    ):
        with pytest.raises(ValueError, match="kd = "):
            call()
