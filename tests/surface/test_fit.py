import os
from pathlib import Path

import numpy as np
import pytest
from judge import rate
from scipy.optimize import minimize

from microsurf.errors import InputError
from microsurf.physics import student_t
from microsurf.surface import Heightfield, facet_slopes, fit_std, generate_surface, level
from microsurf.surface.gaussian_field import gaussian_field
from microsurf.surface.heightfield import slopes_of_both_splits
from microsurf.surface.slope_likelihood import maximise
from microsurf.surface.statistics import ks_distance

DATA = os.environ.get("MICROSURF_DATA")


def log_likelihood(h, gamma, sigma):
    p, q, _ = slopes_of_both_splits(h)
    return np.mean(np.log(student_t.slope_density(p, q, gamma, sigma)))


@pytest.mark.parametrize("gamma", [1.75, 3.0, 20.0])
def test_agrees_with_a_direct_search(gamma):
    h = generate_surface(gamma, 0.3, cells=(48, 64), seed=15, iterations=3)
    fit = fit_std(h)
    found = minimize(
        lambda t: -log_likelihood(h, 1 + np.exp(t[0]), np.exp(t[1])),
        [np.log(gamma - 1), np.log(0.3)],
        method="Nelder-Mead",
        options={"xatol": 1e-7, "fatol": 1e-13, "maxiter": 2000},
    )
    # η to 1e-6 by the bounded search; σ follows it.
    assert fit.gamma == pytest.approx(1 + np.exp(found.x[0]), rel=1e-3)
    assert fit.sigma == pytest.approx(np.exp(found.x[1]), rel=1e-4)
    assert -found.fun == pytest.approx(log_likelihood(h, fit.gamma, fit.sigma), abs=1e-9)


@pytest.mark.parametrize("gamma", [1.75, 2.0, 5.0])
def test_recovers_what_was_generated(gamma):
    """KS < 1e-3 by construction: γ and σ within 2 % and 0.5 %, far inside a sample's scatter."""
    fit = fit_std(generate_surface(gamma, 0.5, cells=(256, 320), spacing=0.1, seed=16))
    assert fit.gamma == pytest.approx(gamma, rel=0.02)
    assert fit.sigma == pytest.approx(0.5, rel=0.005)
    assert fit.ks < 1e-3
    assert fit.gamma_ci[0] < fit.gamma < fit.gamma_ci[1]
    assert fit.sigma_ci[0] < fit.sigma < fit.sigma_ci[1]
    assert (fit.pixel, fit.shortest, fit.longest) == (0.1, 0.2, 32.0)
    assert fit.facets == 2 * 256 * 320
    assert fit.effective_facets < fit.facets / 10


def test_a_gaussian_surface_fits_infinite_gamma():
    fit = fit_std(generate_surface(np.inf, 0.5, cells=(256, 320), seed=17))
    assert fit.gamma == fit.gamma_ci[1] == np.inf
    assert fit.gamma_ci[0] > 20
    assert fit.sigma == pytest.approx(0.5, rel=1e-3)


def with_a_plateau(share):
    heights = np.array(generate_surface(2.0, 0.5, cells=64, seed=1).heights)
    rows = round(share * 64)
    heights[:rows] = 0
    return Heightfield(heights)


@pytest.mark.parametrize("share", [0.04, 0.05, 0.09, 0.12, 0.18])
def test_flat_facets_leave_an_inner_maximum(share):
    """The likelihood is unbounded as σ → 0: the fit is the maximum inside, by a direct search."""
    h = with_a_plateau(share)
    fit = fit_std(h)
    slopes = np.hypot(*facet_slopes(h))
    assert fit.flat == np.mean(slopes == 0) > 0
    found = minimize(
        lambda t: -log_likelihood(h, 1 + np.exp(t[0]), np.exp(t[1])),
        [0.0, np.log(0.4)],
        method="Nelder-Mead",
        options={"xatol": 1e-7, "fatol": 1e-13, "maxiter": 2000},
    )
    assert 1 / (fit.gamma - 1) < (1 - fit.flat) / fit.flat
    assert fit.gamma == pytest.approx(1 + np.exp(found.x[0]), rel=1e-3)
    assert fit.sigma == pytest.approx(np.exp(found.x[1]), rel=1e-3)
    assert np.isfinite([*fit.sigma_ci, fit.ks, fit.effective_facets]).all()


def test_a_corner_of_zeros_has_a_finite_fit():
    heights = np.random.default_rng(0).normal(size=(8, 8))
    heights[:4, :4] = 0
    fit = fit_std(Heightfield(heights))
    assert np.isfinite([fit.gamma, fit.sigma, *fit.sigma_ci]).all()
    assert fit.gamma_ci[0] < fit.gamma < fit.gamma_ci[1]  # 64 cells do not exclude Beckmann


@pytest.mark.parametrize("share", [0.3, 0.45])
@pytest.mark.parametrize("tilt", [0.0, 1e-12])
def test_too_many_flat_facets_are_refused(share, tilt):
    """Rounding that gives a plateau slopes of 1e-12 makes it none the less one."""
    h = with_a_plateau(share)
    rough = Heightfield(h.heights + tilt * np.random.default_rng(2).normal(size=(64, 64)))
    with pytest.raises(InputError, match=r"facets \(\d\d\.\d%\) are flat.*plateau.*Cut it out"):
        fit_std(rough)


def test_a_fit_at_the_end_of_the_search_is_none():
    """Slopes over fourteen decades have no STD: γ = 1.05 is where the search ends, not a result."""
    decades = np.random.default_rng(3).uniform(-7, 7, (32, 32))
    with pytest.raises(InputError, match=r"tail is heavier.*γ > 1\.05.*spikes"):
        fit_std(Heightfield(10.0**decades))


def test_slopes_that_are_all_the_same_are_refused():
    tilted = 0.3 * np.arange(40.0) + np.zeros((40, 1))
    with pytest.raises(InputError, match="level the surface"):
        fit_std(Heightfield(tilted, boundary="mirror"))


def test_intervals_hold_what_they_promise(judge):
    """σ of 100 Gaussian fields: 95 % intervals must cover it in 93 % (64 tiles, not more).

    Negative control: as if facets were independent.
    """
    rng = np.random.default_rng(judge.seed(18))
    fits = [
        fit_std(Heightfield(gaussian_field(rng.standard_normal((128, 160)), 4.0, 1.0, 1.0)))
        for _ in range(100)
    ]
    sigma = np.sqrt(np.mean([f.sigma**2 for f in fits]))
    judge.keeps(rate(sum(f.sigma_ci[0] < sigma < f.sigma_ci[1] for f in fits), 100, 0.93, 1.0))
    narrow = [
        abs(np.log(f.sigma / sigma))
        < np.log(f.sigma_ci[1] / f.sigma) * np.sqrt(f.effective_facets / f.facets)
        for f in fits
    ]
    judge.catches(rate(sum(narrow), 100, 0.93, 1.0))


def test_what_cannot_be_fitted_is_refused():
    with pytest.raises(InputError, match="flat"):
        fit_std(Heightfield(np.zeros((20, 20))))
    with pytest.raises(InputError, match="larger surface"):
        fit_std(generate_surface(2.0, 0.5, cells=(4, 6)))


@pytest.mark.skipif(not DATA, reason="set MICROSURF_DATA to the folder of measured surfaces")
@pytest.mark.parametrize(
    ("name", "spacing", "gamma", "sigma", "ks"),
    [
        ("di-4", 0.0195, 3.25, 0.132, 0.003),
        ("di-3", 0.039, 2.57, 0.124, 0.020),
        ("al3d-1", 0.438, 6.1, 0.080, 0.008),
        ("example_ps", 0.00195, 11.7, 0.367, 0.005),
    ],
)
def test_measured_surfaces_against_published_fits(name, spacing, gamma, sigma, ks):
    """Another's isotropic fits of the same facets: in our intervals, no more likely than ours."""
    heights = np.load(Path(str(DATA)) / "topography" / f"{name}.npy")
    h = level(Heightfield(heights, spacing, "mirror"), "quadratic")
    fit = fit_std(h)
    assert fit.gamma_ci[0] < gamma < fit.gamma_ci[1]
    assert fit.sigma == pytest.approx(sigma, rel=0.03)
    facets = facet_slopes(h)  # theirs are split by one diagonal
    one = maximise(*facets, isotropic=True)
    ours = 1 + 1 / one.eta, float(np.sqrt(one.scatter[0, 0]))
    density = [
        np.mean(np.log(student_t.slope_density(*facets, *law))) for law in (ours, (gamma, sigma))
    ]
    assert density[0] >= density[1]
    rho = np.sort(np.hypot(*facets).ravel()) / ours[1]
    assert ks_distance(rho, ours[0]) == pytest.approx(ks, abs=0.0015)
