"""The numbers beside a plot: some at every height, never on each other, the limits among them."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.views.plot_ticks import axis_ticks

LOWEST = 44.0  # [px] Of the axis of the lowest plot that the page makes.


@given(st.floats(1e-3, 1e6), st.floats(LOWEST, 400.0), st.booleans(), st.floats(0.3, 1.0) | st.none())
def test_every_plot_has_numbers_to_both_sides_that_do_not_touch(bound, height, is_signed, share):
    low, limits = (-bound if is_signed else 0.0), () if share is None else (-share * bound, share * bound)
    ticks = axis_ticks(low, bound, height, tuple(limit for limit in limits if limit >= low))
    assert len(ticks) >= 2
    assert ticks[0] < 0.0 or not is_signed
    assert ticks[-1] > 0.0
    assert all(low - 1e-9 * bound <= tick <= bound * (1 + 1e-9) for tick in ticks)
    closest = min(b - a for a, b in itertools.pairwise(ticks))
    assert closest * height / (bound - low) >= 11.0  # [px] Of the font.


def test_a_low_plot_of_errors_has_a_number_beside_zero():
    assert axis_ticks(-0.0462, 0.0462, LOWEST) == (-0.025, 0.0, 0.025)


@pytest.mark.parametrize("height", [LOWEST, 100.0, 250.0])
def test_in_percent_the_limits_are_told_at_every_height(height):
    assert {-100.0, 100.0} <= set(axis_ticks(-112.0, 112.0, height, (-100.0, 100.0)))
    assert {-100.0, 100.0} <= set(axis_ticks(-300.0, 300.0, height, (-100.0, 100.0)))


def test_a_limit_that_takes_many_digits_leaves_its_place_to_round_numbers():
    assert axis_ticks(-139.6, 139.6, LOWEST, (-124.61832, 124.61832)) == (-100.0, 0.0, 100.0)
    assert axis_ticks(-320856.0, 320856.0, LOWEST, (-286478.898, 286478.898)) == (-200000.0, 0.0, 200000.0)
    assert axis_ticks(-190.4, 190.4, LOWEST, (-170.0, 170.0)) == (-170.0, 0.0, 170.0)
