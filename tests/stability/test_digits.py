import math

import numpy as np
import pytest

from microsurf.stability import digits, domain
from microsurf.stability.reference import EXACT, real


def test_digits_of_known_errors():
    assert digits.right(1.0, real(1)) == digits.MOST
    assert digits.right(1 + 1e-6, real(1)) == pytest.approx(6, abs=1e-9)
    assert digits.right(3.0, real(1)) == 0
    assert digits.right(math.nan, real(1)) == 0
    assert digits.right(math.inf, real(1)) == 0
    # An exact 0 is met by 0; below the smallest normal double the error is absolute.
    assert digits.right(0.0, real(0)) == digits.MOST
    assert digits.right(5e-324, real(0)) > 15
    assert digits.right(1e-300, real(0)) == 0


def test_condition_of_known_functions():
    # x − y at 1 and 0.999: (x + y)/|x − y|; a power has its exponent.
    found = digits.condition(lambda x, y: x - y, (1.0, 0.999), ("x", "y"))
    assert found == pytest.approx(1.999 / 0.001, rel=1e-9)
    assert digits.condition(lambda x: x**3, (0.1,), ("x",)) == pytest.approx(3, rel=1e-15)
    assert digits.condition(lambda x: x - 1, (1.0,), ("x",)) == 0
    assert digits.condition(lambda g: 1 / g, (math.inf,), ("gamma",)) == 0
    # γ only goes up from its border, all others go down.
    root = digits.condition(
        lambda g: EXACT.sqrt(g - 1.5), (float(np.nextafter(1.5, 2)),), ("gamma",)
    )
    assert root == pytest.approx(1.5 / 2.0**-52 / 2, rel=1e-6)


def test_conditioning_is_forgiven_and_no_more():
    assert digits.kept(1e-6, 1e6) == pytest.approx(12)
    assert digits.kept(1e-6, 1e-3) == pytest.approx(6)
    assert digits.attainable(0.1) == digits.MOST
    assert digits.attainable(1e5) == pytest.approx(digits.MOST - 5)
    assert digits.attainable(1e30) == 0


def test_values_near_a_border_are_written_by_their_distance():
    assert domain.ticked("gamma", float(np.nextafter(1.5, 2))) == "1.5+2e-16"
    assert domain.ticked("n", 1 + 1e-9) == "1+1e-9"
    assert domain.ticked("u", 1 - 2.0**-53) == "1-1e-16"
    assert domain.ticked("gamma", math.inf) == "∞"
    assert domain.ticked("theta", 89.99999) == "89.99999"
    for values in (domain.QUICK, domain.FULL):
        assert values.keys() == domain.QUICK.keys()
        for name, entries in values.items():
            labels = [domain.ticked(name, value) for value in entries]
            assert len(set(labels)) == len(labels)
            assert set(domain.QUICK[name]) <= set(domain.FULL[name])
            assert name in domain.SYMBOLS
