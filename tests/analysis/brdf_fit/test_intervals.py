"""Do intervals from resampling hold the truth; see `microsurf.analysis.brdf_fit.intervals`."""

import numpy as np
import pytest
from judge import rate
from made import directions, measured
from scipy import stats

from microsurf.analysis.brdf_fit import intervals
from microsurf.analysis.brdf_fit.intervals import Refits, Resampled, half_width
from microsurf.analysis.brdf_fit.problem import problem_of
from validation.calibration import brdf_fit

GROUPS, PAIRS, DRAWS = 20, 40, 6000


def test_the_jackknife_of_a_mean_is_its_t_interval():
    x = np.random.default_rng(0).standard_normal(9)
    without = np.array([np.delete(x, k).mean() for k in range(9)])
    usual = stats.t.ppf(0.975, 8) * x.std(ddof=1) / 3
    assert half_width(without) == pytest.approx(usual, rel=1e-12)


def test_a_variance_of_one_square_has_two_degrees_of_freedom():
    """One of many groups alone moves the fit; n alike have n − 1, as the mean above."""
    without = np.zeros(4000)
    without[0] = 1.0
    assert half_width(without) == pytest.approx(stats.t.ppf(0.975, 2), rel=2e-3)


def test_each_hand_has_pairs_of_every_incidence():
    angles = directions(incidences=4, pairs=60)
    problem = problem_of(measured(angles, np.random.default_rng(1).random((240, 2))))
    counts = np.zeros((4, intervals.HANDS), int)
    np.add.at(counts, (problem.groups, intervals.dealt(problem)), 1)
    assert (counts == 3).all()


def refits(x, noise, groups):
    """A line through the origin fitted without each group; noise of shape (draws, pairs)."""
    member = np.equal.outer(np.arange(groups.max() + 1), groups).astype(float)
    square, product = member @ x**2, member @ (x[:, None] * noise.T)
    without = (product.sum(axis=0) - product) / (square.sum() - square)[:, None]
    return Refits(without, without)


@pytest.mark.parametrize("shared", [0.0, 1.0])
def test_intervals_hold_where_few_incidences_know_all(judge, shared):
    """A line with noise of pairs, and of incidences if ``shared``, half of it known by two of 20.

    Negative controls: incidences alone by Student's 19 degrees of freedom; where incidences
    share errors, hands alone.
    """
    rng = np.random.default_rng(judge.seed(81))
    steep = np.repeat(np.where(np.arange(GROUPS) < 2, 3.0, 1.0), PAIRS)
    x = steep * (1 + 0.2 * rng.standard_normal(GROUPS * PAIRS))
    groups = np.repeat(np.arange(GROUPS), PAIRS)
    noise = steep * rng.standard_normal((DRAWS, len(x)))
    noise += shared * np.repeat(rng.standard_normal((DRAWS, GROUPS)), PAIRS, axis=1)
    off = np.abs(noise @ x) / (x @ x)
    incidences = refits(x, noise, groups)
    hands = refits(x, noise, np.arange(len(x)) % intervals.HANDS)
    both = Resampled(incidences, hands, np.ones(GROUPS), np.ones(GROUPS))
    judge.keeps(rate(np.sum(off < both.half_width(lambda r: r.vectors)), DRAWS, 0.93, 0.99))
    spread = np.sqrt(incidences.vectors.var(axis=0) * (GROUPS - 1))
    narrow = half_width(hands.vectors) if shared else stats.t.ppf(0.975, GROUPS - 1) * spread
    judge.catches(rate(np.sum(off < narrow), DRAWS, 0.93, 0.99))


@pytest.mark.long
def test_intervals_of_fits_hold(judge):
    """Short form of reports/calibration/brdf_fit.csv; negative control: order 1 alone."""
    first, draws = judge.seed(82) * 1000, 24
    rows = brdf_fit.rows(300, [brdf_fit.fits(300, first + k) for k in range(draws)])
    held = {(row["orders fitted"], row["parameter"]): row["held"] for row in rows}
    for name in ("gamma", "sigma", "n", "kd 0.8"):
        judge.keeps(rate(held["all", name], draws, 0.9, 1.0))
    judge.catches(rate(held["1", "gamma"], draws, 0.9, 1.0))
