"""Quantiles against mpmath's integrals, degrees of freedom against closed forms and limits."""

import mpmath
import numpy as np
import pytest
from judge import rate

from microsurf.stats import intervals

LEVELS = [0.5, 0.9, 0.95, 0.999, 1 - 1e-9]
RUNS = 4000


def inside_of_student(t, nu):
    """Chance of |T| < t, the regularised incomplete beta function of t²/(ν + t²)."""
    t, nu = mpmath.mpf(t), mpmath.mpf(nu)
    return mpmath.betainc(0.5, nu / 2, 0, t**2 / (nu + t**2), regularized=True)


@pytest.mark.parametrize("level", LEVELS)
def test_quantiles_hold_their_level(level):
    """To what one ulp of (1 + level)/2 moves the tails by, and twelve digits of scipy's."""
    for_tails = 2.3e-16 / (1 - level) + 1e-12
    rest = 1 - mpmath.erf(intervals.normal(level) / mpmath.sqrt(2))
    assert float(rest) == pytest.approx(1 - level, rel=for_tails)
    for dof in (1, 2, 3.7, 11, 200):
        rest = 1 - inside_of_student(intervals.student(dof, level), dof)
        assert float(rest) == pytest.approx(1 - level, rel=for_tails)


def test_limits_of_quantiles():
    assert intervals.student(np.inf) == pytest.approx(intervals.normal(), rel=1e-15)
    assert intervals.over_values(1) == intervals.normal()
    assert intervals.over_values(5, 0.9) == intervals.student(4, 0.9)
    assert intervals.student(4, 0.0) == intervals.normal(0.0) == 0
    # 95 % is ± 12.7062 of one degree of freedom: tan(0.95 π/2).
    assert intervals.student(1) == pytest.approx(np.tan(0.475 * np.pi), rel=1e-12)


@pytest.mark.parametrize("p", [1.0, 0.05, 1e-6, 1e-100, 1e-300])
def test_tails_too_small_for_a_level(p):
    z = intervals.normal_of_tails(p)
    assert float(mpmath.erfc(z / mpmath.sqrt(2))) == pytest.approx(p, rel=1e-11)


def test_p_values_and_deviates():
    for t, dof in ((-2.5, 3), (0.0, 8), (40.0, 6)):
        p = float(1 - inside_of_student(t, dof))
        assert intervals.two_sided_p(t, dof) == pytest.approx(p, rel=1e-11)
        z = float(intervals.normal_deviate(t, dof))
        assert float(mpmath.erfc(z / mpmath.sqrt(2))) == pytest.approx(p, rel=1e-11)
    assert intervals.two_sided_p(2.0, np.inf) == pytest.approx(float(mpmath.erfc(mpmath.sqrt(2))))
    assert intervals.normal_deviate(1e9, 1e6) == np.inf


def test_degrees_of_freedom_of_sums():
    dof = np.array([7.0, 7.0, 7.0])
    assert intervals.dof_of_sum(np.ones(3), dof) == pytest.approx(21)
    assert intervals.dof_of_sum([100.0, 1.0, 1.0], dof) == pytest.approx(7, rel=0.05)
    assert intervals.dof_of_sum(np.zeros(3), dof) == np.inf
    assert intervals.dof_of_sum([2.0, 3.0], [np.inf, np.inf]) == np.inf
    assert intervals.dof_of_sum([0.0, 3.0], [1, 5]) == 5
    # Welch (1947) of two means with variances 1/4 and 1/9, by hand in fractions.
    assert intervals.dof_of_sum([1 / 4, 1 / 9], [3, 8]) == pytest.approx(
        (13 / 36) ** 2 / (1 / 48 + 1 / 648), rel=1e-15
    )


def test_degrees_of_freedom_of_errors_whose_squares_no_float_holds():
    """A lobe of 1e−90 has a variance of 1e−180, whose square is 0."""
    for size in (1e-300, 1e-180, 1.0, 1e200):
        at_once = intervals.dof_of_sum(size * np.array([[3.0, 1.0], [1.0, 0.0]]), [4, 9])
        assert at_once == pytest.approx([16 / (9 / 4 + 1 / 9), 4], rel=1e-13)


def test_intervals_of_means_cover(judge):
    rng = np.random.default_rng(judge.seed(1))
    values = 3 + rng.standard_normal((4, RUNS))
    off = np.abs(values.mean(axis=0) - 3)
    inside = int((off <= intervals.half_width_of_mean(values, 0.9)).sum())
    judge.keeps(rate(inside, RUNS, 0.9, 0.9))
    # Negative control: the normal distribution's factor over four values.
    normal = intervals.normal(0.9) * values.std(axis=0, ddof=1) / 2
    judge.catches(rate(int((off <= normal).sum()), RUNS, 0.9, 0.9))
