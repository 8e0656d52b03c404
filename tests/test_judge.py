"""The ledger of false alarms keeps books, and a run that spends too much fails."""

import judge as book
import numpy as np
import pytest
from scipy import stats


def asked(offset=0):
    ledger = book.Ledger(offset)
    return ledger, book.Judge(ledger, "here")


def test_levels_add_up():
    ledger, one = asked()
    one.near([1.0, 2.0], [1.1, 2.0], 0.1)
    one.keeps(0.5, level=1e-5)
    one.catches(1e-9)
    one.pays(2e-5)
    assert ledger.total == pytest.approx(book.LEVEL + 3e-5)


def test_ledgers_of_several_processes_add_up():
    ledger, one = asked()
    one.keeps(0.5)
    other, there = asked()
    there.keeps(0.5)
    other.add({"elsewhere": 3e-6})
    ledger.add(other.spent)
    assert ledger.spent == pytest.approx({"here": 2 * book.LEVEL, "elsewhere": 3e-6})


def test_it_asserts_at_the_level_of_the_family():
    _, one = asked()
    p = book.LEVEL * 1.01
    one.keeps(p)
    one.keeps([p] + [1.0] * 9, level=p * 10 * 0.99)
    for fails in (
        lambda: one.keeps(book.LEVEL * 0.99),
        lambda: one.keeps([p, 1.0], level=2.1 * p),
        lambda: one.near(6.0, 0.0, 1.0),
        lambda: one.catches(p),
        lambda: one.tells(3.0, 0.0, 1.0),
    ):
        with pytest.raises(AssertionError):
            fails()


def test_errors_from_few_values_and_what_may_differ():
    t = float(stats.t.isf(0.005, 3))
    assert book.distant(1 + 2 * t, 1.0, 2.0, dof=3) == pytest.approx(0.01)
    assert book.distant(1.3, 1.0, 0.1, within=0.2) == pytest.approx(2 * stats.norm.sf(1))
    assert book.distant(1.1, 1.0, 0.0, within=0.2) == 1


def test_rates_are_exact_and_may_be_a_range():
    assert book.rate(0, 10, 0.5) == pytest.approx(2 * 0.5**10)
    assert book.rate(10, 10, 0.5) == pytest.approx(2 * 0.5**10)
    assert book.rate(10, 10, 0.5, 1.0) == 1
    assert book.rate(0, 10, 0.5, 1.0) == pytest.approx(2 * 0.5**10)
    # Wrong in as many of its samples as it says, or fewer.
    counts = np.random.default_rng(1).binomial(400, 0.95, 10_000)
    assert np.mean(book.rate(counts, 400, 0.95) <= 0.01) <= 0.01
    assert np.mean(book.rate(counts, 400, 0.85) <= 0.01) > 0.99


def test_a_run_that_spends_too_much_fails():
    ledger, one = asked()
    for _ in range(int(book.BUDGET / book.LEVEL)):
        one.keeps(0.5)
    assert book.verdict(ledger)[1]
    one.keeps(0.5)
    line, kept = book.verdict(ledger)
    assert not kept
    assert "TOO MUCH" in line


def test_fresh_seeds():
    assert asked()[1].seed(5) == 5
    assert asked(40)[1].seed(5) == 45
    assert book.fresh("") == book.fresh("0") == 0
    assert book.fresh("77") == 77
    assert book.fresh("1") != book.fresh("1")
    assert "seeds + 40" in book.verdict(asked(40)[0])[0]
