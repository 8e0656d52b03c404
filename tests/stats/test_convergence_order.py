"""Differences, orders and powers: simulated values whose trend is known."""

import numpy as np
import pytest
from judge import rate

from microsurf.stats.convergence_order import (
    Mean,
    difference,
    mean_of,
    order,
    part_and_whole,
    power,
)
from microsurf.stats.intervals import CONFIDENCE

RUNS = 3000


def covered(intervals, truth, about=0.01):
    """p-value of how many hold the truth, of intervals that are right to ``about``."""
    count = sum(i.low <= truth <= i.high for i in intervals)
    return rate(count, len(intervals), CONFIDENCE - about, CONFIDENCE + about)


@pytest.mark.parametrize(("many", "few", "wide"), [(16, 8, 1.0), (32, 4, 0.3), (8, 8, 3.0)])
def test_differences_of_independent_means_cover(many, few, wide, judge):
    """Welch's interval is right to about 1 %."""
    rng = np.random.default_rng(judge.seed(1))
    found = [
        difference(mean_of(1 + rng.standard_normal(many)), mean_of(wide * rng.standard_normal(few)))
        for _ in range(RUNS)
    ]
    judge.keeps(covered(found, 1.0))
    off = 1 + 2 * np.sqrt(1 / many + wide**2 / few)  # negative control: two errors away
    judge.catches(covered(found, off))
    exact = difference(Mean(2.0, 0.0, 4), Mean(1.0, 0.0, 4))
    assert (exact.low, exact.value, exact.high) == (1, 1, 1)


@pytest.mark.parametrize(("count", "part"), [(16, 1), (16, 8), (4, 2), (3, 1)])
def test_a_part_against_the_whole_covers_exactly(count, part, judge):
    rng = np.random.default_rng(judge.seed(2))
    found = [part_and_whole(rng.standard_normal(count), part) for _ in range(RUNS)]
    judge.keeps(covered(found, 0.0, 0.0))
    judge.catches(covered(found, 1 / np.sqrt(part) - 1 / count, 0.0))  # negative control
    whole = part_and_whole(np.arange(4.0), 4)
    assert (whole.low, whole.value, whole.high) == (0, 0, 0)


def three(p, error, rng):
    """Values at h = 4, 2 and 1 of 1 + 0.1 hᵖ."""
    return [
        Mean(1 + 0.1 * h**p + error * float(rng.standard_normal()), error, 16) for h in (4, 2, 1)
    ]


@pytest.mark.parametrize("p", [0.5, 1.0, 2.0])
def test_orders_of_convergence(p, judge):
    rng = np.random.default_rng(judge.seed(3))
    assert order(*three(p, 0.0, rng)).value == pytest.approx(p, abs=1e-12)
    small = 0.1 * (2**p - 1) / 30  # a thirtieth of the smaller difference: linear errors hold
    found = [order(*three(p, small, rng)) for _ in range(RUNS)]
    assert None not in found
    judge.keeps(covered(found, p))
    judge.catches(covered(found, p + 0.3))  # negative control


def test_no_order_is_read_out_of_noise(judge):
    """Two differences beyond 3 errors, one sign: below 1e-5 of pure noise.

    The middle value takes part in both: the chance that both are 3 σ beyond is
    far below that of independent ones, 9e-7.
    """
    rng = np.random.default_rng(judge.seed(4))
    noise = [[Mean(float(rng.standard_normal()), 1.0, 16) for _ in range(3)] for _ in range(RUNS)]
    judge.keeps(rate([order(*means) for means in noise].count(None), RUNS, 1 - 1e-5, 1.0))
    # And where it turns back.
    assert order(Mean(1.0, 0.0, 9), Mean(0.0, 0.0, 9), Mean(0.5, 0.0, 9)) is None


@pytest.mark.parametrize("dof", [[11, 11, 11, 11], [15, 7, 3]])
def test_powers_cover(dof, judge):
    rng = np.random.default_rng(judge.seed(5))
    sizes = 4.0 ** np.arange(len(dof))
    found = [
        power(sizes, sizes**-0.5 * np.sqrt(rng.chisquare(dof) / dof), dof) for _ in range(RUNS)
    ]
    judge.keeps(covered(found, -0.5))
    values = np.array([f.value for f in found])
    judge.near(values.mean(), -0.5, values.std() / np.sqrt(RUNS))
    judge.catches(covered(found, -1.0))  # negative control: the power of a stratified beam


def test_means_that_know_of_each_other_do_not_follow_the_law():
    """Negative control of 1/√N: all share half of their variance."""
    rng = np.random.default_rng(6)  # fixed: −0.3 is nine of its errors away
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
