"""The oracle is F's distribution: ρ² of STD is F(2, 2γ−2), and exponential at γ = ∞ (scipy)."""

import json
import tracemalloc
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.fft
from scipy import stats

from microsurf.errors import InputError
from microsurf.surface import (
    facet_slopes,
    from_recipe,
    gaussian_field,
    generate_surface,
    surface_statistics,
    synthesis,
)

LEVELS = (0.5, 0.9, 0.99, 0.999)


def law(gamma):
    return stats.expon() if gamma > 1e8 else stats.f(2, 2 * gamma - 2)


def rho(h, sigma_x, sigma_y):
    p, q = facet_slopes(h)
    return np.hypot(p / sigma_x, q / sigma_y).ravel()


def ks(h, gamma, sigma_x, sigma_y=None):
    r = rho(h, sigma_x, sigma_y or sigma_x)
    return stats.kstest(r**2, law(gamma).cdf).statistic


def worst_quantile(h, gamma, sigma):
    r = rho(h, sigma, sigma)
    expected = np.sqrt(law(gamma).ppf(LEVELS))
    return np.abs(np.quantile(r, LEVELS, method="hazen") / expected - 1).max()


@pytest.mark.parametrize(
    ("gamma", "cells"),
    [
        (2.0, (512, 512)),
        (8.0, (384, 512)),
        *(
            pytest.param(g, (1024, 1024), marks=pytest.mark.long)
            for g in (1.75, 2.0, 3.0, 8.0, 40.0, 1e6, 1e9, np.inf)
        ),
    ],
)
def test_slopes_follow_std(gamma, cells):
    """Demanded: KS 1e-3, quantiles to 99.9 % within 1 %. Not a test of a random sample."""
    h = generate_surface(gamma, 0.5, cells=cells, seed=6)
    assert h.heights.shape == cells
    assert ks(h, gamma, 0.5) < 1e-3
    assert worst_quantile(h, gamma, 0.5) < 0.01


def test_a_slope_error_of_two_percent_is_caught():
    """Negative control of the quantiles."""
    h = generate_surface(2.0, 0.5, cells=512, seed=6)
    assert worst_quantile(h, 2.0, 0.5) < 0.01
    assert worst_quantile(h, 2.0, 0.5 / 1.02) > 0.01


def test_a_gaussian_surface_fails_for_ggx():
    """Negative control of KS: the initial field, of the right median."""
    h = generate_surface(2.0, 0.5, cells=(256, 320), seed=6, iterations=0)
    assert worst_quantile(h, 2.0, 0.5) > 0.5
    assert ks(h, 2.0, 0.5) > 0.05


@pytest.mark.parametrize(("sigma_x", "sigma_y"), [(0.5, 0.1), (0.2, 0.6)])
def test_anisotropic_slopes_follow_std(sigma_x, sigma_y):
    h = generate_surface(3.0, sigma_x, sigma_y, cells=(320, 384), seed=7)
    assert ks(h, 3.0, sigma_x, sigma_y) < 1e-3
    # Negative control: the same surface with its axes exchanged.
    assert ks(h, 3.0, sigma_y, sigma_x) > 0.05


def harmonics(gamma, sigma_x, sigma_y, seeds, **options):
    """Mean azimuth harmonics over seeds and standard errors: cos φ, sin φ, cos 2φ, sin 2φ."""
    rows = []
    for seed in seeds:
        p, q = facet_slopes(generate_surface(gamma, sigma_x, sigma_y, seed=seed, **options))
        z = p / sigma_x + 1j * q / sigma_y
        z /= np.abs(z)
        first, second = z.mean(), (z**2).mean()
        rows.append([first.real, first.imag, second.real, second.imag])
    rows = np.array(rows)
    return rows.mean(axis=0), rows.std(axis=0, ddof=1) / np.sqrt(len(seeds))


@pytest.mark.parametrize(
    ("gamma", "sigma_y", "cells", "seeds"),
    [
        (2.0, 0.5, (128, 192), 40),
        (8.0, 0.2, (128, 192), 40),
        *(
            pytest.param(g, 0.5, (1024, 1024), 16, marks=pytest.mark.long)
            for g in (1.75, 2.0, 8.0, 1e6)
        ),
    ],
)
def test_azimuths_are_isotropic(gamma, sigma_y, cells, seeds, judge):
    """The negative control is the next test."""
    numbers = range(judge.seed(0), judge.seed(0) + seeds)
    mean, error = harmonics(gamma, 0.5, sigma_y, numbers, cells=cells)
    judge.near(mean, 0, error, dof=seeds - 1)


def test_azimuths_show_the_diagonals_without_the_tilt(monkeypatch, judge):
    """Negative control: the tilt left out, at L = 3, is seen 25 standard errors off."""
    tilted = gaussian_field.inverse_lengths

    monkeypatch.setattr(gaussian_field, "inverse_lengths", lambda *a: (*tilted(*a)[:2], 0.0))
    numbers = range(judge.seed(0), judge.seed(0) + 40)
    mean, error = harmonics(8.0, 0.5, 0.5, numbers, cells=(128, 192), correlation=3.0)
    assert mean[3] < 0
    judge.tells(mean, 0, error, dof=39)


def _with_workers(transform, count, *arguments, **options):
    return transform(*arguments, **{**options, "workers": count})


def test_same_seed_same_bits_whatever_the_threads(monkeypatch):
    made = {"cells": (123, 210), "seed": 9}
    first = generate_surface(2.0, 0.5, 0.3, **made).heights
    for workers in (1, 3):
        fft = SimpleNamespace(
            rfftfreq=scipy.fft.rfftfreq,
            fftfreq=scipy.fft.fftfreq,
            rfft2=partial(_with_workers, scipy.fft.rfft2, workers),
            irfft2=partial(_with_workers, scipy.fft.irfft2, workers),
        )
        with monkeypatch.context() as patch:
            for module in (gaussian_field, synthesis):
                patch.setattr(module, "fft", fft)
            assert np.array_equal(generate_surface(2.0, 0.5, 0.3, **made).heights, first)
    assert not np.array_equal(
        generate_surface(2.0, 0.5, 0.3, **{**made, "seed": 10}).heights, first
    )


def test_recipe_is_json_and_reproduces_the_surface():
    h = generate_surface(np.inf, 0.5, 0.2, cells=(32, 50), spacing=0.1, seed=11, correlation=3)
    recipe = json.loads(json.dumps(h.recipe, allow_nan=False))
    assert recipe == h.recipe
    again = from_recipe(recipe)
    assert np.array_equal(again.heights, h.heights)
    assert again.recipe == h.recipe
    assert again.spacing == h.spacing
    with pytest.raises(InputError, match="seed"):
        from_recipe({k: v for k, v in recipe.items() if k != "seed"})


def test_unit_and_roughness_are_factors():
    h = generate_surface(3.0, 0.5, cells=(20, 30))
    fine = generate_surface(3.0, 0.5, cells=(20, 30), spacing=2.0**-20)
    assert np.array_equal(fine.heights, h.heights * 2.0**-20)
    assert np.array_equal(facet_slopes(fine), facet_slopes(h))
    rough = generate_surface(3.0, 2.0, cells=(20, 30))
    assert np.array_equal(rough.heights, h.heights * 4)


@pytest.mark.parametrize("cells", [(2, 2), (2, 3), (3, 2), (2, 40), (40, 2), (5, 7)])
@pytest.mark.parametrize("gamma", [1.501, 2.0, 1e9, np.inf])
@pytest.mark.parametrize("correlation", [0.1, 8.0, 1e6])
def test_extremes_stay_finite_and_rough(cells, gamma, correlation):
    for sigma_y in (0.5, 1e-3):
        h = generate_surface(gamma, 0.5, sigma_y, cells=cells, correlation=correlation)
        assert np.isfinite(h.heights).all()
        assert np.ptp(h.heights) > 0


def test_zero_roughness_is_flat():
    assert not generate_surface(2.0, 0.0, cells=(4, 6)).heights.any()


def test_memory_stays_below_80_bytes_a_cell():
    """Measured: 62 and, where the bins do not count, 52; 8 of them remain, the heights."""
    tracemalloc.start()
    surface = generate_surface(2.0, 0.5, cells=512, iterations=2)
    remains, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert surface.heights.nbytes == 8 * 512**2
    assert peak / 512**2 < 80
    assert remains / 512**2 < 9


@pytest.mark.long
def test_border_of_what_is_feasible(capsys):
    """γ ≥ 1.65 keeps KS < 3e-3 at 1024²; 1.51 is out of reach, and the surface's KS says so."""
    found = {}
    for gamma in (1.51, 1.55, 1.6, 1.65, 1.7):
        h = generate_surface(gamma, 0.5, cells=1024, seed=1)
        found[gamma] = ks(h, gamma, 0.5)
        with capsys.disabled():
            print(f"\ngamma {gamma}: KS {found[gamma]:.2e}", end="")  # noqa: T201
    assert found[1.65] < 3e-3
    assert found[1.51] > 0.1


@pytest.mark.parametrize(
    ("arguments", "options", "said"),
    [
        ((1.5, 0.5), {}, "gamma = 1.5"),
        ((np.nan, 0.5), {}, "gamma = nan"),
        ((2.0, -0.1), {}, "sigma"),
        ((2.0, 0.5, 0.0), {}, "both zero"),
        ((2.0, 0.0, 0.5), {}, "both zero"),
        ((2.0, np.inf), {}, "sigma"),
        ((2.0, np.nan), {}, "sigma"),
        ((2.0, 0.5), {"cells": 1}, "cells = 1"),
        ((2.0, 0.5), {"cells": 16385}, "16384"),
        ((2.0, 0.5), {"cells": (4, 2.5)}, "cells"),
        ((2.0, 0.5), {"cells": (4, 4, 4)}, "cells"),
        ((2.0, 0.5), {"correlation": 0.0}, "correlation"),
        ((2.0, 0.5), {"correlation": np.inf}, "correlation"),
        ((2.0, 0.5), {"structure": "fractal"}, "'fractal': must be one of independent, tops"),
        ((2.0, 0.5), {"structure": 1}, "structure = 1"),
        ((2.0, 0.5), {"spacing": 0.0}, "spacing"),
        ((2.0, 0.5), {"seed": -1}, "seed"),
        ((2.0, 0.5), {"seed": 1.5}, "seed"),
        ((2.0, 0.5), {"iterations": -1}, "iterations"),
    ],
)
def test_bad_arguments_are_refused(arguments, options, said):
    with pytest.raises(InputError, match=said):
        generate_surface(*arguments, **options)


def test_one_relief_on_two_meshes():
    """Before any projection every second height is the same, but for the scale of the slopes."""
    coarse = generate_surface(2.0, 0.5, cells=64, correlation=4.0, seed=3, finer=2, iterations=0)
    fine = generate_surface(2.0, 0.5, cells=128, correlation=8.0, seed=3, iterations=0)
    shared = fine.heights[::2, ::2]
    assert np.corrcoef(coarse.heights.ravel(), shared.ravel())[0, 1] == pytest.approx(1, abs=1e-12)
    again = from_recipe(coarse.recipe)
    np.testing.assert_array_equal(again.heights, coarse.heights)
    made = generate_surface(2.0, 0.5, cells=64, correlation=4.0, seed=3, finer=2)
    assert surface_statistics(made, 2.0, 0.5)["ks"] < 0.01
    assert np.abs(np.corrcoef(made.heights.ravel(), shared.ravel())[0, 1]) > 0.7
