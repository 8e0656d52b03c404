"""Smith's Λ, G1 and G2 against mpmath, closed forms and the identities they must obey."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from microsurf.physics import smith, student_t

EPS = np.finfo(float).eps
DEGREES = (1.002, 1.02, 1.5, 2.0, 3.0, 6.0, 14.0, 16.0, 17.0, 25.0, 30.0, 49.9, 50.0, 78.0, 200.0)
LARGE_DEGREES = (2e3, 2e4, 2e6, 2e8, 2e9)
ARGUMENTS = (1e-8, 1e-4, 0.1, 0.5, 1.0, 2.0, 3.0, 3.9, 4.0, 4.1, 6.0, 10.0, 20.0, 100.0, 1e4)

mp.mp.dps = 50


def student_constant(nu):
    """Return K, the height of Student's t density at zero."""
    nu = mp.mpf(nu)
    return mp.exp(mp.loggamma((nu + 1) / 2) - mp.loggamma(nu / 2)) / mp.sqrt(nu * mp.pi)


def leading(x, nu):
    """Return A, the first part of Λ = A − SF."""
    x = mp.mpf(x)
    if mp.isinf(nu):
        return mp.exp(-(x**2) / 2) / (x * mp.sqrt(2 * mp.pi))
    nu = mp.mpf(nu)
    fall = mp.exp(-(nu - 1) / 2 * mp.log1p(x**2 / nu))
    return student_constant(nu) * nu / ((nu - 1) * x) * fall


def closed_lambda(x, nu):
    """Return Λ at 50 digits: both parts of the difference, SF by the incomplete beta function."""
    x = mp.mpf(x)
    if mp.isinf(nu):
        return leading(x, nu) - mp.erfc(x / mp.sqrt(2)) / 2
    nu = mp.mpf(nu)
    below = mp.betainc(nu / 2, mp.mpf(1) / 2, 0, nu / (nu + x**2), regularized=True)
    return leading(x, nu) - below / 2


def defined_lambda(x, nu):
    """Return Λ by its definition (1/x) ∫_x^∞ (p − x) t_ν(p) dp, in y = ln(p/x − 1)."""
    x = mp.mpf(x)
    infinite = mp.isinf(nu)
    nu = mp.mpf(nu)
    constant = 1 / mp.sqrt(2 * mp.pi) if infinite else student_constant(nu)

    def density(p):
        if infinite:
            return constant * mp.exp(-(p**2) / 2)
        return constant * mp.exp(-(nu + 1) / 2 * mp.log1p(p**2 / nu))

    unit = density(x)  # mpmath's quadrature stops at an absolute error

    def integrand(y):
        rise = x * mp.exp(y)
        return rise * density(x + rise) / unit * rise

    # From far below the scale min(1/x, x, 1) of the fall to where t_ν is its leading power.
    root = mp.sqrt(min(nu, mp.mpf(1e4)))
    low = mp.log(min(1, 1 / x) / x) - 30
    high = mp.log(max(1, root / x)) + (60 if nu < 1e4 else 0) + 5
    value = mp.quad(integrand, mp.linspace(low, high, int((high - low) / 3) + 2)) * unit
    if nu < 1e4:
        # ∫_P^∞ (p − x) C p^(−ν−1) dp
        top = x + x * mp.exp(high)
        power = constant * nu ** ((nu + 1) / 2)
        value += power * (top ** (1 - nu) / (nu - 1) - x * top ** (-nu) / nu)
    return value / x


def tolerance(x, nu, exact):
    """Return the relative error of Λ that its three forms explain.

    Some roundings, and those of an exponent of the size of ln Λ. For x < 4 and
    x² < ν two parts are subtracted, each good to 16 ε (scipy's stdtr the worse):
    that grows by A/Λ ≤ 18.
    """
    relative = 8 * EPS * (2 + float(abs(mp.log(exact))))
    if x < 4 and x**2 < nu:
        relative += 16 * EPS * float(leading(x, nu) / exact)
    return relative


def direction(theta, phi=0.0):
    """Return the unit vectors at θ and φ in degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
        ),
        axis=-1,
    )


@pytest.mark.parametrize("nu", [*DEGREES, np.inf])
def test_lambda_against_the_closed_form(nu):
    borders = [np.sqrt(nu) * f for f in (1 - 1e-9, 1 - EPS, 1, 1 + EPS, 1 + 1e-9)]
    borders = [x for x in borders if np.isfinite(x)]
    for x in [*ARGUMENTS, 4 - 2 * EPS, 4 + 4 * EPS, *borders]:
        with mp.workdps(50 + int(x**2 / 4 if mp.isinf(nu) and x < 40 else 0)):
            exact = closed_lambda(x, nu)
        value = float(smith.lambda_of_x(x, nu))
        if exact < 1e-290:
            assert 0 <= value < 2e-290
        else:
            assert abs(value / exact - 1) <= tolerance(x, nu, exact), x


@pytest.mark.parametrize("nu", LARGE_DEGREES)
@pytest.mark.parametrize("x", [1e-4, 0.5, 3.9, 4.0, 10.0, 35.0])
def test_lambda_against_the_definition_for_many_degrees(nu, x):
    with mp.workdps(25):
        exact = defined_lambda(x, nu)
    assert abs(float(smith.lambda_of_x(x, nu)) / exact - 1) <= tolerance(x, nu, exact)


@pytest.mark.parametrize(("nu", "x"), [(1.002, 0.3), (2.0, 5.0), (16.0, 4.0), (np.inf, 6.0)])
def test_the_closed_form_is_the_definition(nu, x):
    with mp.workdps(30):
        assert abs(defined_lambda(x, nu) / closed_lambda(x, nu) - 1) < 1e-16


@pytest.mark.parametrize("nu", [1.002, 2.0, 30.0, np.inf])
def test_lambda_at_the_ends(nu):
    np.testing.assert_array_equal(smith.lambda_of_x([0.0, np.inf], nu), [np.inf, 0.0])
    assert np.isnan(smith.lambda_of_x(np.nan, nu))
    assert smith.lambda_of_x(1e-300, nu) > 1e299
    assert smith.lambda_of_x(np.ones((2, 3)), nu).shape == (2, 3)


def test_lambda_far_out_is_its_leading_power():
    """At x = 1e200, x² is no double; Λ → K ν^(ν/2+1/2) x^(−ν)/(ν(ν−1)) still is."""
    nu = 1.002
    exact = (
        student_constant(nu) * mp.mpf(nu) ** ((mp.mpf(nu) + 1) / 2) * mp.mpf(1e200) ** -mp.mpf(nu)
    )
    exact /= mp.mpf(nu) * (mp.mpf(nu) - 1)
    value = float(smith.lambda_of_x(1e200, nu))
    assert abs(value / exact - 1) <= 8 * EPS * (2 + float(abs(mp.log(exact))))


@pytest.mark.parametrize("nu", [0.5, 1.002, *DEGREES, *LARGE_DEGREES])
def test_student_constant(nu):
    exact = mp.log(student_constant(nu))
    # K has about three roundings and beta's own; ln K is about −1.
    assert abs(smith.log_student_constant(nu) - exact) <= 8 * EPS


def test_ggx_and_beckmann():
    """Walter 2007 through Heitz 2014, eqs. 72 and 66."""
    theta = np.array([0.1, 5, 20, 45, 60, 80, 89, 89.99])
    w, alpha = direction(theta), 0.6
    tangent = w[:, 0] / w[:, 2]
    # (√(1+t²) − 1)/2 without the difference.
    t2 = (alpha * tangent) ** 2
    ggx = t2 / (2 * (1 + np.sqrt(1 + t2)))
    np.testing.assert_allclose(smith.smith_lambda(w, student_t.GGX, alpha), ggx, rtol=16 * EPS)
    for k in range(2, len(theta)):
        a = 1 / (mp.mpf(alpha) * mp.mpf(float(tangent[k])))
        beckmann = (mp.erf(a) - 1) / 2 + mp.exp(-(a**2)) / (2 * a * mp.sqrt(mp.pi))
        value = float(smith.smith_lambda(w[k], student_t.BECKMANN, alpha))
        assert abs(value / beckmann - 1) <= 16 * EPS * (2 + float(2 * a**2))


def test_way_to_beckmann():
    """|ΔG1| of STD to Beckmann, as far as it gets over θ and σ, is 0.43/γ … 0.15/γ."""
    x = np.geomspace(0.01, 10, 2001)
    limit = 1 / (1 + smith.lambda_of_x(x, np.inf))
    for gamma, expected in ((2.0, 0.43), (8.0, 0.18), (1e3, 0.15), (1e6, 0.15)):
        seen = 1 / (1 + smith.lambda_of_x(x, 2 * gamma - 2))
        assert gamma * np.max(abs(seen - limit)) == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("gamma", [1.501, 2.0, 8.0, np.inf])
def test_below_the_horizon(gamma):
    w = direction([0, 10, 60, 89, 89.999], 25.0)
    up, down = smith.smith_lambda(w, gamma, 0.3, 0.7), smith.smith_lambda(-w, gamma, 0.3, 0.7)
    np.testing.assert_array_equal(down, -1 - up)
    np.testing.assert_array_equal(smith.g1(-w, gamma, 0.3, 0.7), 0)
    assert smith.smith_lambda([1.0, 0.0, 0.0], gamma, 0.3) == np.inf
    assert smith.g1([1.0, 0.0, 0.0], gamma, 0.3) == 0
    assert smith.g1([1.0, 0.0, 1e-320], gamma, 0.3) >= 0


@pytest.mark.parametrize("gamma", [1.501, 2.0, np.inf])
def test_normal_incidence_and_flat_surfaces(gamma):
    assert smith.smith_lambda([0.0, 0.0, 1.0], gamma, 0.5) == 0
    assert smith.g1([0.0, 0.0, 1.0], gamma, 0.5) == 1
    w = direction([0, 45, 89.9999])
    np.testing.assert_array_equal(smith.smith_lambda(w, gamma, 0.0), 0)
    np.testing.assert_array_equal(smith.g1(w, gamma, 0.0), 1)
    assert smith.smith_lambda([1.0, 0.0, 0.0], gamma, 0.0) == np.inf


def test_no_number_stays_no_number():
    """A direction that is not one must not come back as a masking of 0 or 1."""
    assert np.isnan(smith.smith_lambda([np.nan, 0.0, 0.5], 2.0, 0.5))


def projected_area(gamma, sigma, theta):
    """∫ G1 ⟨w, m⟩ D dm by quadrature over slopes: G1 times the area that faces w.

    Polar in slopes; the azimuth in closed form, ln r by Gauss-Legendre with the
    square-root kink at r tanθ = 1 taken out by y = y_0 ± s².
    """
    sine, cosine = np.sin(theta), np.cos(theta)
    x, weights = np.polynomial.legendre.leggauss(24)

    def ring(r):
        """∫ ⟨w, m⟩/m_z dφ at |slope| = r."""
        steep = np.maximum(r * sine, cosine)
        border = np.arccos(cosine / steep)
        return 2 * (np.pi - border) * cosine + 2 * steep * np.sin(border) * (r * sine > cosine)

    def side(length, sign):
        edges = np.linspace(0, np.sqrt(length), 2 + int(4 * np.sqrt(length)) + int(length))
        half = np.diff(edges)[:, None] / 2
        s = edges[:-1, None] + half * (1 + x)
        r = np.exp(np.log(cosine / sine) + sign * s**2)
        density = student_t.slope_density(r, 0.0, gamma, sigma)
        return np.sum(half * weights * 2 * s * r**2 * density * ring(r))

    kink = np.log(cosine / sine / sigma)
    # Outside lie e^(−2·22) below and (e^160)^(−(2γ−3)) above.
    return side(max(kink, 0) + 22, -1) + side(max(-kink, 0) + 160, 1)


@pytest.mark.parametrize("gamma", [1.65, 1.75, 2.0, 2.5, 8.0, 40.0, 1e6, np.inf])
@pytest.mark.parametrize(("sigma", "theta"), [(0.1, 30), (0.5, 60), (0.5, 89), (3.0, 80), (10, 5)])
def test_masking_conserves_projected_area(gamma, sigma, theta):
    """Heitz 2014, eq. 15: the identity that ties G1 to D for any heightfield."""
    w = direction(theta)
    seen = float(smith.g1(w, gamma, sigma)) * projected_area(gamma, sigma, np.radians(theta))
    assert seen == pytest.approx(w[2], rel=1e-12)


def test_masking_of_another_gamma_does_not_conserve_projected_area():
    seen = float(smith.g1(direction(60), 2.01, 0.5)) * projected_area(2.0, 0.5, np.radians(60))
    assert abs(seen / 0.5 - 1) > 1e-5


def test_anisotropic_lambda_is_the_backfacing_area():
    """Λ cosθ = ∫ (p·w − cosθ)₊ P(p, q) dp dq, in the frame that turns with the azimuth."""
    gamma, sigma_x, sigma_y, theta, phi = 3.0, 0.2, 0.9, 75.0, 35.0
    w = direction(theta, phi)
    along = np.array([np.cos(np.radians(phi)), np.sin(np.radians(phi))])
    across = np.array([-along[1], along[0]])
    y = np.linspace(-40, 40, 2001)
    v = np.sinh(y) * 0.1
    sine, cosine = np.hypot(w[0], w[1]), w[2]
    x, weights = np.polynomial.legendre.leggauss(16)
    edges = np.arange(-30, 14)  # in ln of the slope beyond cotθ; falls as its −3rd power
    z = (edges[:-1, None] + (1 + x) / 2).ravel()
    rise = np.exp(z)[:, None]
    u = cosine / sine + rise
    p, q = u * along[0] + v * across[0], u * along[1] + v * across[1]
    density = student_t.slope_density(p, q, gamma, sigma_x, sigma_y) * np.cosh(y) * 0.1
    inner = density.sum(axis=1) * (y[1] - y[0])
    backfacing = np.sum(np.tile(weights, len(edges) - 1) / 2 * rise[:, 0] ** 2 * sine * inner)
    expected = backfacing / cosine
    # What lies beyond e^13 is e^(−3·13) ≈ 1e−17 of 1.
    value = float(smith.smith_lambda(w, gamma, sigma_x, sigma_y))
    assert value == pytest.approx(expected, rel=1e-12)


def test_anisotropy_is_stretching():
    w = direction(70, np.array([0, 20, 45, 90, 200]))
    stretched = w * [0.2, 0.9, 1.0]
    stretched /= np.linalg.norm(stretched, axis=-1, keepdims=True)
    np.testing.assert_allclose(
        smith.smith_lambda(w, 2.5, 0.2, 0.9), smith.smith_lambda(stretched, 2.5, 1.0), rtol=64 * EPS
    )
    # Along an axis only that axis' roughness counts.
    assert smith.smith_lambda(direction(70, 0), 2.5, 0.2, 0.9) == smith.smith_lambda(
        direction(70, 0), 2.5, 0.2
    )
    np.testing.assert_allclose(smith.projected_roughness(direction(90, 90), 0.2, 0.9), 0.9)


directions = st.tuples(st.floats(0, 89.99999), st.floats(0, 360)).map(lambda a: direction(*a))
gammas = st.floats(1.501, 1e9) | st.just(np.inf)
sigmas = st.floats(1e-4, 10)


@given(directions, directions, gammas, sigmas, sigmas)
def test_g2(i, o, gamma, sigma_x, sigma_y):
    both = smith.smith_lambda(np.stack([i, o]), gamma, sigma_x, sigma_y)
    one = smith.g1(np.stack([i, o]), gamma, sigma_x, sigma_y)
    separable = smith.g2_separable(i, o, gamma, sigma_x, sigma_y)
    correlated = smith.g2_height_correlated(i, o, gamma, sigma_x, sigma_y)
    assert separable == one[0] * one[1]
    assert float(correlated) == pytest.approx(1 / (1 + both[0] + both[1]), rel=8 * EPS)
    # More is seen than if the heights had nothing to do with each other, less than one way.
    assert separable <= correlated * (1 + 8 * EPS)
    assert correlated <= one.min() * (1 + 8 * EPS)
    # Reciprocity holds to the last bit.
    assert separable == smith.g2_separable(o, i, gamma, sigma_x, sigma_y)
    assert correlated == smith.g2_height_correlated(o, i, gamma, sigma_x, sigma_y)


def test_g2_at_and_below_the_horizon():
    i = direction([30, 30, 100])
    o = direction([90.0, 120, 40])
    o[0] = [1.0, 0.0, 0.0]
    np.testing.assert_array_equal(smith.g2_height_correlated(i, o, 2.0, 0.5), 0)
    np.testing.assert_array_equal(smith.g2_separable(i, o, 2.0, 0.5), 0)


@given(directions, gammas, sigmas, sigmas)
def test_nothing_is_lost_in_the_whole_box(w, gamma, sigma_x, sigma_y):
    value = smith.smith_lambda(w, gamma, sigma_x, sigma_y)
    assert np.isfinite(value)
    assert value >= 0
    assert 0 < smith.g1(w, gamma, sigma_x, sigma_y) <= 1


@given(gammas, st.floats(1e-4, 10), st.floats(0, 89.9))
def test_lambda_falls_towards_the_normal(gamma, sigma, theta):
    """Across the borders of the three forms too, beyond rounding."""
    values = smith.smith_lambda(direction(np.array([theta, theta + 0.01])), gamma, sigma)
    assert values[0] <= values[1]


@pytest.mark.parametrize(
    ("gamma", "sigma", "named"),
    [(1.5, 0.5, r"gamma = 1\.5"), (np.nan, 0.5, "gamma = nan"), (2.0, -0.1, "sigma"),
     (2.0, np.inf, "sigma"), (2.0, np.nan, "sigma")],
)  # fmt: skip
def test_bad_values_are_named(gamma, sigma, named):
    for call in (smith.smith_lambda, smith.g1):
        with pytest.raises(ValueError, match=named) as caught:
            call([0.0, 0.0, 1.0], gamma, sigma)
        assert "\n" not in str(caught.value)
