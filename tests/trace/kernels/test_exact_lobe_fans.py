"""Loops of the exact engine's fans against plain arithmetic."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from microsurf.trace.kernels.exact_lobe_fans import sum_of

LIGHT = st.lists(st.floats(0, 1e300, allow_subnormal=False), max_size=45)


@given(LIGHT, st.integers(0, 3))
def test_a_sum_in_four_parts_is_the_sum(numbers, more):
    """Of numbers ≥ 0, whatever they leave over four; what lies behind them is not read.

    Each number goes through at most n/4 + 3 additions, and each of these rounds by 2⁻⁵³.
    """
    count = len(numbers)
    exact = math.fsum(numbers)
    bound = (count / 4 + 3) * 2.0**-53 * exact
    total = sum_of(np.array([*numbers, *[math.nan] * more]), count)
    assert abs(total - exact) <= bound


def test_a_number_left_out_shows():
    """Negative control: of any number of equal ones the bound tells one less."""
    for count in range(1, 46):
        assert sum_of(np.ones(45), count) - (count - 1) > (count / 4 + 3) * 2.0**-53 * count
