"""Slowing down where a limit is passed: nowhere less than asked for, and nowhere far from it."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rcilab.motion.rows import largest_around, spread


@given(st.lists(st.floats(1.0, 9.0), min_size=1, max_size=60), st.integers(0, 40))
def test_the_largest_around_is_the_largest_of_the_window(values, reach):
    expected = [max(values[max(i - reach, 0) : i + reach + 1]) for i in range(len(values))]
    assert largest_around(np.array(values), reach).tolist() == expected


def test_the_knots_beside_a_row_are_slowed_as_much_as_it_asks_for_and_far_ones_are_not():
    knots, s = np.linspace(0.0, 1.0, 11), np.linspace(0.0, 1.0, 1001)
    factor = np.ones(1001)
    factor[345] = 1.5
    slowdown = spread(factor, s, knots, 3)
    assert slowdown[[3, 4]].tolist() == [1.5, 1.5]
    assert np.delete(slowdown, [3, 4]).tolist() == [1.0] * 9
