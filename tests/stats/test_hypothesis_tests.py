import numpy as np
import pytest
from scipy import stats

from microsurf.stats import hypothesis_tests

SEEDS = 200


def rejected(p_values, level):
    return int((np.asarray(p_values) <= level).sum())


def uniform(judge, p_values):
    """KS on the p-values, and as many below 5 % as chance gives; both at the judge's level."""
    judge.keeps(stats.kstest(p_values, "uniform").pvalue)
    judge.keeps(stats.binomtest(rejected(p_values, 0.05), len(p_values), 0.05).pvalue)


def binned(rng, ratio=0.9, *, total_fixed=True):
    shares, drawn = (r ** np.arange(60) for r in (0.9, ratio))
    expected, true = (3000 * s / s.sum() for s in (shares, drawn))
    seen = rng.multinomial(3000, true / 3000) if total_fixed else rng.poisson(true)
    return hypothesis_tests.chi_square(seen, expected, total_fixed=total_fixed)


def test_z_is_uniform(judge):
    means = np.random.default_rng(judge.seed(1)).standard_normal((SEEDS, 25)).mean(axis=1)
    uniform(judge, hypothesis_tests.z_test(means, 0, 0.2))


def test_z_has_the_power_of_its_formula(judge):
    """A shift of 3 standard errors is rejected at 5 % with probability Φ(3 − 1.96)."""
    z = np.random.default_rng(judge.seed(2)).standard_normal(SEEDS) + 3
    power = stats.norm.cdf(3 - stats.norm.ppf(0.975))
    found = rejected(hypothesis_tests.z_test(z, 0, 1), 0.05)
    judge.keeps(stats.binomtest(found, SEEDS, power).pvalue)


@pytest.mark.parametrize("total_fixed", [True, False])
def test_chi_square_with_sparse_bins_is_uniform(total_fixed, judge):
    rng = np.random.default_rng(judge.seed(3))
    uniform(judge, [binned(rng, total_fixed=total_fixed) for _ in range(SEEDS)])


def test_without_pooling_it_is_not(judge):
    """Negative control: of bins that expect 0.02 events Pearson's sum is no chi-square."""
    rng = np.random.default_rng(judge.seed(4))
    shares = 0.7 ** np.arange(60)
    expected = 300 * shares / shares.sum()
    p = [
        hypothesis_tests.chi_square(rng.poisson(expected), expected, total_fixed=False, least=1e-12)
        for _ in range(SEEDS)
    ]
    judge.catches(stats.kstest(p, "uniform").pvalue)


def test_a_total_that_is_fixed_costs_a_degree_of_freedom(judge):
    """Negative control: taken for Poisson, few bins of a fixed total look too good."""
    rng = np.random.default_rng(judge.seed(5))
    counts = rng.multinomial(1000, [0.5] * 2, SEEDS)
    p = [hypothesis_tests.chi_square(row, [500.0] * 2, total_fixed=False) for row in counts]
    judge.catches(stats.kstest(p, "uniform").pvalue)


def test_chi_square_has_power(judge):
    """Shares of 0.89^k for 0.9^k: rejected at 5 % with the power of the noncentral law."""
    rng = np.random.default_rng(judge.seed(6))
    found = rejected([binned(rng, 0.89) for _ in range(SEEDS)], 0.05)
    shares, other = (r ** np.arange(60) / (r ** np.arange(60)).sum() for r in (0.9, 0.89))
    # Pooling of the sparse third leaves 49 bins or so, and nearly all of the difference.
    excess = 3000 * np.sum((other - shares) ** 2 / shares)
    power = stats.ncx2.sf(stats.chi2.ppf(0.95, 45), 45, excess)
    assert found / SEEDS > power - 0.15
    assert power > 0.2


def test_pooling_loses_no_event():
    seen, expected = [5, 0, 3, 100], [4.0, 0.5, 3.5, 100.0]
    by_hand = stats.chi2.sf((8 - 8) ** 2 / 8 + 0, 1)
    found = hypothesis_tests.chi_square(seen, expected, total_fixed=True, least=8)
    assert found == pytest.approx(by_hand)
    # A last group that is too small joins the one before: 10 and 110 against 12 and 108.
    found = hypothesis_tests.chi_square([10, 105, 5], [12.0, 12, 96], total_fixed=True, least=12)
    expected = [(10 - 12) ** 2 / 12, (105 - 12) ** 2 / 12, (5 - 96) ** 2 / 96]
    assert found == pytest.approx(stats.chi2.sf(sum(expected), 2))


@pytest.mark.parametrize(
    ("seen", "expected", "fixed", "words"),
    [([3, 3], [3.0, 3.0], True, "fewer than two"), ([30, 20], [30.0, 21.0], True, "totals differ")],
)
def test_chi_square_refuses(seen, expected, fixed, words):
    with pytest.raises(ValueError, match=words):
        hypothesis_tests.chi_square(seen, expected, total_fixed=fixed)


def test_what_cannot_be_is_impossible():
    assert hypothesis_tests.chi_square([1, 50, 50], [0.0, 50, 50], total_fixed=False) == 0
    assert hypothesis_tests.z_test([1.0, 2.0], [1.0, 1.0], 0).tolist() == [1, 0]
    with pytest.raises(ValueError, match="errors"):
        hypothesis_tests.z_test(1.0, 1.0, -1.0)


def test_sidak_is_uniform_and_its_level_its_inverse(judge):
    p = np.random.default_rng(judge.seed(7)).random((SEEDS, 12))
    uniform(judge, [hypothesis_tests.sidak(row) for row in p])
    judge.catches(stats.kstest(p.min(axis=1), "uniform").pvalue)  # taken alone
    assert hypothesis_tests.sidak([hypothesis_tests.sidak_level(1e-6, 40), 0.5]) < 1e-6
    level = hypothesis_tests.sidak_level(0.05, 7)
    assert hypothesis_tests.sidak([level] * 7) == pytest.approx(0.05, rel=1e-12)
    assert hypothesis_tests.sidak([1.0, 1.0]) == 1


def test_holm_by_hand_and_over_dependent_tests(judge):
    np.testing.assert_allclose(hypothesis_tests.holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])
    np.testing.assert_allclose(hypothesis_tests.holm([[0.5, 0.9]]), [[1.0, 1.0]])
    assert hypothesis_tests.holm([]).size == 0
    rng = np.random.default_rng(judge.seed(8))
    shared = rng.standard_normal((SEEDS, 1)) + 0.5 * rng.standard_normal((SEEDS, 12))
    p = 2 * stats.norm.sf(np.abs(shared) / np.sqrt(1.25))
    wrong = sum(hypothesis_tests.holm(row).min() <= 0.05 for row in p)
    judge.keeps(stats.binomtest(wrong, SEEDS, 0.05, alternative="greater").pvalue)
    # One that is to be found among eleven that are not, and it alone.
    p = stats.norm.sf(rng.standard_normal((SEEDS, 12)) + np.array([6.0] + [0.0] * 11))
    found = np.array([hypothesis_tests.holm(row) <= 0.05 for row in p])
    assert found[:, 0].mean() > 0.95
    wrong = int(found[:, 1:].any(axis=1).sum())
    judge.keeps(stats.binomtest(wrong, SEEDS, 0.05, alternative="greater").pvalue)
