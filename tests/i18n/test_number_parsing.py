"""Typed numbers: a value or a sentence, whatever was typed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.text import Text
from rcilab.i18n.number_parsing import parse_number, parse_quaternion


@pytest.mark.parametrize(
    ("typed", "value"),
    [
        ("-0.25", -0.25),
        (" 12 ", 12.0),
        ("-.5", -0.5),
        ("1,5", 1.5),
        ("0,250", 0.25),
        ("1.000", 1.0),
        ("12,2500", 12.25),
        ("−7", -7.0),
        ("45°", 45.0),
        ("45 deg", 45.0),
        ("1e1", 10.0),
    ],
)
def test_numbers_are_read_as_people_write_them(typed, value):
    parsed = parse_number(typed, -170.0, 170.0, "deg")
    assert parsed.value == value
    assert parsed.problem is None


@pytest.mark.parametrize(
    ("typed", "code"),
    [
        ("", "parse.empty"),
        ("abc", "parse.garbage"),
        ("1_000", "parse.garbage"),
        ("1,2,3", "parse.garbage"),
        ("1,000", "parse.two_ways"),
        ("-12,500 deg", "parse.two_ways"),
        ("nan", "parse.not_finite"),
        ("inf", "parse.not_finite"),
        ("1e999", "parse.not_finite"),
        ("170.1", "parse.range"),
        ("-1e5", "parse.range"),
    ],
)
def test_everything_else_is_answered_with_a_sentence(typed, code):
    parsed = parse_number(typed, -170.0, 170.0, "deg")
    assert parsed.value is None
    assert parsed.problem is not None
    assert parsed.problem.code == code
    for language in ("en", "zh"):
        assert "{" not in Text(language).render(parsed.problem).replace(typed, "")


@given(st.text(max_size=200))
def test_any_text_gives_a_value_in_range_or_a_problem(typed):
    parsed = parse_number(typed, -10.0, 10.0, "mm")
    assert (parsed.value is None) != (parsed.problem is None)
    if parsed.value is not None:
        assert math.isfinite(parsed.value)
        assert -10.0 <= parsed.value <= 10.0


@pytest.mark.parametrize("typed", ["0 0 2 0", "(0, 0, 2, 0)", "0;0;2;0", " 0 0  2,0 0 ", "[0 0 2 0]", "0,0,2,0"])
def test_a_typed_quaternion_is_brought_to_length_one(typed):
    assert parse_quaternion(typed).value == (0.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("typed", "code"),
    [
        ("", "parse.quaternion"),
        ("1 0 0", "parse.quaternion"),
        ("0 0 0 0", "parse.no_turn"),
        ("1 0 x 0", "parse.garbage"),
        ("1 0 nan 0", "parse.not_finite"),
    ],
)
def test_what_is_no_orientation_is_answered_in_words(typed, code):
    parsed = parse_quaternion(typed)
    assert parsed.value is None
    assert parsed.problem.code == code


@given(st.floats(-170.0, 170.0))
def test_what_python_prints_is_read_back_to_the_last_bit(number):
    assert parse_number(repr(number), -170.0, 170.0, "deg").value == number
