"""Tests with nothing to find, each a p-value by seed: uniform if the test is calibrated."""

from collections.abc import Callable

import numpy as np
from scipy import fft

from microsurf.stats import correlated_ks, hypothesis_tests

from . import defects

FIELD, LENGTH = 64, 2.0


def gaussian_slopes(seed: int, scale: float = 1.0) -> np.ndarray:
    """Rayleigh distribution function at the slopes of a Gaussian field, ``scale`` times them.

    White noise, filtered to the autocorrelation exp(−r²/L²) and of known variance.
    Central differences of it along x and y are independent at a point.
    """
    k2 = sum(k**2 for k in np.meshgrid(*[2 * np.pi * fft.fftfreq(FIELD)] * 2))
    transfer = np.exp(-k2 * LENGTH**2 / 8)
    noise = np.random.default_rng(seed).standard_normal((FIELD, FIELD))
    heights = fft.ifft2(fft.fft2(noise) * transfer).real / np.sqrt(np.mean(transfer**2))
    slopes = [np.roll(heights, -1, axis) - np.roll(heights, 1, axis) for axis in (0, 1)]
    variance = 2 * (1 - np.exp(-4 / LENGTH**2))
    squared = slopes[0] ** 2 + slopes[1] ** 2
    return np.asarray(-np.expm1(-(scale**2) * squared / (2 * variance)))


def z_of_mean(seed: int, shift: float = 0.0) -> float:
    """Mean of 25 normal numbers, ``shift`` standard deviations off."""
    values = np.random.default_rng(seed).standard_normal(25) + shift
    return float(hypothesis_tests.z_test(values.mean(), 0, 1 / 5))


def sparse(seed: int, ratio: float = 0.9, *, total_fixed: bool = True) -> float:
    """3000 events in 60 bins of geometric shares, of which a third expects fewer than ten."""
    rng = np.random.default_rng(seed)
    shares, drawn = (r ** np.arange(60) for r in (0.9, ratio))
    expected = 3000 * shares / shares.sum()
    if total_fixed:
        seen = rng.multinomial(3000, drawn / drawn.sum())
    else:
        seen = rng.poisson(3000 * drawn / drawn.sum())
    return hypothesis_tests.chi_square(seen, expected, total_fixed=total_fixed)


def family(seed: int) -> np.ndarray:
    """Twelve p-values."""
    return hypothesis_tests.z_test(np.random.default_rng(seed).standard_normal(12), 0, 1)


def field(seed: int, scale: float = 1.0) -> float:
    """Slopes of a field of 32 correlation lengths a side against their distribution."""
    return correlated_ks.field_ks(
        gaussian_slopes(seed, scale), np.random.default_rng([seed, 1])
    ).p_value


NULLS: dict[str, Callable[[int], float]] = {
    "z-test of a mean": z_of_mean,
    "chi-square, pooled, total fixed": sparse,
    "chi-square, pooled, Poisson": lambda seed: sparse(seed, total_fixed=False),
    "Šidák over 12": lambda seed: hypothesis_tests.sidak(family(seed)),
    "Holm over 12": lambda seed: float(hypothesis_tests.holm(family(seed)).min()),
    "KS of correlated facets": field,
    "facet by evaluation": defects.facet_by_evaluation,
    "walk against quadrature": defects.walk_against_quadrature,
}
