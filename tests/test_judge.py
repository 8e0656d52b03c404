"""The ledger of false alarms keeps books, and a run that spends too much fails."""

import judge as book
import pytest


def asked(offset=0):
    ledger = book.Ledger(offset)
    return ledger, book.Judge(ledger, "here")


def test_levels_add_up():
    ledger, one = asked()
    one.near([1.0, 2.0], [1.1, 2.0], 0.1)
    one.keeps(0.5, level=1e-5)
    one.catches(1e-9)
    assert ledger.total == pytest.approx(book.LEVEL + 1e-5)


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
