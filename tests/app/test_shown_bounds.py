"""A bound that is typed as it is shown is taken, although what is shown is rounded."""

from __future__ import annotations

import math

import pytest

from rcilab.i18n.number_parsing import parse_number


@pytest.mark.parametrize(
    ("typed", "low", "high", "value"),
    [
        ("-11", math.degrees(-0.19198), 225.0, math.degrees(-0.19198)),
        ("1146", 5.73, 1145.9156, 1145.9156),
        ("1145.92", 5.73, 1145.9156, 1145.9156),
        ("120", -118.0, 120.0, 120.0),
    ],
)
def test_a_bound_as_it_is_shown_is_the_bound(typed: str, low: float, high: float, value: float) -> None:
    assert parse_number(typed, low, high, "deg").value == value


def test_a_number_beyond_what_is_shown_is_refused() -> None:
    assert parse_number("-11.01", math.degrees(-0.19198), 225.0, "deg").value is None
