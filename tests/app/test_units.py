"""Degrees or radians, millimetres or metres: converted at one place, kept nowhere."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.text import LANGUAGES, Text, load_catalogue, message
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.units import Unit, Units

SI = Units(angle="rad", length="m")


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_unit_in_a_catalogue_stands_behind_a_number_or_is_a_place_to_fill(language):
    """What is not so would stay as it is when the units change, beside numbers that do not."""
    for code, entry in load_catalogue(language).items():
        if code.startswith("unit."):
            continue
        bare = re.sub(r"(\{\w+\}|\d)\s?(°|deg\b|mm\b)|\{in_deg\}|\{in_mm\}", "", entry)
        assert not re.search(r"°|\bdeg\b|\bmm\b|\bmillimet|\bdegrees?\b|\brad\b|毫米|弧度|\d\s?度", bare), (code, entry)


def test_sentences_are_said_in_the_units_of_the_page():
    said = message("reach.short", mm="42", deg="12.5")
    assert Text("en").say(said) == "42 mm and 12.5°"
    assert Text("en", SI).say(said) == "0.042 m and 0.218 rad"
    assert Text("zh", Units(angle="rad")).say(said) == "42 mm、0.218 rad"
    assert Text("en", SI)("jog.pace", mm="250", turn="45", joint="30") == "0.250 m/s, 0.52 rad/s"
    assert Text("en", SI)("setup.pose", place="10, -20.5, 0", turns="90, 0, 0") == (
        "0.010, -0.0205, 0.000 m, 1.57, 0.00, 0.00 rad"
    )
    assert Text("en", SI)("target.pose") == "Tool pose [m, rad]"


def test_a_sentence_inside_a_sentence_is_converted_once():
    said = message("notice.arrived_short", short=message("reach.short", mm="42", deg="12.5"))
    assert "0.042 m and 0.218 rad short" in Text("en", SI).say(said)


@pytest.mark.parametrize(
    ("typed", "unit", "value"),
    [("-0.5 rad", "deg", math.degrees(-0.5)), ("0.12 m", "mm", 120.0), ("12 mm", "mm", 12.0), ("30 °", "deg", 30.0)],
)
def test_a_number_counts_in_the_unit_typed_behind_it(typed, unit, value):
    assert parse_number(typed, -170.0, 170.0, unit).value == pytest.approx(value, abs=1e-12)


def test_a_number_out_of_range_is_answered_in_the_units_of_the_page():
    problem = parse_number("9 rad", -170.0, 170.0, "deg").problem
    assert problem is not None
    assert Text("en", SI).say(problem) == "9 rad is outside -2.97 rad to 2.97 rad."


def test_what_is_typed_without_a_unit_counts_in_that_of_the_page():
    assert SI.unit("deg").complete("-0.25") == "-0.25 rad"
    assert SI.unit("deg").complete("20 deg") == "20 deg"
    assert Units().unit("deg").complete("-0.25") == "-0.25"


@given(st.floats(-360.0, 360.0), st.sampled_from(["deg", "mm"]))
def test_a_field_that_is_typed_back_moves_nothing_by_more_than_it_shows(value, usual):
    unit = SI.unit(usual)
    typed = unit.complete(unit.restate(f"{value:.2f}"))
    parsed = parse_number(typed, -1e3, 1e3, usual)
    assert parsed.value == pytest.approx(round(value, 2), abs=0.005)


def test_other_units_stay():
    assert SI.unit("kg") == Unit("kg", 1.0)
    assert SI.from_si("N m/s") == (1.0, "N·m/s")
    assert Units().from_si("rad/s^2") == (pytest.approx(math.degrees(1.0)), "°/s²")
    assert Units().from_si("m/s") == (1000.0, "mm/s")


def test_a_bound_that_means_nothing_at_all_is_no_computer_number():
    assert Units().numbers("rad", 0.0, 1e-9) == ("0", "5.7·10⁻⁸")
    assert Units().numbers("m", -2.0e-9, 1e-9) == ("-2.0·10⁻⁶", "10⁻⁶")
    assert Units().numbers("m", 0.1234, 0.5) == ("123.4", "500")


@pytest.mark.parametrize(
    ("said", "usual", "si"),
    [
        ("joint 2: 2.31 rad/s exceeds 2.175 rad/s", "joint 2: 132°/s exceeds 124.6°/s", None),
        ("passes 0.35 rad (20.05°)", "passes 20.1°", "passes 0.35 rad"),
        ("not between -2.97 and 2.97 rad", "not between -170 and 170°", None),
        ("from 10 to 20 mm", None, "from 0.01 to 0.02 m"),
        ("start [0.1, -0.2, 0.35] m away", "start [100, -200, 350] mm away", None),
        ("6 rad/s^2 at t = 0.412 s, 60 N, 5 ms, 12 N m", "344°/s² at t = 0.412 s, 60 N, 5 ms, 12 N m", None),
        ("a box of 60 mm, 2.9° beside joint 1", None, "a box of 0.06 m, 0.0506 rad beside joint 1"),
        ("links 5, 0.02 m apart; 3 messages; 4 MB", "links 5, 20 mm apart; 3 messages; 4 MB", None),
    ],
)
def test_a_finished_sentence_is_restated_number_by_number(said, usual, si):
    assert Units().restate(said) == (said if usual is None else usual)
    assert SI.restate(said) == (said if si is None else si)


def test_two_numbers_that_differ_look_different():
    for units in (SI, Units()):
        first, second = units.numbers("rad/s", 2.17501, 2.175)
        assert first != second
    assert Units().numbers("rad/s^3", 5000.0, 5000.0) == ("286479", "286479")
    assert Units().with_unit("286479", "rad/s^3") == "286479°/s³"
    assert SI.with_unit("0.02", "m") == "0.02 m"
