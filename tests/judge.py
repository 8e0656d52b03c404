"""The false alarms of the whole suite: what each statistical assertion may cost, added up.

A test asks the fixture ``judge`` instead of comparing with so many standard errors by
hand. Each family of comparisons it makes has a level: the probability that chance alone
makes it fail. They add up to at most BUDGET a run, or the run itself fails.

    def test_it(judge):
        rng = np.random.default_rng(judge.seed(5))
        judge.near(mean, expected, error)        # all of them, Šidák over the family
        judge.keeps(p_value)                     # one p-value or more
        judge.catches(wrong_p_value)             # a negative control: must be rejected

``pytest --fresh-seed`` (or MICROSURF_FRESH_SEED=1) draws new seeds, any other number
makes those of that number again.
"""

import numpy as np
import pytest

from microsurf.verdict import significance

BUDGET = 1e-3
"""Probability that a run with new seeds fails by chance."""
LEVEL = 4e-6
"""Of a family of comparisons that does not say otherwise: a single one at 4.6 standard errors."""


class Ledger:
    """Levels spent in this run, by test."""

    def __init__(self, offset):
        self.offset = offset
        self.spent = {}

    @property
    def total(self):
        """Probability that any of them fails by chance, at most."""
        return sum(self.spent.values())


class Judge:
    """What a test asks; ``name`` is that of the test."""

    def __init__(self, ledger, name):
        self._ledger, self._name = ledger, name

    def seed(self, number):
        """Return the seed itself, or another one with ``--fresh-seed``."""
        return number + self._ledger.offset

    def keeps(self, p_values, level=LEVEL):
        """Assert that a family of p-values is what chance gives in 1 − level of cases."""
        self._ledger.spent[self._name] = self._ledger.spent.get(self._name, 0.0) + level
        found = significance.sidak(p_values)
        assert found > level, f"p = {found:.2g} of a family of {np.size(p_values)}"

    def near(self, values, expected, errors, level=LEVEL):
        """Assert that estimates are as expected, by their standard errors; all one family."""
        self.keeps(significance.z_test(values, expected, errors), level)

    def catches(self, p_values, level=LEVEL):
        """Assert that the same comparison rejects a defect; costs no level."""
        found = significance.sidak(p_values)
        assert found <= level, f"not caught: p = {found:.2g} of a family of {np.size(p_values)}"

    def tells(self, values, expected, errors, level=LEVEL):
        """Assert that estimates are told from what is wrong, as `near` would."""
        self.catches(significance.z_test(values, expected, errors), level)


def fresh(text):
    """Offset of all seeds: 0 without a text, drawn for "1", the number itself else."""
    if not text or text == "0":
        return 0
    if text == "1":
        return int(np.random.SeedSequence().generate_state(1)[0]) + 2
    return int(text)


def verdict(ledger):
    """One line about the run, and whether it keeps to the budget."""
    kept = ledger.total <= BUDGET
    seeds = f", seeds + {ledger.offset}" if ledger.offset else ""
    line = (
        f"statistics: {len(ledger.spent)} tests, false alarm {ledger.total:.1e} a run "
        f"(at most {BUDGET:g}){seeds}"
    )
    return (line if kept else f"{line}: TOO MUCH"), kept


@pytest.fixture
def judge(request):
    return Judge(request.config.stash[KEY], request.node.nodeid)


KEY = pytest.StashKey()
