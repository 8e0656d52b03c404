import json

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import spearmanr

from microsurf.errors import InputError
from microsurf.physics import student_t
from microsurf.surface import Heightfield, facet_slopes, generate_surface, surface_statistics
from microsurf.surface.statistics import _area_beyond, ks_distance, mean_area


def area_closed_form(gamma, sigma):
    """E√(1+r²) by parts as an Euler integral, in 30 digits; erfc at γ = ∞."""
    with mp.workdps(30):
        sigma = mp.mpf(sigma)
        if gamma == np.inf:
            inside = mp.exp(1 / sigma**2) * mp.erfc(1 / sigma)
            return float(1 + sigma * mp.sqrt(mp.pi) / 2 * inside)
        k = mp.mpf(gamma) - 1
        c = k * sigma**2
        return float(1 + c / (2 * k - 1) * mp.hyp2f1(0.5, 1, k + mp.mpf(1) / 2, 1 - c))


@pytest.mark.parametrize("gamma", [1.51, 1.75, 2.0, 8.0, 300.0, np.inf])
@pytest.mark.parametrize("sigma", [0.01, 0.5, 5.0])
def test_mean_area_against_its_closed_form(gamma, sigma):
    # quad was asked for 1e-10; near 3/2 the integrand's exponent a = 51 costs two digits.
    assert mean_area(gamma, sigma, sigma) == pytest.approx(area_closed_form(gamma, sigma), rel=1e-8)


def test_anisotropic_area_averages_over_azimuth():
    by_azimuth = lambda phi: area_closed_form(  # noqa: E731
        2.0, float(np.hypot(0.5 * np.cos(phi), 0.1 * np.sin(phi)))
    )
    expected = quad(by_azimuth, 0, np.pi / 2, epsrel=1e-10)[0] * 2 / np.pi
    assert mean_area(2.0, 0.5, 0.1) == pytest.approx(expected, rel=1e-8)


def test_area_beyond_against_sampled_facets(judge):
    """4e5 draws; the ratio's own standard error."""
    p, q = student_t.sample_slopes(np.random.default_rng(judge.seed(12)), 400_000, 4.0, 0.5, 0.2)
    area = np.sqrt(1 + p**2 + q**2)
    beyond = np.hypot(p / 0.5, q / 0.2) > 1.5
    share = float(np.sum(area * beyond) / np.sum(area))
    se = np.std(area * (beyond - share)) / area.mean() / np.sqrt(area.size)
    judge.near(_area_beyond(1.5, 4.0, 0.5, 0.2), share, se)
    # Negative control: the other axis' roughness alone is off by more.
    judge.tells(student_t.area_beyond(1.5 * 0.5, 4.0, 0.5), share, se)


def test_ks_distance_by_hand():
    """Three values at quantiles 0.1, 0.5, 0.6: the largest gap is 1 − 0.6 after the last."""
    rho = student_t.slope_quantile([0.1, 0.5, 0.6], 2.0)
    assert ks_distance(rho, 2.0) == pytest.approx(0.4, abs=1e-12)


def test_a_tilted_plane_by_hand():
    """Slopes (0.3, 0.4) everywhere, in a unit of 0.1 a cell."""
    y, x = np.indices((5, 9)) * 0.1
    h = Heightfield(0.3 * x + 0.4 * y, 0.1, "mirror")
    found = surface_statistics(h, 2.0, 0.5)
    assert found["tail"]["max_slope"] == pytest.approx(0.5)
    assert found["Sdq"] == pytest.approx(0.5)
    assert found["Sdr"] == pytest.approx(np.sqrt(1.25) - 1)
    assert found["gradient"] == "facet"
    assert found["harmonics"] == pytest.approx(
        {"cos1": 0.6, "sin1": 0.8, "cos2": -0.28, "sin2": 0.96}
    )
    # ρ = 1 for all: F(1) = 1/2 at γ = 2, so both steps are half away.
    assert found["ks"] == pytest.approx(0.5, abs=1e-2)
    assert found["quantiles"]["0.5"] == pytest.approx(0.0, abs=1e-12)
    deviation = h.heights - h.heights.mean()
    assert found["Sq"] == pytest.approx(deviation.std())
    assert found["Sa"] == pytest.approx(np.abs(deviation).mean())


def test_correlation_length_of_a_cosine():
    wave = np.cos(2 * np.pi * np.arange(100) / 100)
    found = surface_statistics(Heightfield(np.add.outer(wave[::2], wave)), 2.0, 0.5)
    # Autocorrelation (1 + cos kd)/2, k = 2π/period. Linear between cells: off by at most
    # f″/(8f′) = k (1 − 2/e)/(8 · 0.96), 0.0022 cells along x and 0.0043 along y.
    expected = 100 * np.arccos(2 / np.e - 1) / (2 * np.pi)
    assert found["correlation_x"] == pytest.approx(expected, abs=0.0022)
    assert found["correlation_y"] == pytest.approx(expected / 2, abs=0.0043)
    assert found["correlation"] == pytest.approx(expected / np.sqrt(2), abs=0.0043)


def test_a_generated_surface_meets_its_law_and_json():
    h = generate_surface(np.inf, 0.5, cells=(256, 384), spacing=0.25, seed=13)
    found = surface_statistics(h, np.inf, 0.5)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["ks"] < 1e-3
    assert max(abs(e) for e in found["quantiles"].values()) < 0.01
    # Gaussian slopes: rms = σ, area in closed form; the KS distance bounds both to 1e-3.
    assert found["Sdq"] == pytest.approx(0.5, rel=1e-3)
    assert found["Sdr"] + 1 == pytest.approx(area_closed_form(np.inf, 0.5), rel=1e-3)
    assert found["tail"]["area_of_mesh"] == pytest.approx(1, abs=1e-3)
    assert found["tail"]["area_beyond"] < 1e-4
    # L = 8 up to the scatter of 1500 correlated areas.
    assert found["correlation"] == pytest.approx(8, rel=0.1)
    # Negative control: judged against GGX.
    assert surface_statistics(h, 2.0, 0.5)["ks"] > 0.05


def test_lengths_scale_with_the_unit_and_slopes_do_not():
    one = generate_surface(3.0, 0.5, cells=(40, 60), seed=14)
    big = generate_surface(3.0, 0.5, cells=(40, 60), seed=14, spacing=4.0)
    a, b = surface_statistics(one, 3.0, 0.5), surface_statistics(big, 3.0, 0.5)
    assert (b.pop("Sq"), b.pop("Sa")) == (4 * a.pop("Sq"), 4 * a.pop("Sa"))
    assert a == b


def test_a_flat_surface_has_nothing_to_compare():
    found = surface_statistics(generate_surface(2.0, 0.0, cells=(4, 6)), 2.0, 0.0)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["ks"] == found["Sdr"] == found["tail"]["area_beyond"] == 0
    assert found["quantiles"]["0.5"] is found["correlation"] is None
    rough = surface_statistics(generate_surface(2.0, 0.5, cells=(4, 6)), 2.0, 0.0)
    assert rough["ks"] == 1


def test_a_law_of_infinite_area_is_refused():
    with pytest.raises(InputError, match=r"gamma = 1\.5"):
        surface_statistics(generate_surface(2.0, 0.5, cells=(4, 6)), 1.5, 0.5)


def cones(boundary):
    """A quarter of a pyramid of stairs, steeper step by step: the steepest facet is the highest."""
    rise = np.arange(6.0) ** 2
    return Heightfield(np.add.outer(rise, rise), boundary=boundary)


def test_height_slope_by_hand():
    """Convex: steepness rises with height along every path; its negative is the opposite.

    Both coefficients against scipy's, from facets listed one by one.
    """
    h = cones("mirror").heights
    slope, height = [], []
    for y in range(5):
        for x in range(5):
            lower = [h[y, x], h[y, x + 1], h[y + 1, x + 1]]
            upper = [h[y, x], h[y + 1, x + 1], h[y + 1, x]]
            slope += [np.hypot(lower[1] - lower[0], lower[2] - lower[1])]
            slope += [np.hypot(upper[1] - upper[2], upper[2] - upper[0])]
            height += [np.sum(lower), np.sum(upper)]
    distance = np.abs(np.array(height) - np.median(height))
    expected = [spearmanr(slope, level).statistic for level in (height, distance)]
    found = surface_statistics(cones("mirror"), 2.0, 0.5)["height_slope"]
    assert list(found.values()) == pytest.approx(expected, abs=1e-12)
    assert found["height"] > 0.9
    upside_down = surface_statistics(Heightfield(-h, boundary="mirror"), 2.0, 0.5)["height_slope"]
    assert upside_down["height"] == pytest.approx(-found["height"], abs=1e-12)


def test_height_slope_of_a_flat_surface_is_nothing():
    flat = surface_statistics(generate_surface(2.0, 0.0, cells=(4, 6)), 2.0, 0.0)
    assert flat["height_slope"] == {"height": None, "distance": None}


def test_height_slope_of_large_meshes_takes_a_part_of_the_facets():
    """2 × 2049 cells, every third one: 680 correlated facets tell it to 0.05 or so."""
    made = generate_surface(3.0, 0.5, cells=(2, 2049), structure="tops", seed=3)
    found = surface_statistics(made, 3.0, 0.5)["height_slope"]["height"]
    p, q = facet_slopes(made)
    h = np.pad(made.heights, ((0, 1), (0, 1)), mode="wrap")
    ends = h[:-1, :-1] + h[1:, 1:]
    height = np.stack([ends + h[:-1, 1:], ends + h[1:, :-1]])
    every = spearmanr(np.hypot(p, q).ravel(), height.ravel()).statistic
    assert found != every
    assert found == pytest.approx(every, abs=0.15)


def test_what_was_filled_has_no_say():
    made = generate_surface(2.5, 0.3, cells=128, seed=51)
    filled = np.zeros((128, 128), dtype=bool)
    filled[40:80, 10:100] = True
    spoilt = made.heights + 50 * filled
    found = surface_statistics(Heightfield(spoilt, 1.0, filled=filled), 2.5, 0.3)
    whole = surface_statistics(made, 2.5, 0.3)
    for name in ("Sq", "Sa", "Sdq", "Sdr"):
        assert found[name] == pytest.approx(whole[name], rel=0.1)
    assert found["ks"] < 0.02
    assert found["tail"]["max_slope"] <= whole["tail"]["max_slope"]
    assert surface_statistics(Heightfield(spoilt), 2.5, 0.3)["Sq"] > 5 * whole["Sq"]
    with pytest.raises(InputError, match="three measured corners"):
        surface_statistics(Heightfield(spoilt, filled=np.ones((128, 128))), 2.5, 0.3)


def test_oblong_pixels_have_their_own_slopes():
    """Heights doubled with dx alone: the slope along y doubles."""
    made = generate_surface(2.5, 0.3, cells=64, seed=52)
    stretched = Heightfield(2 * made.heights, (2.0, 1.0))
    ours = surface_statistics(stretched, 2.5, 0.3, 0.6)
    whole = surface_statistics(made, 2.5, 0.3)
    assert ours["ks"] == pytest.approx(whole["ks"], abs=1e-12)
    assert ours["correlation_x"] == pytest.approx(whole["correlation_x"])
