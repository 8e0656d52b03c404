"""Verdicts of a report together."""

import numpy as np
import pytest
from scipy import stats
from test_comparison import experiments

from microsurf.analysis.multiplicity import multiplicity_of
from microsurf.stats import hypothesis_tests


def test_simultaneous_intervals_all_hold_their_truth(judge):
    """80 reports of 10 comparisons: 5 % of them miss one or more. Each at 95 %: 40 % would."""
    rng = np.random.default_rng(judge.seed(11))
    rows = [row for _ in range(2) for row in experiments(0.0, 4, 0.01, rng)]
    missed = single = 0
    for k in range(80):
        report = rows[10 * k : 10 * k + 10]
        missed += any(not low <= 0 <= high for low, high in multiplicity_of(report).simultaneous)
        single += any(not row.low <= 0 <= row.high for row in report)
    judge.keeps(stats.binomtest(missed, 80, 0.05, alternative="greater").pvalue)
    judge.catches(stats.binomtest(single, 80, 0.05, alternative="greater").pvalue)


def test_figures_of_a_family(judge):
    rows = experiments(0.0, 4, 0.005, np.random.default_rng(judge.seed(12)))
    found = multiplicity_of(rows)
    assert found.expected_wrong == pytest.approx(0.025 * 400)
    assert 0 <= found.standing < found.decided <= 400
    assert found.of_one_surface == 0
    wider = [
        (high - low) / (row.high - row.low)
        for row, (low, high) in zip(rows, found.simultaneous, strict=True)
    ]
    level = hypothesis_tests.sidak_level(0.05, 400)
    expected = stats.t.ppf(1 - level / 2, 3) / stats.t.ppf(0.975, 3)
    np.testing.assert_allclose(wider, expected, rtol=1e-9)


def test_one_surface_and_none():
    rows = experiments(0.0, 1, 0.0, np.random.default_rng(13))
    assert multiplicity_of(rows).of_one_surface == 400
    empty = multiplicity_of([])
    assert (empty.comparisons, empty.expected_wrong, empty.simultaneous) == (0, 0, ())
