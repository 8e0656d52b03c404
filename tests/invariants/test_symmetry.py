"""Turned, mirrored and shifted surfaces; what holds at a report's size is in test_whole."""

import numpy as np
import pytest

from microsurf.invariants import false_alarms, symmetry
from microsurf.invariants.reciprocity import skewed
from microsurf.invariants.replicates import tile_of

BACK = -np.arange(64)
WRONG = {
    # Heights 10 % larger; the surface turned alone; left and right exchanged.
    "relief": lambda h: (tile_of(1.1 * h), 30.0, 1.0),
    "turned alone": lambda h: (tile_of(h.T[:, BACK], flipped=True), 30.0, 1.0),
    "left for right": lambda h: (tile_of(h[:, BACK], flipped=True), 150.0, 1.0),
}


@pytest.fixture(scope="module")
def base(pool, new_seed):
    return symmetry.features_of(pool, tile_of(skewed(0)), 30.0, 1.0, (new_seed(0), 5, 0))


def test_a_quarter_turn_holds(pool, base, judge):
    judge.pays(false_alarms.RATE / false_alarms.TESTS)
    turned = {name: rest for name, *rest in symmetry.moved(skewed(0))}["quarter turn"]
    z = false_alarms.between(symmetry.features_of(pool, *turned, (judge.seed(0), 5, 2)), base)
    assert np.abs(z).max() < false_alarms.critical(18)


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_not_the_same_is_found(pool, base, wrong, judge):
    seeds = (judge.seed(0), 6, 0)
    z = false_alarms.between(symmetry.features_of(pool, *WRONG[wrong](skewed(0)), seeds), base)
    assert np.abs(z).max() > 1.5 * false_alarms.critical(18)


def test_a_unit_of_length_changes_nothing(monkeypatch):
    exact, any_unit = symmetry.unit_of_length(1, 2)
    assert (exact.value, any_unit.holds) == (0.0, True)
    right = symmetry.Heightfield
    monkeypatch.setattr(
        symmetry, "Heightfield", lambda heights, unit: right(heights * (1 + (unit != 1)), unit)
    )
    assert not any(found.holds for found in symmetry.unit_of_length(1, 2))
