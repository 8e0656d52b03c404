"""Rays and surfaces separated: simulated measurements whose spreads are known."""

import numpy as np
import pytest
from judge import rate

from microsurf.errors import InputError
from microsurf.stats.intervals import CONFIDENCE, dof_of_sum
from microsurf.stats.variance_components import (
    components_of,
    improvement,
    of_variances,
)

RUNS = 2000
ONE_SIDED = (1 + CONFIDENCE) / 2
"""Coverage at σ_b = 0, where an interval can miss on one side only."""


def simulated(between, within, surfaces, batches, rng):
    """One measurement: values of the surfaces, variances of their rays from batches."""
    rays = within * np.sqrt(batches) * rng.standard_normal((surfaces, batches))
    values = 1 + between * rng.standard_normal(surfaces) + rays.mean(axis=1)
    return values, rays.var(axis=1, ddof=1) / batches


def found(between, within, surfaces, batches, seed):
    rng = np.random.default_rng(seed)
    for _ in range(RUNS):
        values, variances = simulated(between, within, surfaces, batches, rng)
        dof = float(dof_of_sum(variances, np.full(surfaces, batches - 1)))
        yield components_of(values, variances, dof)


@pytest.mark.parametrize("surfaces", [2, 4, 12])
@pytest.mark.parametrize("within", [0.1, 1.0, 2.0])
def test_intervals_between_surfaces_cover_at_the_stated_rate(within, surfaces, judge):
    """Williams's interval covers a little too often where rays dominate, never too rarely."""
    inside = [s.low <= 1 <= s.high for s in found(1.0, within, surfaces, 8, judge.seed(1))]
    judge.keeps(rate(sum(inside), RUNS, CONFIDENCE, 0.985))


def test_intervals_hold_without_any_difference_between_surfaces(judge):
    inside = [s.low == 0 for s in found(0.0, 1.0, 6, 8, judge.seed(2))]
    judge.keeps(rate(sum(inside), RUNS, ONE_SIDED, 1.0))


def test_taking_all_of_the_spread_for_surfaces_would_not_cover(judge):
    """Negative control: rays left in. And batches taken for much better than they are."""
    rng = np.random.default_rng(judge.seed(3))
    inside = []
    for _ in range(RUNS):
        values, variances = simulated(1.0, 2.0, 12, 8, rng)
        s = components_of(values, 0 * variances)
        inside.append(s.low <= 1 <= s.high)
    judge.catches(rate(sum(inside), RUNS, CONFIDENCE, 0.985))
    inside = [components_of(*simulated(0.0, 1.0, 200, 2, rng)).low == 0 for _ in range(RUNS)]
    judge.catches(rate(sum(inside), RUNS, ONE_SIDED, 1.0))
    known = [s.low == 0 for s in found(0.0, 1.0, 200, 2, judge.seed(4))]
    judge.keeps(rate(sum(known), RUNS, ONE_SIDED, 1.0))


def test_estimates_on_average(judge):
    """Of σ_b² without truncation: s² − σ_w² has no bias."""
    runs = list(found(1.0, 0.5, 6, 8, judge.seed(5)))
    within = np.array([s.within**2 for s in runs])
    total = np.array([s.error**2 * s.surfaces for s in runs])
    for values, truth in ((within, 0.25), (total - within, 1.0)):
        judge.near(values.mean(), truth, values.std() / np.sqrt(RUNS))
    judge.tells(total.mean(), 1.0, total.std() / np.sqrt(RUNS))  # rays left in


@pytest.mark.parametrize(("between", "within"), [(0.1, 1.0), (0.5, 1.0), (1.0, 0.1)])
def test_what_is_advised_halves_the_error(between, within, judge):
    """40 000 means know their spread to 0.35 %."""
    rng = np.random.default_rng(judge.seed(6))
    now = of_variances(4, 1.0, between**2 + within**2, within**2)
    bought = improvement(now)

    def error(surfaces, rays):
        size = (40_000, surfaces)
        values = between * rng.standard_normal(size)
        values += within / np.sqrt(rays) * rng.standard_normal(size)
        return values.mean(axis=1).std()

    rows = [(error(4, 1), now.error), (error(bought.surfaces, 1), now.error / 2)]
    if 3 * between**2 < within**2:  # σ_b² is less than a quarter of the sum
        rows.append((error(4, bought.rays), now.error / 2))
    else:
        assert bought.rays is None
        rows.append((error(4, 1e6), now.floor))
        assert now.floor > now.error / 2
    seen, expected = np.transpose(rows)
    relative = 1 / np.sqrt(2 * 40_000)
    judge.near(seen / expected, 1, relative)
    judge.tells(seen / expected, 1.03, relative)  # negative control


def from_one(surfaces, within):
    """Surfaces with s² = 1."""
    return of_variances(surfaces, 1.0, 1.0, within)


def test_who_dominates_is_said_only_where_it_is_known():
    assert from_one(8, 1e-4).dominant == "surfaces"
    assert from_one(200, 0.99).dominant == "rays"
    assert from_one(3, 0.5).dominant == "either"
    assert "rays alone leave 99 %" in improvement(from_one(8, 0.02)).text
    assert "32 surfaces instead of 8" in improvement(from_one(8, 0.02)).text
    assert improvement(from_one(200, 0.99)).text.startswith("rays dominate: 4.1")


def test_one_surface_knows_nothing_of_others():
    alone = components_of(np.array([0.5]), np.array([0.01]))
    assert (alone.mean, alone.error, alone.within) == (0.5, 0.1, 0.1)
    assert (alone.low, alone.high, alone.dominant) == (0, np.inf, "either")
    assert improvement(alone).surfaces == 4
    assert improvement(alone, only=True).surfaces is None
    assert improvement(alone, only=True).rays == 4
    exact = components_of(np.array([0.5, 0.5]), np.zeros(2))
    assert improvement(exact).text == "no error: nothing to buy"


def test_as_many_variances_as_values():
    for values, variances in (([], []), ([1.0], [1.0, 2.0])):
        with pytest.raises(InputError, match="one of each"):
            components_of(np.array(values), np.array(variances))


@pytest.mark.parametrize("together", [0.0, 1.0])
@pytest.mark.parametrize("surfaces", [3, 8])
def test_intervals_of_lobes_cover(together, surfaces, judge):
    """Bins that vary alone or all together, both covered almost always: σ_b² = 300 in all.

    Negative control: a thousand times that.
    """
    rng = np.random.default_rng(judge.seed(8))
    bins = 300
    inside, far = 0, 0
    for _ in range(RUNS):
        alone, common = rng.standard_normal((surfaces, bins)), rng.standard_normal((surfaces, 1))
        values = np.sqrt(1 - together) * alone + np.sqrt(together) * common
        values += rng.standard_normal((surfaces, bins))
        found = components_of(values, np.ones_like(values))
        inside += found.low**2 <= bins <= found.high**2
        far += found.low**2 <= 1000 * bins <= found.high**2
    judge.keeps(rate(inside, RUNS, CONFIDENCE, 1.0))
    judge.catches(rate(far, RUNS, CONFIDENCE, 1.0))
