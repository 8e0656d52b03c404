"""STD of slopes against mpmath, scipy's distributions, GGX, Beckmann and quadrature."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from microsurf.physics import student_t

EPS = np.finfo(float).eps
GAMMAS = (1.501, 1.51, 1.75, 2.0, 2.5, 8.0, 40.0, 1e3, 1e6, 1e9, np.inf)
SIGMAS = (1e-4, 0.02, 0.5, 3.0, 10.0)
THETAS = np.radians([0.0, 1e-6, 0.01, 1, 20, 45, 60, 80, 89, 89.9, 89.999, 89.99999])

mp.mp.dps = 50


def exact_log_kernel(rho2, gamma):
    """Return ln of STD's kernel at 50 digits."""
    if np.isinf(gamma):
        return -rho2
    gamma = mp.mpf(gamma)
    return -gamma * mp.log(1 + rho2 / (gamma - 1))


def exact_distribution(m, gamma, sigma_x, sigma_y):
    """Ribardière et al. 2018, eq. 6, of exactly the doubles given; also its exponents' size."""
    x, y, z = (mp.mpf(float(v)) for v in m)
    sigma_x, sigma_y = mp.mpf(sigma_x), mp.mpf(sigma_y)
    log_kernel = exact_log_kernel(((x / sigma_x) ** 2 + (y / sigma_y) ** 2) / z**2, gamma)
    value = mp.exp(log_kernel) / (mp.pi * sigma_x * sigma_y * z**4)
    return value, float(abs(log_kernel) + 4 * abs(mp.log(z)))


def direction(theta, phi=0.3):
    """Return the unit vectors at θ and φ."""
    theta = np.asarray(theta)
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )


def close(value, exact, tolerance, tiny=1e-290):
    """Whether value is exact to a relative tolerance; below ``tiny`` doubles lose digits."""
    if exact < tiny:
        return 0 <= value < 2 * tiny
    return abs(mp.mpf(float(value)) / exact - 1) <= tolerance


@pytest.mark.parametrize("gamma", GAMMAS)
@pytest.mark.parametrize("sigma", SIGMAS)
def test_distribution_and_density_are_exact_to_rounding(gamma, sigma):
    m = direction(THETAS)
    values = student_t.distribution(m, gamma, sigma)
    p, q = m[:, 0] / m[:, 2], m[:, 1] / m[:, 2]
    densities = student_t.slope_density(p, q, gamma, sigma)
    for k, theta in enumerate(THETAS):
        # A logarithm L is rounded to ε|L| and its argument, with some 4 roundings,
        # moves it by no more than 4ε|L| + 8ε; the exponential passes that on.
        exact, size = exact_distribution(m[k], gamma, sigma, sigma)
        assert close(values[k], exact, 8 * EPS * (2 + size)), (gamma, sigma, theta)
        rho2 = (mp.mpf(float(p[k])) ** 2 + mp.mpf(float(q[k])) ** 2) / mp.mpf(sigma) ** 2
        log_kernel = exact_log_kernel(rho2, gamma)
        exact = mp.exp(log_kernel) / (mp.pi * mp.mpf(sigma) ** 2)
        assert close(densities[k], exact, 8 * EPS * (2 + float(abs(log_kernel)))), theta


@pytest.mark.parametrize("gamma", GAMMAS)
def test_anisotropic_distribution_is_exact_to_rounding(gamma):
    for phi in (0.0, 0.4, np.pi / 2, 2.5):
        for theta in (0.0, 0.3, 1.2, 1.57):
            m = direction(theta, phi)
            exact, size = exact_distribution(m, gamma, 0.1, 0.9)
            assert close(student_t.distribution(m, gamma, 0.1, 0.9), exact, 8 * EPS * (2 + size))


def test_distribution_at_extreme_grazing_and_below_the_horizon():
    m = np.array([[1.0, 0.0, 1e-140], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 1e-200]])
    values = student_t.distribution(m, 2.0, 0.5)  # D → σ²/π at grazing
    assert values[0] == pytest.approx(0.25 / np.pi, rel=8 * EPS * 4000)
    assert values[1] == 0
    assert values[2] == 0
    assert np.isfinite(values[3])


def test_ggx_by_walter_2007():
    """γ = 2 is eq. 33, written there with α, cosθ and tanθ."""
    for alpha in (0.05, 0.5, 2.0):
        cosine, tangent = np.cos(THETAS), np.tan(THETAS)
        ggx = alpha**2 / (np.pi * cosine**4 * (alpha**2 + tangent**2) ** 2)
        # D is a fourth power of a cosine that cos and tan give to about 1e−9 at 89.99999°.
        np.testing.assert_allclose(
            student_t.distribution(direction(THETAS, 0.0), student_t.GGX, alpha), ggx, rtol=1e-8
        )
        np.testing.assert_allclose(
            student_t.distribution(direction(THETAS[:8], 0.0), 2.0, alpha), ggx[:8], rtol=1e-13
        )


def test_beckmann_by_walter_2007_and_the_way_to_it():
    """γ = ∞ is eq. 25; ln D differs by −ρ²/(γ−1) + ρ⁴/(2γ) to first order in 1/γ."""
    alpha, theta = 0.5, np.radians([0.0, 5, 20, 40, 60, 70])
    rho2 = (np.tan(theta) / alpha) ** 2
    beckmann = np.exp(-rho2) / (np.pi * alpha**2 * np.cos(theta) ** 4)
    m = direction(theta)
    np.testing.assert_allclose(
        student_t.distribution(m, student_t.BECKMANN, alpha), beckmann, rtol=2e-14
    )
    for gamma in (1e6, 1e9):
        step = np.log(student_t.distribution(m, gamma, alpha) / beckmann)
        expected = (rho2**2 / 2 - rho2) / gamma
        # The next order is below ρ⁶/γ²; rounding is some ε(1 + ρ²).
        np.testing.assert_array_less(
            abs(step - expected), (1 + rho2) ** 3 / gamma**2 + 30 * EPS * (1 + rho2)
        )


def test_density_is_scipys_bivariate_t():
    generator = np.random.default_rng(1)
    slopes = generator.standard_t(2, (50, 2)) * (0.3, 0.8)
    for gamma in (1.6, 2.0, 8.0, 40.0):
        law = stats.multivariate_t(shape=np.diag([0.3**2, 0.8**2]) / 2, df=2 * gamma - 2)
        np.testing.assert_allclose(
            student_t.slope_density(slopes[:, 0], slopes[:, 1], gamma, 0.3, 0.8),
            law.pdf(slopes),
            rtol=1e-11,  # scipy takes differences of gammaln
        )


@pytest.mark.parametrize("gamma", [1.6, 2.0, 8.0, np.inf])
def test_marginal_is_students_t(gamma):
    """∫ density dq is t_ν scaled by σ_x/√2. Trapezoid in q = sinh(y): converges at machine rate."""
    y = np.linspace(-60, 60, 4001)
    p = np.array([0.0, 0.2, 1.0, 7.0])[:, None]
    integrand = student_t.slope_density(p, np.sinh(y), gamma, 0.4, 0.7) * np.cosh(y)
    marginal = integrand.sum(axis=1) * (y[1] - y[0])
    scale = 0.4 / np.sqrt(2)
    law = stats.norm(scale=scale) if np.isinf(gamma) else stats.t(2 * gamma - 2, scale=scale)
    # scipy's t loses digits in gammaln; exponents up to (7/0.4)² = 300.
    np.testing.assert_allclose(marginal, law.pdf(p[:, 0]), rtol=1e-12)


@pytest.mark.parametrize("gamma", [1.6, 2.0, 8.0])
def test_is_a_gamma_mixture_of_beckmanns(gamma):
    """D'Eon 2023: roughness σ√((γ−1)/u) with u from Gamma(γ−1)."""
    sigma = 0.5
    for slope in (0.0, 0.4, 3.0):

        def integrand(u, slope=slope):
            rho2 = slope**2 * u / (sigma**2 * (gamma - 1))
            return mp.exp(-rho2 - u) * u ** (gamma - 1) / (mp.pi * sigma**2 * (gamma - 1))

        mixture = mp.quad(integrand, [0, 1, 10, mp.inf]) / mp.gamma(gamma - 1)
        value = student_t.slope_density(slope, 0.0, gamma, sigma)
        assert float(value) == pytest.approx(float(mixture), rel=1e-13)


def panels(low, high, nodes=16):
    """Gauss-Legendre nodes and weights on panels of width ≤ 1."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    edges = np.linspace(low, high, 2 + int(high - low))
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + x)).ravel(), (half * w).ravel()


@pytest.mark.parametrize("gamma", GAMMAS)
@pytest.mark.parametrize("sigma", [1e-4, 0.5, 10.0])
def test_normalisation(gamma, sigma):
    """∫ D cosθ dm = 1, in y = ln tanθ; what lies outside the range is below 1e−17."""
    y, weights = panels(np.log(sigma) - 20, np.log(sigma) + 42)
    tangent = np.exp(y)
    cosine = 1 / np.hypot(1, tangent)
    m = np.stack([tangent * cosine, np.zeros_like(y), cosine], axis=-1)
    integrand = 2 * np.pi * student_t.distribution(m, gamma, sigma) * tangent**2 * cosine**4
    # Exponents reach 4·42 + γ·84 ≲ 300 for γ near 3/2, where it matters: 300 ε.
    assert np.sum(integrand * weights) == pytest.approx(1, abs=300 * EPS)


def test_normalisation_anisotropic():
    y, weights = panels(np.log(0.2) - 20, np.log(0.8) + 20)
    phi = 2 * np.pi * np.arange(256)[:, None] / 256
    tangent = np.exp(y)
    cosine = 1 / np.hypot(1, tangent)
    sine = tangent * cosine
    m = np.stack(np.broadcast_arrays(sine * np.cos(phi), sine * np.sin(phi), cosine), axis=-1)
    ring = student_t.distribution(m, 2.5, 0.2, 0.8).mean(axis=0) * 2 * np.pi
    assert np.sum(ring * tangent**2 * cosine**4 * weights) == pytest.approx(1, abs=300 * EPS)


@pytest.mark.parametrize("gamma", GAMMAS)
def test_cdf_and_quantile_against_mpmath(gamma):
    for r in (1e-9, 1e-3, 0.1, 0.5, 1.0, 3.0, 30.0, 1e4):
        rho2 = (mp.mpf(r) / mp.mpf(0.5)) ** 2
        log_tail = exact_log_kernel(rho2, gamma)
        if np.isfinite(gamma):
            log_tail *= 1 - 1 / mp.mpf(gamma)
        assert close(student_t.slope_cdf(r, gamma, 0.5), -mp.expm1(log_tail), 8 * EPS), r
    for u in (1e-300, 1e-9, 0.1, 0.5, 0.9, 0.999, 1 - 2.0**-40, 1 - 2.0**-53):
        log_tail = -mp.log1p(-mp.mpf(u))
        stretch = log_tail / (mp.mpf(gamma) - 1)
        rho2 = log_tail if np.isinf(gamma) else (mp.mpf(gamma) - 1) * mp.expm1(stretch)
        # expm1 turns the rounding of its argument into a relative error of that size.
        tolerance = 4 * EPS * (2 + float(stretch))
        assert close(student_t.slope_quantile(u, gamma, 0.5), mp.sqrt(rho2) / 2, tolerance), u
    assert student_t.slope_quantile(1.0, gamma) == np.inf
    assert student_t.slope_quantile(0.0, gamma) == 0
    assert student_t.slope_cdf(np.inf, gamma) == 1
    assert student_t.slope_cdf(1e200, gamma) == 1


@given(st.floats(0, 1 - 2.0**-53), st.floats(1.501, 1e9), st.floats(1e-4, 10))
def test_quantile_inverts_cdf(u, gamma, sigma):
    r = student_t.slope_quantile(u, gamma, sigma)
    # |dF/d ln r| ≤ 2(1 + |ln(1−u)|) min(u, 1), and r is good to 4ε(2 + stretch).
    stretch = -np.log1p(-u) * max(1, 1 / (gamma - 1))
    assert student_t.slope_cdf(r, gamma, sigma) == pytest.approx(u, rel=16 * EPS * (2 + stretch))


def p_values(p, q, gamma, sigma_x, sigma_y):
    """Kolmogorov–Smirnov of ρ² ~ F(2, ν), of both marginals t_ν and of the azimuth."""
    a, b = p / sigma_x, q / sigma_y
    nu = 2 * gamma - 2
    if np.isinf(nu):
        radial, marginal = stats.expon(), stats.norm(scale=np.sqrt(0.5))
    else:
        radial, marginal = stats.f(2, nu), stats.t(nu, scale=np.sqrt(0.5))
    return [
        stats.kstest(a**2 + b**2, radial.cdf).pvalue,
        stats.kstest(a, marginal.cdf).pvalue,
        stats.kstest(b, marginal.cdf).pvalue,
        stats.kstest(np.arctan2(b, a), stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue,
    ]


@pytest.mark.parametrize("gamma", [1.51, 2.0, 8.0, np.inf])
def test_samples_follow_the_law(gamma, judge):
    p, q = student_t.sample_slopes(np.random.default_rng(judge.seed(7)), 100_000, gamma, 0.3, 0.9)
    judge.keeps(p_values(p, q, gamma, 0.3, 0.9))


def test_samples_of_another_gamma_or_sigma_are_noticed(judge):
    p, q = student_t.sample_slopes(np.random.default_rng(judge.seed(7)), 100_000, 2.0, 0.3, 0.9)
    judge.catches(p_values(p, q, 2.4, 0.3, 0.9))
    judge.catches(p_values(p, q, 2.0, 0.315, 0.9))
    judge.catches(p_values(q, p, 2.0, 0.3, 0.9))


def test_samples_have_the_shape_asked_for_and_repeat():
    first = student_t.sample_slopes(np.random.default_rng(3), (4, 5), 2.0, 0.3)
    again = student_t.sample_slopes(np.random.default_rng(3), (4, 5), 2.0, 0.3)
    assert first[0].shape == first[1].shape == (4, 5)
    np.testing.assert_array_equal(first, again)


def test_normals():
    slopes = np.array([0.0, -0.5, 3.0, 1e-200, 1e200])
    m = student_t.normals(slopes, 0.7 * slopes)
    assert m.shape == (5, 3)
    np.testing.assert_allclose(np.linalg.norm(m, axis=-1), 1, rtol=4 * EPS)
    np.testing.assert_allclose(-m[:, 0] / m[:, 2], slopes, rtol=8 * EPS)
    np.testing.assert_allclose(-m[:, 1] / m[:, 2], 0.7 * slopes, rtol=8 * EPS)
    assert student_t.normals(0.0, [1.0, 2.0]).shape == (2, 3)


def exact_area(slope, gamma, sigma):
    """Microsurface area beyond a slope: with t = 1 + r² an incomplete beta integral, as ₂F₁."""
    t, sigma2 = 1 + mp.mpf(slope) ** 2, mp.mpf(sigma) ** 2
    if np.isinf(gamma):
        return mp.exp(1 / sigma2) * mp.sqrt(sigma2) * mp.gammainc(mp.mpf(3) / 2, t / sigma2)
    gamma = mp.mpf(gamma)
    half = mp.mpf(1) / 2
    b = (gamma - 1) * sigma2 - 1
    value = mp.hyp2f1(gamma, gamma - 3 * half, gamma - half, -b / t)
    return (
        ((gamma - 1) * sigma2) ** gamma
        / sigma2
        * t ** (3 * half - gamma)
        * value
        / (gamma - 3 * half)
    )


@pytest.mark.parametrize("gamma", [1.501, 1.51, 1.6, 2.0, 3.0, 8.0, 40.0, np.inf])
@pytest.mark.parametrize("sigma", [1e-4, 0.5, 10.0])
def test_area_beyond_against_closed_form(gamma, sigma):
    for slope in (0.0, 0.1 * sigma, sigma, 4 * sigma, 20.0, 1e4, 1e30):
        exact = exact_area(slope, gamma, sigma) / exact_area(0, gamma, sigma)
        # The integrand is exp of a number of about |ln share|.
        tolerance = 1e-14 * (2 + float(abs(mp.log(exact))))
        assert close(student_t.area_beyond(slope, gamma, sigma), exact, tolerance), slope


def test_area_beyond_against_quadrature():
    """The closed form above, checked itself on the definition ∫ √(1+r²) dF."""
    for gamma, sigma, slope in ((1.75, 0.5, 20.0), (8.0, 3.0, 1.0)):

        def density(r, gamma=gamma, sigma=sigma):
            rho2 = (r / sigma) ** 2
            return mp.sqrt(1 + r**2) * 2 * r / sigma**2 * mp.exp(exact_log_kernel(rho2, gamma))

        with mp.workdps(25):
            # r = e^y; beyond e^200 lies less than 1e−40 of it.
            edges = [*mp.linspace(mp.log(slope), 40, 21), 100, 200]
            area = mp.quad(lambda y, f=density: f(mp.exp(y)) * mp.exp(y), edges)
        assert float(area / exact_area(slope, gamma, sigma)) == pytest.approx(1, abs=1e-15)


def test_area_beyond_known_figures():
    """Shares in per cent at |slope| > 20, 100, 1000 for σ = 0.5, to the digits once published."""
    for gamma, shares in ((1.6, (39, 28, 18)), (1.75, (11, 5, 1.6)), (2.0, (1.8, 0.4, 0.04))):
        for slope, share in zip((20, 100, 1000), shares, strict=True):
            digits = 0 if share >= 5 else 1 if share >= 0.1 else 2
            assert round(100 * student_t.area_beyond(slope, gamma, 0.5), digits) == share
    assert student_t.area_beyond(20, 2.5, 0.5) < 1e-3


@given(
    st.floats(1.501, 1e9),
    st.floats(1e-4, 10),
    st.floats(1e-4, 10),
    st.floats(0, 89.99999),
    st.floats(0, 360),
)
def test_nothing_is_lost_in_the_whole_box(gamma, sigma_x, sigma_y, theta, phi):
    m = direction(np.radians(theta), np.radians(phi))
    for value in (
        student_t.distribution(m, gamma, sigma_x, sigma_y),
        student_t.slope_density(m[0] / m[2], m[1] / m[2], gamma, sigma_x, sigma_y),
        student_t.slope_cdf(np.tan(np.radians(theta)), gamma, sigma_x),
        student_t.slope_quantile(theta / 90, gamma, sigma_x),
        student_t.area_beyond(float(np.tan(np.radians(theta))), gamma, sigma_x),
    ):
        assert np.isfinite(value)
        assert value >= 0


@pytest.mark.parametrize(
    ("gamma", "sigma", "named"),
    [(1.0, 0.5, "gamma = 1.0"), (np.nan, 0.5, "gamma = nan"), (2.0, 0.0, "sigma"),
     (2.0, -1.0, "sigma"), (2.0, np.inf, "sigma"), (2.0, np.nan, "sigma")],
)  # fmt: skip
def test_bad_values_are_named(gamma, sigma, named):
    for call in (
        lambda: student_t.distribution([0, 0, 1], gamma, sigma),
        lambda: student_t.slope_density(0, 0, gamma, sigma),
        lambda: student_t.slope_cdf(1, gamma, sigma),
        lambda: student_t.slope_quantile(0.5, gamma, sigma),
        lambda: student_t.sample_slopes(np.random.default_rng(0), 1, gamma, sigma),
        lambda: student_t.area_beyond(1, gamma, sigma),
    ):
        with pytest.raises(ValueError, match=named) as caught:
            call()
        assert "\n" not in str(caught.value)


def test_area_beyond_refuses_infinite_areas_and_negative_slopes():
    with pytest.raises(ValueError, match=r"gamma = 1\.5"):
        student_t.area_beyond(1, 1.5, 0.5)
    with pytest.raises(ValueError, match=r"slope = -1"):
        student_t.area_beyond(-1, 2.0, 0.5)


@pytest.mark.parametrize("gamma", [1.501, 2.0, 8.0, 1e9, np.inf])
def test_mean_area_by_quadrature_over_probability(gamma):
    """∫ √(1+r²) e^(−s) ds with F = 1 − e^(−s): 25 digits."""
    for sigma in (1e-6, 0.5, 10.0):
        a = mp.mpf(gamma) - 1

        def integrand(s, sigma=sigma, a=a):
            rho2 = s if np.isinf(gamma) else a * mp.expm1(s / a)
            return mp.sqrt(1 + mp.mpf(sigma) ** 2 * rho2) * mp.exp(-s)

        with mp.workdps(25):
            end = 60 if np.isinf(gamma) else 60 / (1 - 0.5 / a)
            # Dense at 0, where the root is steep for large σ.
            exact = mp.quad(integrand, [end * (k / mp.mpf(30)) ** 4 for k in range(31)])
        assert abs(student_t.mean_area(gamma, sigma) / exact - 1) <= 1e-13
    with pytest.raises(ValueError, match=r"gamma = 1\.5: the area"):
        student_t.mean_area(1.5, 0.5)


def test_density_is_no_smaller_than_it_must_be():
    """e^(−740) is no normal double, over πσ² = 3e−12 it is."""
    rho2 = mp.mpf(740)
    exact = mp.exp(-rho2) / (mp.pi * mp.mpf(1e-6) ** 2)
    p = float(mp.sqrt(rho2)) * 1e-6
    assert float(student_t.slope_density(p, 0.0, np.inf, 1e-6)) == pytest.approx(
        float(exact), rel=1e-12
    )
