"""Differences, orders and powers: simulated values whose trend is known."""

import numpy as np
import pytest

from microsurf.spread import CONFIDENCE
from microsurf.trend import Mean, difference, mean_of, order, part_and_whole, power

RUNS = 3000
FALSE_ALARM = 5 * np.sqrt(CONFIDENCE * (1 - CONFIDENCE) / RUNS)
"""Five standard errors of a coverage from RUNS runs: 6e−7."""


def covered(intervals, truth):
    return np.mean([i.low <= truth <= i.high for i in intervals])


@pytest.mark.parametrize(("many", "few", "wide"), [(16, 8, 1.0), (32, 4, 0.3), (8, 8, 3.0)])
def test_differences_of_independent_means_cover(many, few, wide):
    """Welch's interval is right to about 1 %."""
    rng = np.random.default_rng(1)
    found = [
        difference(mean_of(1 + rng.standard_normal(many)), mean_of(wide * rng.standard_normal(few)))
        for _ in range(RUNS)
    ]
    assert abs(covered(found, 1.0) - CONFIDENCE) < FALSE_ALARM + 0.01
    off = 1 + 2 * np.sqrt(1 / many + wide**2 / few)  # negative control: two errors away
    assert covered(found, off) < 0.7
    exact = difference(Mean(2.0, 0.0, 4), Mean(1.0, 0.0, 4))
    assert (exact.low, exact.value, exact.high) == (1, 1, 1)


@pytest.mark.parametrize(("count", "part"), [(16, 1), (16, 8), (4, 2), (3, 1)])
def test_a_part_against_the_whole_covers_exactly(count, part):
    rng = np.random.default_rng(2)
    found = [part_and_whole(rng.standard_normal(count), part) for _ in range(RUNS)]
    assert abs(covered(found, 0.0) - CONFIDENCE) < FALSE_ALARM
    whole = part_and_whole(np.arange(4.0), 4)
    assert (whole.low, whole.value, whole.high) == (0, 0, 0)


def three(p, error, rng):
    """Values at h = 4, 2 and 1 of 1 + 0.1 hᵖ."""
    return [
        Mean(1 + 0.1 * h**p + error * float(rng.standard_normal()), error, 16) for h in (4, 2, 1)
    ]


@pytest.mark.parametrize("p", [0.5, 1.0, 2.0])
def test_orders_of_convergence(p):
    rng = np.random.default_rng(3)
    assert order(*three(p, 0.0, rng)).value == pytest.approx(p, abs=1e-12)
    small = 0.1 * (2**p - 1) / 30  # a thirtieth of the smaller difference: linear errors hold
    found = [order(*three(p, small, rng)) for _ in range(RUNS)]
    assert None not in found
    assert abs(covered(found, p) - CONFIDENCE) < FALSE_ALARM + 0.01
    assert covered(found, p + 0.3) < CONFIDENCE - FALSE_ALARM  # negative control


def test_no_order_is_read_out_of_noise():
    """Two differences beyond 3 errors, one sign: below 1e-5 of pure noise; none of 3000 runs."""
    rng = np.random.default_rng(4)
    noise = [[Mean(float(rng.standard_normal()), 1.0, 16) for _ in range(3)] for _ in range(RUNS)]
    assert [order(*means) for means in noise].count(None) >= RUNS - 1
    # And where it turns back.
    assert order(Mean(1.0, 0.0, 9), Mean(0.0, 0.0, 9), Mean(0.5, 0.0, 9)) is None


@pytest.mark.parametrize("freedom", [[11, 11, 11, 11], [15, 7, 3]])
def test_powers_cover(freedom):
    rng = np.random.default_rng(5)
    sizes = 4.0 ** np.arange(len(freedom))
    found = [
        power(sizes, sizes**-0.5 * np.sqrt(rng.chisquare(freedom) / freedom), freedom)
        for _ in range(RUNS)
    ]
    assert abs(covered(found, -0.5) - CONFIDENCE) < FALSE_ALARM + 0.01
    assert abs(np.mean([f.value for f in found]) + 0.5) < 0.02
    assert covered(found, -1.0) < 0.6  # negative control: the power of a stratified beam


def test_means_that_know_of_each_other_do_not_follow_the_law():
    """Negative control of 1/√N: all share half of their variance."""
    rng = np.random.default_rng(6)
    sizes = [1, 4, 16, 64]
    deviations = []
    for size in sizes:
        common = rng.standard_normal(200)
        own = rng.standard_normal((200, size)).mean(axis=1)
        deviations.append((common + own).std(ddof=1))
    assert power(sizes, deviations, [199] * 4).low > -0.3


def test_too_few_to_fit():
    assert power([1], [1.0], [10]) is None
    assert power([1, 4], [0.0, 1.0], [10, 10]) is None
