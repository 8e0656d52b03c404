import numpy as np
import pytest
from judge import distant, rate
from scipy import stats
from scipy.optimize import minimize

from microsurf.errors import InputError
from microsurf.surface import Heightfield, facet_slopes, fit_std, generate_surface
from microsurf.surface.heightfield import slopes_of_both_splits
from microsurf.surface.slope_likelihood import FEW_TILES, covariance, maximise
from validation.coverage.axes import facet_azimuth, turned


@pytest.mark.parametrize("azimuth", [0.0, 17.0, 45.0, -30.0])
@pytest.mark.parametrize("gamma", [np.inf, 2.5])
def test_axes_of_a_lay(azimuth, gamma):
    """Axes, their ratio and γ; at a slant of 45° either axis may be the nearer to x."""
    fit = fit_std(turned(512, (6.0, 12.0), azimuth, np.random.default_rng(61), gamma))
    off = (fit.azimuth - azimuth + 45) % 90 - 45
    reach = (fit.azimuth_ci[1] - fit.azimuth_ci[0]) / 2
    assert abs(off) < 2 * reach  # 1 in 10 000 of so many is further off
    assert reach < 5
    ratio = max(fit.sigma_x, fit.sigma_y) / min(fit.sigma_x, fit.sigma_y)
    assert ratio == pytest.approx(2, rel=0.1)
    if abs(azimuth) < 40:
        assert fit.sigma_x > fit.sigma_y
    assert fit.gamma > 20 if gamma == np.inf else fit.gamma == pytest.approx(2.5, rel=0.25)
    assert not fit.isotropic


def test_intervals_of_the_azimuth_hold(judge):
    """Over 60 small fields; negative control: as if facets were independent."""
    rng = np.random.default_rng(judge.seed(62))
    fits = [fit_std(turned(96, (4.0, 8.0), 17.0, rng)) for _ in range(60)]
    inside = [f.azimuth_ci[0] < 17 < f.azimuth_ci[1] for f in fits]
    judge.keeps(rate(sum(inside), 60, 0.88, 1.0))
    narrow = [
        abs(f.azimuth - 17) < (f.azimuth_ci[1] - f.azimuth) * np.sqrt(f.effective_facets / f.facets)
        for f in fits
    ]
    judge.catches(rate(sum(narrow), 60, 0.88, 1.0))


@pytest.mark.parametrize("gamma", [np.inf, 2.5])
def test_axes_of_facets_lean_and_the_fit_does_not(judge, gamma):
    """By what theory says of differences over a cell; negative control: no lean at all."""
    rng = np.random.default_rng(judge.seed(72))
    expected = facet_azimuth((6.0, 12.0), 17.0) - 17.0
    leans = []
    for _ in range(8):
        h = turned(128, (6.0, 12.0), 17.0, rng, gamma)
        p, q, _ = slopes_of_both_splits(h)
        top = maximise(p, q).scatter
        facets = np.degrees(np.arctan2(2 * top[0, 1], top[0, 0] - top[1, 1]) / 2)
        leans.append(facets - fit_std(h).azimuth)
    error = np.std(leans, ddof=1) / np.sqrt(len(leans))
    # Theory is that of γ = ∞, and differences of fourth order leave the sixth.
    judge.near(np.mean(leans), expected, error, dof=7, within=0.05)
    judge.catches(distant(np.mean(leans), 0.0, error, 7, 0.05), 1e-3)


def test_a_lay_of_an_oblong_pixel_has_its_own_azimuth(judge):
    """Every second row of a lay: differences over two cells along y lean more, slopes do not."""
    rng = np.random.default_rng(judge.seed(73))
    offs = []
    for _ in range(8):
        h = turned(192, (8.0, 16.0), 17.0, rng)
        oblong = fit_std(Heightfield(h.heights[::2], (1.0, 2.0), "mirror"))
        offs.append(oblong.azimuth - fit_std(h).azimuth)
    error = np.std(offs, ddof=1) / np.sqrt(len(offs))
    judge.near(np.mean(offs), 0.0, error, dof=7, within=0.1)


@pytest.mark.long
def test_narrow_maps_count_correlation_areas(judge):
    """Cut-outs 6 lengths wide; negative control: what their quarters alone say."""
    whole = generate_surface(2.5, 0.3, cells=768, seed=judge.seed(74)).heights
    parts = [whole[y : y + 48, x : x + 48] for y in range(0, 768, 48) for x in range(0, 768, 48)]
    held, quarters = 0, 0
    for part in parts:
        h = Heightfield(part, boundary="mirror")
        fit = fit_std(h)
        held += fit.gamma_ci[0] < 2.5 < fit.gamma_ci[1]
        p, q, _ = slopes_of_both_splits(h)
        top = maximise(p, q, isotropic=True)
        cov, _, dof = covariance(p, q, top, None, FEW_TILES)
        quarters += abs(top.eta - 1 / 1.5) < stats.t.ppf(0.975, dof) * np.sqrt(cov[0, 0])
    judge.keeps(rate(held, len(parts), 0.9, 0.99))
    judge.catches(rate(quarters, len(parts), 0.9, 0.99), 1e-2)


def test_isotropic_surfaces_have_no_direction(judge):
    """At the level of 0.01 one in a hundred may be called directed."""
    rng = np.random.default_rng(judge.seed(63))
    fits = [fit_std(turned(96, (5.0, 5.0), 0.0, rng)) for _ in range(60)]
    judge.keeps(rate(sum(not f.isotropic for f in fits), 60, 0.0, 0.05))
    directed = [fit_std(turned(96, (5.0, 7.0), 0.0, rng)) for _ in range(20)]
    judge.catches(rate(sum(not f.isotropic for f in directed), 20, 0.0, 0.05))


def test_the_general_fit_agrees_with_a_direct_search():
    h = turned(64, (3.0, 6.0), 20.0, np.random.default_rng(65), 2.5)
    p, q = (slopes.ravel() for slopes in facet_slopes(h))
    found = maximise(p, q)

    def negative(at):
        eta, s = np.exp(at[0]), np.exp(at[1:3])
        r = np.tanh(at[3])
        rho2 = ((p / s[0]) ** 2 - 2 * r * p * q / (s[0] * s[1]) + (q / s[1]) ** 2) / (1 - r * r)
        half = np.log(s[0] * s[1]) + np.log(1 - r * r) / 2
        return half + (1 + 1 / eta) * np.mean(np.log1p(eta * rho2))

    start = [np.log(0.5), np.log(p.std()), np.log(q.std()), 0.0]
    options = {"xatol": 1e-8, "fatol": 1e-13, "maxiter": 4000, "maxfev": 4000}
    direct = minimize(negative, start, method="Nelder-Mead", options=options)
    assert found.eta == pytest.approx(np.exp(direct.x[0]), rel=1e-4)
    s, r = np.exp(direct.x[1:3]), np.tanh(direct.x[3])
    expected = [[s[0] ** 2, r * s[0] * s[1]], [r * s[0] * s[1], s[1] ** 2]]
    np.testing.assert_allclose(found.scatter, expected, rtol=1e-4)


def test_noise_has_no_lay():
    """Facets of one diagonal lie along it (negative control); a mirrored lay is mirrored."""
    noise = Heightfield(np.random.default_rng(69).normal(size=(128, 128)), boundary="mirror")
    assert fit_std(noise).isotropic
    one = maximise(*facet_slopes(noise)).scatter
    assert one[0, 1] < -0.3 * one[0, 0]
    lay = turned(128, (4.0, 8.0), 20.0, np.random.default_rng(70)).heights
    both = [fit_std(Heightfield(h, boundary="mirror")) for h in (lay, lay[:, ::-1])]
    assert both[0].azimuth == pytest.approx(-both[1].azimuth, abs=1e-3)
    assert both[0].gamma == pytest.approx(both[1].gamma, rel=1e-4)


def test_filled_points_have_no_say():
    made = generate_surface(2.5, 0.3, cells=160, seed=66)
    filled = np.zeros((160, 160), dtype=bool)
    filled[30:60, 50:90] = True
    spoilt = made.heights + 100 * filled
    fit = fit_std(Heightfield(spoilt, filled=filled))
    assert fit.gamma_ci[0] < 2.5 < fit.gamma_ci[1]
    assert fit.sigma_ci[0] < 0.3 < fit.sigma_ci[1]
    assert fit.facets < 2 * 160**2
    assert fit_std(Heightfield(spoilt)).gamma < 2.45


def test_an_oblong_pixel_stretches_along_one_axis():
    """Heights and dx doubled: the slope along y doubles, that along x stays."""
    made = generate_surface(2.5, 0.3, cells=160, seed=67)
    fit = fit_std(Heightfield(2 * made.heights, (2.0, 1.0)))
    assert fit.sigma_x == pytest.approx(0.3, rel=0.05)
    assert fit.sigma_y == pytest.approx(0.6, rel=0.05)
    assert fit.azimuth_ci[0] < 0 < fit.azimuth_ci[1]
    assert fit.gamma == pytest.approx(2.5, rel=0.05)


def test_slopes_along_one_line_are_refused():
    with pytest.raises(InputError, match="along one line"):
        fit_std(Heightfield(np.sin(np.arange(64) * np.pi / 8) ** 3 + np.zeros((64, 1))))


def test_rotation_by_a_right_angle_turns_the_azimuth():
    made = turned(128, (4.0, 8.0), 20.0, np.random.default_rng(71))
    one, other = fit_std(made), fit_std(Heightfield(made.heights.T))
    assert other.sigma_y == pytest.approx(one.sigma_x, rel=1e-4)
    assert other.azimuth == pytest.approx(-one.azimuth, abs=1e-2)
