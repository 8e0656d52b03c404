"""Rays and surfaces told apart: simulated measurements whose spreads are known."""

import numpy as np
import pytest

from microsurf.errors import InputError
from microsurf.spread import (
    CONFIDENCE,
    advice,
    of_variances,
    satterthwaite,
    spread,
)

RUNS = 2000
FALSE_ALARM = 5 * np.sqrt(CONFIDENCE * (1 - CONFIDENCE) / RUNS)
"""Five standard errors of a coverage from RUNS runs: 6e−7."""

ONE_SIDED = (1 + CONFIDENCE) / 2 * (1 - 5 * np.sqrt((1 - CONFIDENCE) / (1 + CONFIDENCE) / RUNS))
"""At σ_b = 0 an interval can miss on one side only; five standard errors less."""


def simulated(between, within, surfaces, batches, rng):
    """One measurement: values of the surfaces, variances of their rays from batches."""
    rays = within * np.sqrt(batches) * rng.standard_normal((surfaces, batches))
    values = 1 + between * rng.standard_normal(surfaces) + rays.mean(axis=1)
    return values, rays.var(axis=1, ddof=1) / batches


def found(between, within, surfaces, batches, seed):
    rng = np.random.default_rng(seed)
    for _ in range(RUNS):
        values, variances = simulated(between, within, surfaces, batches, rng)
        freedom = satterthwaite(variances, np.full(surfaces, batches - 1))
        yield spread(values, variances, freedom)


@pytest.mark.parametrize("surfaces", [2, 4, 12])
@pytest.mark.parametrize("within", [0.1, 1.0, 2.0])
def test_intervals_between_surfaces_cover_at_the_stated_rate(within, surfaces):
    """Williams's interval covers a little too often where rays dominate, never too rarely."""
    inside = [s.low <= 1 <= s.high for s in found(1.0, within, surfaces, 8, 1)]
    assert CONFIDENCE - FALSE_ALARM <= np.mean(inside) <= 0.985 + FALSE_ALARM


def test_intervals_hold_without_any_difference_between_surfaces():
    inside = [s.low == 0 for s in found(0.0, 1.0, 6, 8, 2)]
    assert np.mean(inside) >= ONE_SIDED


def test_taking_all_of_the_spread_for_surfaces_would_not_cover():
    """Negative control: rays left in. And batches taken for much better than they are."""
    rng = np.random.default_rng(3)
    inside = []
    for _ in range(RUNS):
        values, variances = simulated(1.0, 2.0, 12, 8, rng)
        s = spread(values, 0 * variances)
        inside.append(s.low <= 1 <= s.high)
    assert np.mean(inside) < CONFIDENCE - 4 * FALSE_ALARM
    inside = [spread(*simulated(0.0, 1.0, 200, 3, rng)).low == 0 for _ in range(RUNS)]
    known = [s.low == 0 for s in found(0.0, 1.0, 200, 3, 4)]
    assert np.mean(inside) < ONE_SIDED <= np.mean(known)


def test_estimates_on_average():
    """Of σ_b² without truncation: s² − σ_w² has no bias."""
    runs = list(found(1.0, 0.3, 6, 8, 5))
    within = np.array([s.within**2 for s in runs])
    total = np.array([s.error**2 * s.surfaces for s in runs])
    for values, truth in ((within, 0.09), (total - within, 1.0)):
        assert abs(values.mean() - truth) <= 5 * values.std() / np.sqrt(RUNS)


def test_satterthwaite_of_equal_variances_adds_up_and_is_less_else():
    freedom = np.array([7.0, 7.0, 7.0])
    assert satterthwaite(np.ones(3), freedom) == pytest.approx(21)
    assert satterthwaite(np.array([100.0, 1.0, 1.0]), freedom) == pytest.approx(7, rel=0.05)
    assert satterthwaite(np.zeros(3), freedom) > 1e6


@pytest.mark.parametrize(("between", "within"), [(0.1, 1.0), (0.5, 1.0), (1.0, 0.1)])
def test_what_is_advised_halves_the_error(between, within):
    """40 000 means know their spread to 0.35 %: 5 standard errors are 1.8 %, false alarms 6e−7."""
    rng = np.random.default_rng(6)
    now = of_variances(4, 1.0, between**2 + within**2, within**2)
    bought = advice(now)

    def error(surfaces, rays):
        size = (40_000, surfaces)
        values = between * rng.standard_normal(size)
        values += within / np.sqrt(rays) * rng.standard_normal(size)
        return values.mean(axis=1).std()

    assert error(4, 1) == pytest.approx(now.error, rel=0.018)
    assert error(bought.surfaces, 1) == pytest.approx(now.error / 2, rel=0.018)
    if 3 * between**2 < within**2:  # σ_b² is less than a quarter of the sum
        assert error(4, bought.rays) == pytest.approx(now.error / 2, rel=0.018)
    else:
        assert bought.rays is None
        assert error(4, 1e6) == pytest.approx(now.floor, rel=0.018)
        assert error(4, 1e6) > 1.01 * now.error / 2


def from_one(surfaces, within):
    """Surfaces with s² = 1."""
    return of_variances(surfaces, 1.0, 1.0, within)


def test_who_dominates_is_said_only_where_it_is_known():
    assert from_one(8, 1e-4).dominant == "surfaces"
    assert from_one(200, 0.99).dominant == "rays"
    assert from_one(3, 0.5).dominant == "either"
    assert "rays alone leave 99 %" in advice(from_one(8, 0.02)).text
    assert "32 surfaces instead of 8" in advice(from_one(8, 0.02)).text
    assert advice(from_one(200, 0.99)).text.startswith("rays dominate: 4.1")


def test_one_surface_knows_nothing_of_others():
    alone = spread(np.array([0.5]), np.array([0.01]))
    assert (alone.mean, alone.error, alone.within) == (0.5, 0.1, 0.1)
    assert (alone.low, alone.high, alone.dominant) == (0, np.inf, "either")
    assert advice(alone).surfaces == 4
    assert advice(alone, only=True).surfaces is None
    assert advice(alone, only=True).rays == 4
    exact = spread(np.array([0.5, 0.5]), np.zeros(2))
    assert advice(exact).text == "no error: nothing to buy"


def test_as_many_variances_as_values():
    for values, variances in (([], []), ([1.0], [1.0, 2.0])):
        with pytest.raises(InputError, match="one of each"):
            spread(np.array(values), np.array(variances))


@pytest.mark.parametrize("together", [0.0, 1.0])
@pytest.mark.parametrize("surfaces", [3, 8])
def test_intervals_of_lobes_cover(together, surfaces):
    """Bins that vary alone (covered almost always) or all together: σ_b² = 300 in all."""
    rng = np.random.default_rng(8)
    bins = 300
    inside = []
    for _ in range(RUNS):
        alone, common = rng.standard_normal((surfaces, bins)), rng.standard_normal((surfaces, 1))
        values = np.sqrt(1 - together) * alone + np.sqrt(together) * common
        values += rng.standard_normal((surfaces, bins))
        found = spread(values, np.ones_like(values))
        inside.append(found.low**2 <= bins <= found.high**2)
    assert np.mean(inside) >= CONFIDENCE - FALSE_ALARM
    if together:
        assert np.mean(inside) <= 0.985 + FALSE_ALARM
