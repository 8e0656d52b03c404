"""What is imposed is checked by quadrature; what is made, by the law that it should obey."""

import json
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from microsurf.scene import STRUCTURES
from microsurf.surface import facet_slopes, from_recipe, generate_surface, surface_statistics
from microsurf.surface.structures import impose

TIED = STRUCTURES[1:]


def steepness(g, gamma, structure):
    """F' by scipy's own distributions, not by the functions behind them."""
    uniform = {
        "tops": stats.norm.sf(g),
        "middle": stats.chi.cdf(abs(g), 1),
        "extremes": stats.chi.sf(abs(g), 1),
    }[structure]
    return np.sqrt((gamma - 1) / stats.gamma.ppf(uniform, gamma - 1))


def standard(shape=(48, 64), seed=1):
    field = np.random.default_rng(seed).standard_normal(shape)
    return (field - field.mean()) / field.std()


@pytest.mark.parametrize("structure", TIED)
@pytest.mark.parametrize("gamma", [1.51, 2.0, 40.0])
def test_heights_are_the_integral_of_the_steepness(structure, gamma):
    """Between five quantiles of g, across 0 too; the table's error is below 1e-8 of each."""
    g = standard()
    h = impose(3.0 * g + 7.0, gamma, structure)  # any scale, any mean
    order = np.argsort(g, axis=None)
    g, h = g.ravel()[order], h.ravel()[order]
    assert abs(h.mean()) < 1e-9 * np.ptp(h)
    places = [3, 500, 1400, 2600, 3068]
    for a, b in pairwise(places):
        inside = [0.0] if g[a] < 0 < g[b] else None
        expected = quad(
            steepness, g[a], g[b], (gamma, structure), points=inside, epsrel=1e-9, limit=400
        )[0]
        # quad itself is good to some 1e-6 where F' has a pole |g|^-0.98.
        rel = 1e-5 if structure == "middle" and gamma < 2 else 1e-7
        assert h[b] - h[a] == pytest.approx(expected, rel=rel)


@pytest.mark.parametrize("structure", TIED)
@pytest.mark.parametrize("gamma", [1.5000001, 1.501, 1e9])
def test_extremes_of_gamma_stay_finite_and_monotone(structure, gamma):
    g = standard()
    g[0, :3] = 0.0, 1e-300, -1e-300
    h = impose(g, gamma, structure)
    assert np.isfinite(h).all()
    assert np.ptp(h) > 0
    assert np.all(np.diff(h.ravel()[np.argsort(g, axis=None)]) >= 0)


def test_independent_and_beckmann_are_the_field_itself():
    g = standard()
    assert np.array_equal(impose(g, 2.0, "independent"), g)
    for structure in TIED:
        assert np.array_equal(impose(g, np.inf, structure), g)
        # 1/sqrt(gamma) is how far Q/(gamma-1) spreads about 1.
        assert np.allclose(impose(g, 1e9, structure), g, atol=1e-3)


@pytest.mark.parametrize("structure", TIED)
def test_points_have_std_slopes(structure, judge):
    """|F'(g) ∇g| of independent draws is STD."""
    gamma, rng = 1.75, np.random.default_rng(judge.seed(2))
    slope2 = steepness(rng.standard_normal(100_000), gamma, structure) ** 2
    slope2 *= rng.exponential(size=slope2.size)
    judge.keeps(stats.kstest(slope2, stats.f(2, 2 * gamma - 2).cdf).pvalue)
    # Negative control: another gamma.
    judge.catches(stats.kstest(slope2, stats.f(2, 2 * 2.0 - 2).cdf).pvalue)


def worst(h, gamma, sigma_x, sigma_y):
    """KS distance, and the largest relative error of four quantiles."""
    p, q = facet_slopes(h)
    rho2 = ((p / sigma_x) ** 2 + (q / sigma_y) ** 2).ravel()
    law = stats.f(2, 2 * gamma - 2)
    levels = (0.5, 0.9, 0.99, 0.999)
    error = np.quantile(rho2, levels, method="hazen") / law.ppf(levels)
    return stats.kstest(rho2, law.cdf).statistic, np.abs(np.sqrt(error) - 1).max()


@pytest.mark.parametrize("structure", TIED)
@pytest.mark.parametrize(
    ("gamma", "sigma_y", "cells", "correlation"),
    [
        (2.0, 0.5, (320, 384), 8.0),
        (8.0, 0.2, (320, 384), 8.0),
        *(
            pytest.param(g, 0.5, (512, 512), length, marks=pytest.mark.long)
            for g in (1.75, 2.0, 4.0, 8.0, 40.0)
            for length in (4.0, 8.0, 16.0)
        ),
    ],
)
def test_facets_follow_std_in_every_structure(structure, gamma, sigma_y, cells, correlation):
    """Demanded as of "independent": KS 1e-3, quantiles to 99.9 % within 1 %; no random sample."""
    h = generate_surface(
        gamma, 0.5, sigma_y, cells=cells, correlation=correlation, structure=structure, seed=6
    )
    distance, error = worst(h, gamma, 0.5, sigma_y)
    assert distance < 1e-3
    assert error < 0.01
    # Negative control: slopes 2 % off.
    assert worst(h, gamma, 0.51, sigma_y * 1.02)[1] > 0.01


def test_facets_of_the_bare_function_do_not_follow_std():
    """Negative control: points have STD slopes, facets lose the tail at mean height."""
    h = generate_surface(2.0, 0.5, cells=(320, 384), structure="middle", seed=6, iterations=0)
    distance, error = worst(h, 2.0, 0.5, 0.5)
    assert distance > 1e-2
    assert error > 0.5


def ideal(gamma, structure):
    """Rank correlations of steepness with height and with distance at points of the continuum."""
    rng = np.random.default_rng(3)
    g = rng.standard_normal(30_000)
    rho = steepness(g, gamma, structure) * np.sqrt(rng.exponential(size=g.size))
    return stats.spearmanr(rho, g).statistic, stats.spearmanr(rho, np.abs(g)).statistic


@pytest.mark.parametrize(
    ("structure", "key", "which"),
    [("tops", "height", 0), ("middle", "distance", 1), ("extremes", "distance", 1)],
)
def test_steep_facets_lie_where_they_should(structure, key, which):
    """At γ = 4 and L = 8 the facets keep the points' correlation to 0.05.

    A tile of some 2000 correlated places L² knows a correlation to about 0.02; the rest is
    what averaging over facets takes (0.02 in the middle at 512², L = 8). The surface is one for all
    runs: 0.05 is no error of a sample, which one tile doesn't know.
    """
    made = generate_surface(4.0, 0.5, cells=(320, 384), structure=structure, seed=7)
    found = surface_statistics(made, 4.0, 0.5)["height_slope"]
    expected = ideal(4.0, structure)[which]
    assert abs(expected) > 0.4
    assert found[key] == pytest.approx(expected, abs=0.05)
    # Negative control: slopes that know nothing of height.
    bare = surface_statistics(generate_surface(4.0, 0.5, cells=(320, 384), seed=7), 4.0, 0.5)[
        "height_slope"
    ]
    assert abs(bare["height"]) < 0.1
    assert abs(bare["distance"]) < 0.15


@pytest.mark.parametrize("structure", STRUCTURES)
def test_recipe_holds_the_structure_and_makes_it_again(structure):
    h = generate_surface(2.0, 0.5, 0.2, cells=(32, 50), structure=structure, seed=11)
    recipe = json.loads(json.dumps(h.recipe, allow_nan=False))
    assert recipe["structure"] == structure
    again = from_recipe(recipe)
    assert np.array_equal(again.heights, h.heights)
    assert again.recipe == h.recipe


@pytest.mark.parametrize("structure", TIED)
@pytest.mark.parametrize("cells", [(2, 2), (2, 3), (3, 2), (2, 40), (5, 7)])
@pytest.mark.parametrize("gamma", [1.501, 2.0, np.inf])
def test_small_meshes_stay_finite_and_rough(structure, cells, gamma):
    for sigma_y, correlation in ((0.5, 0.1), (1e-3, 8.0), (0.5, 1e6)):
        h = generate_surface(
            gamma, 0.5, sigma_y, cells=cells, correlation=correlation, structure=structure
        )
        assert np.isfinite(h.heights).all()
        assert np.ptp(h.heights) > 0


def azimuths(gamma, structure, first, seeds=16):
    """Means over surfaces of cos φ, sin φ, cos 2φ, sin 2φ of the facets, and standard errors."""
    rows = np.array(
        [
            list(
                surface_statistics(
                    generate_surface(
                        gamma, 0.5, cells=(96, 128), correlation=4.0, structure=structure, seed=seed
                    ),
                    gamma,
                    0.5,
                )["harmonics"].values()
            )
            for seed in range(first, first + seeds)
        ]
    )
    return rows.mean(axis=0), rows.std(axis=0, ddof=1) / np.sqrt(seeds)


@pytest.mark.parametrize(
    ("gamma", "structure"),
    [
        (2.0, "tops"),
        pytest.param(2.0, "extremes", marks=pytest.mark.long),
        pytest.param(4.0, "middle", marks=pytest.mark.long),
    ],
)
def test_azimuths_are_isotropic(gamma, structure, judge):
    mean, error = azimuths(gamma, structure, judge.seed(0))
    judge.near(mean, 0, error, dof=15)


def test_cliffs_in_the_middle_show_the_diagonals_as_documented(judge):
    """Negative control of the same test, and a known limit: sin 2φ of 0.026 at γ = 2."""
    mean, error = azimuths(2.0, "middle", judge.seed(0), seeds=48)
    judge.tells(mean, 0, error, dof=47)
    judge.near(mean[3], 0.026, error[3], dof=47, within=0.01)
