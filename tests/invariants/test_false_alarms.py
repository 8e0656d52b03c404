import numpy as np
import pytest
from judge import rate
from scipy import stats

from microsurf.invariants import false_alarms


def test_critical_values_hold_the_rate_of_a_report():
    """TESTS of them with any number of comparisons alarm falsely once in 1/RATE reports."""
    for comparisons in (1, 24):
        rate = (
            2 * stats.norm.sf(false_alarms.critical(comparisons)) * comparisons * false_alarms.TESTS
        )
        assert rate == pytest.approx(false_alarms.RATE)


def test_t_is_as_unlikely_as_its_z():
    t = np.array([-7.0, -1.0, 0.0, 2.0, 40.0])
    np.testing.assert_allclose(
        stats.norm.sf(np.abs(false_alarms.standardised(t, 15))),
        stats.t.sf(np.abs(t), 15),
        rtol=1e-9,
    )
    assert false_alarms.standardised(-1e9, 1e6) == -false_alarms.MOST


@pytest.mark.parametrize("law", ["normal", "exponential"])
def test_z_is_normal_under_the_null(law, judge):
    """4000 comparisons each: KS, and in the tails what is due or less, or half as much more.

    Exponential values are skewed: their differences are not, 16 of them against a number are.
    """
    rng = np.random.default_rng(judge.seed(1))
    a, b = (getattr(rng, law)(size=(16, 4000)) for _ in range(2))
    z = false_alarms.between(a, b)
    judge.keeps([stats.kstest(z, "norm").pvalue, rate((np.abs(z) > 2.576).sum(), 4000, 0, 0.015)])
    if law == "normal":
        judge.keeps(stats.kstest(false_alarms.against(a, 0.0), "norm").pvalue)
        # Negative control: Student's t of three degrees of freedom taken for normal.
        t = a[:4].mean(axis=0) / (a[:4].std(axis=0, ddof=1) / 2)
        judge.catches(rate((np.abs(t) > 2.576).sum(), 4000, 0, 0.01))


def test_a_shift_is_found():
    """Student's t of 5, and five standard deviations from a number."""
    # Both sides are the same numbers, of a fixed seed: the shift alone is seen, and no chance.
    a = np.random.default_rng(2).normal(size=(16, 400))
    z = false_alarms.between(a, a + 5 * np.sqrt(2 / 16))
    assert z.mean() == pytest.approx(false_alarms.standardised(-5.0, 30), abs=0.3)
    assert np.abs(false_alarms.against(a + 5, 0.0)).min() > 5


def test_what_has_no_spread_is_compared_up_to_rounding():
    same = np.full((16, 1), 0.3)
    assert np.abs(false_alarms.between(same, same + 1e-16)) < 1
    assert false_alarms.between(same, same + 1e-9) < -8
    assert np.abs(false_alarms.against(same, 0.3 + 1e-16)) < 1


def test_the_largest_decides():
    found = false_alarms.by_chance("a", "b", [[0.1, -6.0], [2.0, 1.0]], "c")
    assert (found.value, found.tolerance) == (6.0, false_alarms.critical(4))
    assert not found.holds
