"""Errors against an uncertain reference: coverage by simulation, ties, domination."""

import numpy as np
import pytest
from judge import rate

from microsurf.analysis.tradeoff import pareto
from microsurf.analysis.tradeoff.pareto import (
    MethodPoint,
    error,
    half_width,
    pseudo_values,
    squared,
)

EXACT = np.array([[1.0]])


def draws(rng, count, mean, sd, size=1):
    return mean + sd * rng.standard_normal((count, size))


def test_an_exact_reference_gives_the_plain_distance():
    same = np.full((4, 1), 2.0)
    found = error(squared([(np.array([[2.2]]), same)]))
    assert (found.value, found.low, found.high, found.below) == pytest.approx([0.1] * 4)
    assert error(squared([(np.array([[2.2]]), same)], absolute=True)).value == pytest.approx(0.2)
    places = [(np.array([[2.2]]), same), (np.array([[1.0]]), same)]
    assert error(squared(places)).value == pytest.approx(0.5)  # the worst


@pytest.mark.parametrize("bias", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("size", [1, 40])
def test_intervals_cover(bias, size, judge):
    """95 % of 400 intervals hold the true E, or more.

    A method of one noisy draw of sd 0.01 in each of ``size`` components against eight draws
    of the reference: E² = bias² + noise².
    """
    rng = np.random.default_rng(judge.seed(3))
    truth = np.sqrt(bias**2 + 0.01**2)
    seen, below = 0, 0
    for _ in range(400):
        reference = draws(rng, 8, 1.0, 0.02, size)
        own = draws(rng, 6, 1.0 + bias, 0.01, size)
        found = error(squared([(own, reference)]))
        seen += found.low <= truth <= found.high
        below += truth <= found.below
    judge.keeps(rate([seen, below], 400, 0.95, 1.0))


def test_an_interval_that_leaves_out_the_reference_would_not_cover(judge):
    """The negative control of the test above: its reference taken as exact."""
    rng = np.random.default_rng(judge.seed(4))
    seen = 0
    for _ in range(400):
        reference = np.repeat(draws(rng, 8, 1.0, 0.02).mean(axis=0, keepdims=True), 8, axis=0)
        found = error(squared([(draws(rng, 6, 1.05, 0.01), reference)]))
        seen += found.low <= np.hypot(0.05, 0.01) <= found.high
    judge.catches(rate(seen, 400, 0.95, 1.0))


def test_noise_of_the_rung_is_part_of_its_error_and_averages_out(judge):
    """E² is unbiased: the mean of 500 of them."""
    rng = np.random.default_rng(judge.seed(5))
    for count in (1.0, 4.0):
        values = [
            squared([(draws(rng, 6, 1.0, 0.1), draws(rng, 8, 1.0, 0.05))], count).value
            for _ in range(500)
        ]
        # 1/|r̄|² has the relative bias 3·0.05²/8 = 1e−3, far below.
        error = np.std(values) / np.sqrt(500)
        judge.near(np.mean(values), 0.1**2 / count, error)
        judge.tells(np.mean(values), 0.1**2 / count / 4, error)  # the control


def test_half_width_is_student_s_of_one_component():
    rng = np.random.default_rng(6)  # fixed: the last bound is three times what is expected
    values = draws(rng, 8, 2.0, 0.1)
    expected = 2.364624 * values.std(ddof=1) / np.sqrt(8) / values.mean()
    assert half_width(values) == pytest.approx(expected, rel=1e-6)
    # Components that vary on their own are not summed.
    many = half_width(draws(rng, 200, 2.0, 0.1, 50))
    assert many < 2 * half_width(draws(rng, 200, 2.0, 0.1)) / np.sqrt(50) * 1.6


def test_pseudo_values_remove_the_bias_of_a_square(judge):
    rng = np.random.default_rng(judge.seed(7))
    found = [pseudo_values(draws(rng, 6, 1.0, 1.0), np.square).mean() for _ in range(2000)]
    judge.near(np.mean(found), 1, np.std(found) / np.sqrt(2000))
    plain = [np.square(draws(rng, 6, 1.0, 1.0).mean()) for _ in range(2000)]
    judge.tells(np.mean(plain), 1, np.std(plain) / np.sqrt(2000))  # the control
    assert pseudo_values(np.array([[3.0]]), np.square) == [[9.0]]


def of(name, value, seconds, reference, spread=0.0):
    return MethodPoint(
        name, seconds, seconds * 0.9, seconds * 1.1,
        squared([(np.array([[value]]) + spread, reference)]),
    )  # fmt: skip


def test_domination_asks_for_both_and_ties_are_ties():
    rng = np.random.default_rng(8)
    reference = draws(rng, 8, 1.0, 0.01)
    good, bad = of("good", 1.001, 1.0, reference), of("bad", 1.2, 2.0, reference)
    assert pareto.dominated([good, bad]) == {"bad": "good"}
    assert pareto.dominated([good, of("as dear", 1.2, 1.1, reference)]) == {}
    assert pareto.dominated([good, of("as good", 0.999, 2.0, reference)]) == {}
    assert pareto.dominated([of("worse", 1.3, 1.0, reference), bad]) == {}
    assert not pareto.worse(bad.squared, bad.squared)
    # They share the reference: what one interval overlaps the pair can tell.
    near, far = (squared([(np.array([[v]]), reference)]) for v in (1.05, 1.051))
    assert error(near).high > error(far).low
    assert pareto.worse(far, near)


@pytest.mark.parametrize(("own", "reference"), [(2, 8), (0, 8), (1, 2)])
def test_too_few_draws_are_refused(own, reference):
    with pytest.raises(ValueError, match="at least 3"):
        squared([(np.ones((own, 1)), np.ones((reference, 1)))])
