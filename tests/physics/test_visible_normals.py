import mpmath
import numpy as np
import pytest
from judge import rate
from scipy import stats

from microsurf.physics import student_t, visible_normals

SIGMA = 0.5
SCALE = SIGMA / np.sqrt(2)
COUNT = 20_000
GAMMAS = (1.501, 1.51, 1.75, 2.0, 8.0, 1e3, 1e9, np.inf)
THETAS = (0, 45, 80, 89.99, 90, 90.01, 100, 135, 160)
FAR = 1e90  # slopes beyond are left out of the comparison: their cosines leave the doubles


def direction(theta, phi=0.0):
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def partial(p, c, nu):
    """∫_−∞^p (c − x) t_ν(x) dx for p ≤ c, from the t distribution and its first moment."""
    excess = visible_normals.mean_excess(nu)
    if np.isinf(nu):
        return c * stats.norm.cdf(p) + excess * np.exp(-(p**2) / 2)
    return c * stats.t.cdf(p, nu) + excess * np.exp(-(nu - 1) / 2 * np.log1p(p**2 / nu))


def along_cdf(c, nu):
    """CDF of the slope along w between −FAR and FAR."""
    if np.isinf(c):  # along the mean normal every facet is seen as it is
        law = stats.norm() if np.isinf(nu) else stats.t(nu)
        low, high = law.cdf(-FAR), law.cdf(FAR)
        return lambda p: (law.cdf(p) - low) / (high - low)
    low, high = partial(-FAR, c, nu), partial(c, c, nu)
    return lambda p: np.where(p < c, (partial(np.minimum(p, c), c, nu) - low) / (high - low), 1.0)


def slopes(m, phi):
    """Slopes along azimuth φ and across it, in units of σ/√2."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return tuple(-(m @ direction(90, phi + turn)) / (m[:, 2] * SCALE) for turn in (0, 90))


def cotangent(theta):
    return np.cos(np.radians(theta)) / np.sin(np.radians(theta)) / SCALE if theta else np.inf


@pytest.mark.parametrize("gamma", GAMMAS)
def test_slopes_along_and_across_have_their_law(gamma, judge):
    """Kolmogorov–Smirnov at every angle; the negative control is the next test."""
    nu = 2 * gamma - 2
    rng = np.random.default_rng(judge.seed(1))
    levels = []
    for theta in THETAS:
        m = visible_normals.sample(
            np.tile(direction(theta, 30), (COUNT, 1)), gamma, SIGMA, None, rng
        )
        np.testing.assert_allclose(np.linalg.norm(m, axis=1), 1, rtol=1e-14)
        p, q = slopes(m, 30)
        inside = np.abs(p) < FAR
        assert inside.mean() > (0.3 if gamma < 1.505 else 0.95)
        p, q = p[inside], q[inside]
        levels.append(stats.kstest(p, along_cdf(cotangent(theta), nu)).pvalue)
        ratio = q if np.isinf(nu) else q * np.sqrt((nu + 1) / (nu + p**2))
        law = stats.norm() if np.isinf(nu) else stats.t(nu + 1)
        levels.append(stats.kstest(ratio, law.cdf).pvalue)
    judge.keeps(levels)


def test_redrawing_only_the_branch_fails_the_same_test(judge):
    """The negative control: a rejection that stays in its branch is another distribution."""
    nu, theta = 2.0, 80
    rng = np.random.default_rng(judge.seed(2))
    c, excess = cotangent(theta), visible_normals.mean_excess(2.0)
    steep = -np.sqrt(nu * np.expm1(2 * rng.standard_exponential(COUNT) / (nu - 1)))
    core = rng.standard_t(nu, 20 * COUNT)
    core = core[(core <= 0) | (rng.random(len(core)) < 1 - core / c)][:COUNT]
    p = np.where(rng.random(COUNT) < c / (c + excess), core, steep)
    judge.catches(stats.kstest(p, along_cdf(c, nu)).pvalue)


@pytest.mark.parametrize("nu", [1.002, 1.02, 2.0, 14.0, 100.0, 2e3, 2e9, np.inf])
def test_from_below_a_third_of_all_draws_is_accepted_at_least(nu, judge):
    """Whatever the height of the ray. Negative control: three tenths of what was accepted."""
    rng = np.random.default_rng(judge.seed(3))
    count = []
    for a in np.geomspace(1e-3, 1e8, 34):
        sign, log_x, accepted = visible_normals._seen_from_below(np.full(40_000, -a), nu, rng)
        count.append(accepted.sum())
        assert (sign == -1).all()
        assert np.isfinite(log_x).all()
        assert (log_x >= np.log(a)).all()
    judge.keeps(rate(count, 40_000, 0.34, 1.0))
    judge.catches(rate(np.floor(0.3 * np.array(count)), 40_000, 0.34, 1.0))


@pytest.mark.parametrize("w", [direction(60, 20), direction(100, 70), direction(0)])
@pytest.mark.parametrize("gamma", [1.75, 8.0, np.inf])
def test_anisotropic_normals_have_the_density_of_the_definition(w, gamma, judge):
    """Means over them are those over all facets weighted by what w sees."""
    sigma = (0.6, 0.15)
    rng = np.random.default_rng(judge.seed(4))
    m = visible_normals.sample(np.tile(w, (400_000, 1)), gamma, *sigma, rng)
    facets = student_t.normals(*student_t.sample_slopes(rng, 2_000_000, gamma, *sigma))
    area = visible_normals.projected_area(w, gamma, *sigma)
    weight = np.minimum(np.maximum(facets @ w, 0) / facets[:, 2], 1e6) / area
    rows = []
    for of in (lambda n: n[:, 0], lambda n: n[:, 1] ** 2, lambda n: n[:, 2] ** 2):
        # m_z² keeps the variance of weights finite, which grow as the slope.
        seen, expected = of(m) * m[:, 2] ** 2, weight * of(facets) * facets[:, 2] ** 2
        error = np.hypot(seen.std() / np.sqrt(len(seen)), expected.std() / np.sqrt(len(expected)))
        rows.append((seen.mean(), expected.mean(), error))
    judge.near(*np.transpose(rows))


@pytest.mark.parametrize("theta", [20, 40, 89.9999, 90, 90.0001, 130, 160])
@pytest.mark.parametrize("gamma", [1.6, 2.0, 30.0, np.inf])
def test_projected_area_is_the_integral_it_is_named_for(theta, gamma):
    """∫ (c − p s) t_ν(p) dp over p = c/s − e^y at 25 digits."""
    w = direction(theta)
    c, s = mpmath.mpf(w[2]), mpmath.mpf(w[0]) * SCALE
    nu = mpmath.mpf(2 * gamma - 2)

    def density(p):
        if np.isinf(gamma):
            return mpmath.exp(-(p**2) / 2) / mpmath.sqrt(2 * mpmath.pi)
        height = mpmath.gamma((nu + 1) / 2) / mpmath.sqrt(nu * mpmath.pi) / mpmath.gamma(nu / 2)
        return height * (1 + p**2 / nu) ** (-(nu + 1) / 2)

    with mpmath.workdps(25):
        panels = [-60, -20, -8, -4, -2, -1, 0, 1, 1.5, 2, 2.5, 3, 4, 8, 20, 60, 150, 400]
        area = mpmath.quad(lambda y: s * mpmath.e ** (2 * y) * density(c / s - mpmath.e**y), panels)
    np.testing.assert_allclose(
        visible_normals.projected_area(w, gamma, SIGMA), float(area), rtol=1e-10
    )


def test_refuses_what_has_no_mean_slope():
    with pytest.raises(ValueError, match=r"gamma = 1\.5: visible normals need gamma > 3/2"):
        visible_normals.sample(direction(10), 1.5, SIGMA, None, np.random.default_rng(0))
