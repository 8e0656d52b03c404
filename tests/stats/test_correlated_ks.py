"""KS of facets that are correlated, over independent Gaussian fields."""

import numpy as np
import pytest
from scipy import stats

from microsurf.stats.correlated_ks import ecdf_covariance, field_ks
from validation.calibration.nulls import gaussian_slopes


def p_values(seeds, scale=1.0):
    fields = ((gaussian_slopes(s, scale), np.random.default_rng([s, 1])) for s in seeds)
    return [field_ks(*field).p_value for field in fields]


@pytest.mark.long
def test_fields_of_their_own_distribution_are_uniform(judge):
    """And negative control: as if facets were independent."""
    seeds = range(judge.seed(0), judge.seed(0) + 200)
    p = p_values(seeds)
    judge.keeps(stats.kstest(p, "uniform").pvalue)
    judge.keeps(stats.binomtest(int((np.array(p) <= 0.05).sum()), 200, 0.05).pvalue)
    naive = [stats.kstest(gaussian_slopes(s).ravel(), "uniform").pvalue for s in seeds]
    judge.catches(stats.binomtest(int((np.array(naive) <= 0.05).sum()), 200, 0.05).pvalue)


def test_slopes_ten_percent_off_are_found(judge):
    """At 5 %, 32 correlation lengths a side: in 9 of 10 fields or more; 13 of 20 in any run."""
    first = judge.seed(1000)
    assert np.mean(np.array(p_values(range(first, first + 20), 1.1)) <= 0.05) > 0.6


def test_independent_facets_are_worth_their_number(judge):
    u = np.random.default_rng(judge.seed(3)).random((128, 128))
    found = field_ks(u, np.random.default_rng(0))
    assert found.effective == pytest.approx(u.size, rel=0.02)
    covariance = ecdf_covariance(u)
    assert covariance[9, 9] == pytest.approx(0.25 / u.size, rel=0.02)
    assert covariance[4, 14] == pytest.approx(0.0625 / u.size, rel=0.1)


def test_blocks_are_worth_one_facet_each(judge):
    """Each number four times: a quarter of them counts."""
    u = np.random.default_rng(judge.seed(4)).random((64, 64)).repeat(2, axis=0).repeat(2, axis=1)
    assert field_ks(u, np.random.default_rng(0)).effective == pytest.approx(u.size / 4, rel=0.3)
