"""The false alarms of the whole suite: what each statistical assertion may cost, added up.

A test asks the fixture ``judge`` instead of comparing with so many standard errors by
hand. Each family of comparisons it makes has a level: the probability that chance alone
makes it fail. They add up to at most BUDGET a run, or the run itself fails.

    def test_it(judge):
        rng = np.random.default_rng(judge.seed(5))
        judge.near(mean, expected, error)        # all of them, Šidák over the family
        judge.keeps(p_value)                     # one p-value or more
        judge.keeps(rate(seen, runs, 0.95))      # how often something happened
        judge.catches(wrong_p_value)             # a negative control: must be rejected

A fixture of wider scope takes its seeds from the fixture ``new_seed``: new_seed(5).

``pytest --fresh-seed`` (or MICROSURF_FRESH_SEED=1) draws new seeds, any other number
makes those of that number again.
"""

import numpy as np
import pytest
from scipy import stats

from microsurf.stats import hypothesis_tests

BUDGET = 1e-3
"""Probability that a run with new seeds fails by chance."""
LEVEL = 1.6e-6
"""Of a family of comparisons that does not say otherwise: a single one at 4.8 standard errors."""


class Ledger:
    """Levels spent in this run, by test."""

    def __init__(self, offset):
        self.offset = offset
        self.spent = {}

    @property
    def total(self):
        """Probability that any of them fails by chance, at most."""
        return sum(self.spent.values())

    def add(self, spent):
        """Enter levels by test."""
        for name, level in spent.items():
            self.spent[name] = self.spent.get(name, 0.0) + level


class Judge:
    """What a test asks; ``name`` is that of the test."""

    def __init__(self, ledger, name):
        self._ledger, self._name = ledger, name

    def seed(self, number):
        """Return the seed itself, or another one with ``--fresh-seed``."""
        return number + self._ledger.offset

    def keeps(self, p_values, level=LEVEL):
        """Assert that a family of p-values is what chance gives in 1 − level of cases."""
        self._ledger.add({self._name: level})
        found = hypothesis_tests.sidak(p_values)
        assert found > level, f"p = {found:.2g} of a family of {np.size(p_values)}"

    def pays(self, level):
        """Enter a test that decides for itself, at this level."""
        self.keeps(1.0, level)

    def near(self, values, expected, errors, *, dof=None, within=0.0, level=LEVEL):
        """Assert that estimates are as expected, by their standard errors; all one family.

        ``dof`` is that of the errors if they are from few values, ``within`` what may
        be between the two for another reason than chance.
        """
        self.keeps(distant(values, expected, errors, dof, within), level)

    def catches(self, p_values, level=LEVEL):
        """Assert that the same comparison rejects a defect; costs no level."""
        found = hypothesis_tests.sidak(p_values)
        assert found <= level, f"not caught: p = {found:.2g} of a family of {np.size(p_values)}"

    def tells(self, values, expected, errors, *, dof=None, within=0.0, level=LEVEL):
        """Assert that estimates are distinguished from what is wrong, as `near` would."""
        self.catches(distant(values, expected, errors, dof, within), level)


def distant(values, expected, errors, dof=None, within=0.0):
    """p-values of estimates that may be off by ``within``: Student's t, or normal."""
    off = np.maximum(np.abs(np.subtract(values, expected)) - within, 0)
    if dof is None:
        return hypothesis_tests.z_test(off, 0, errors)
    return 2 * stats.t.sf(off / errors, dof)


def rate(count, runs, low, high=None):
    """p-value of what happened ``count`` times in ``runs`` at a rate of ``low`` … ``high``.

    Twice the smaller of the two exact binomial tails; without ``high`` the rate is ``low``.
    """
    below = stats.binom.cdf(count, runs, low)
    above = stats.binom.sf(np.subtract(count, 1), runs, low if high is None else high)
    return np.minimum(2 * np.minimum(below, above), 1)


def fresh(text):
    """Offset of all seeds: 0 without a text, drawn for "1", the number itself else."""
    if not text or text == "0":
        return 0
    if text == "1":
        return int(np.random.SeedSequence().generate_state(1)[0]) + 2
    return int(text)


def verdict(ledger):
    """One line about the run, and whether it keeps to the budget."""
    kept = ledger.total <= BUDGET * (1 + 1e-9)  # sums of levels are rounded
    seeds = f", seeds + {ledger.offset}" if ledger.offset else ""
    line = (
        f"statistics: {len(ledger.spent)} tests, false alarm {ledger.total:.1e} a run "
        f"(at most {BUDGET:g}){seeds}"
    )
    return (line if kept else f"{line}: TOO MUCH"), kept


@pytest.fixture
def judge(request):
    return Judge(request.config.stash[KEY], request.node.nodeid)


@pytest.fixture(scope="session")
def new_seed(request):
    """`Judge.seed`, for what several tests share."""
    return Judge(request.config.stash[KEY], "shared").seed


KEY = pytest.StashKey()
