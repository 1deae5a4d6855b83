"""Degrees or radians, millimetres or metres: converted at one place, kept nowhere."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.text import Text
from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import ComparedValue, message
from rcilab.i18n.units import SI, Unit, Units


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_unit_in_a_catalogue_belongs_to_a_variable(language):
    """What does not would stay as it is when the units change, beside numbers that do not."""
    for code, entry in load_ui_catalogue("rcilab.app", language).items():
        if code.startswith(("unit.", "source.", "limit.")):  # The last two quote the makers' manuals.
            continue
        bare = re.sub(r"\{[^}]*\}", "", entry)
        assert not re.search(r"°|\bdeg\b|\bmm\b|\bmillimet|\bdegrees?\b|\brad\b|毫米|弧度|\d\s?度", bare), (code, entry)


def test_sentences_are_said_in_the_units_of_the_page():
    said = message("reach.short", distance=0.042, turn=math.radians(12.5))
    assert Text("en").render(said) == "42 mm and 12.5°"
    assert Text("en", SI).render(said) == "0.042 m and 0.218 rad"
    assert Text("zh", Units(angle="rad")).render(said) == "42 mm、0.218 rad"
    assert Text("en", SI)("jog.speed_value", tool=0.25, joint=math.radians(30.0)) == "0.250 m/s, 0.52 rad/s"
    assert Text("en", SI)("setup.pose", place=(0.01, -0.0205, 0.0), turns=(math.radians(90.0), 0.0, -0.0)) == (
        "0.010, -0.0205, 0.000 m, 1.57, 0.00, 0.00 rad"
    )
    assert Text("en", SI)("target.pose") == "Tool pose [m, rad]"


def test_numbers_of_the_text_itself_are_said_in_the_units_of_the_page():
    assert Text("en")("program.hint.psi").startswith("Arm angle at the waypoint, -180° to 180°.")
    assert Text("en", SI)("program.hint.psi").startswith("Arm angle at the waypoint, -3.14 rad to 3.14 rad.")
    assert "0.250 m/s and 0.79 rad/s for the tool" in Text("en", SI)("jog.speed_hint")


def test_several_numbers_and_ranges_have_one_unit():
    ranges = ((math.radians(-10.0), math.radians(20.0)), (0.0, math.radians(5.0)))
    assert Text("en")("setup.joints_are", ranges=ranges) == "-10…20, 0…5°"
    assert Text("en")("setup.box_on", x=0.06, y=1.2, z=0.5, center=(0.0, 0.0, 0.9)) == (
        "on, 60 × 1200 × 500 mm, centre 0, 0, 900 mm"
    )


@pytest.mark.parametrize(
    ("value", "spec", "usual", "si"),
    [
        (0.35, "rad.1f", "20.1°", "0.350 rad"),
        (0.0123, "m.1z", "12.3 mm", "0.0123 m"),
        (0.01, "m.1z", "10 mm", "0.010 m"),
        (1.0, "m/s.3g", "1e+03 mm/s", "1 m/s"),
        (-1e-9, "m.0f#", "0", "0.000"),
    ],
)
def test_a_variable_says_its_unit_and_its_digits(value, spec, usual, si):
    assert Units().format(value, spec) == usual
    assert SI.format(value, spec) == si


def test_the_same_amounts_of_a_remark_are_said_in_either_unit():
    amount = ComparedValue(2.31, 2.175, "rad/s")
    assert amount.explain("en") == "2.31 rad/s"
    assert amount.explain("en", Units()) == "132.4°/s"
    assert ComparedValue(0.35, 0.35, "N m").explain("en", Units()) == "0.35 N·m"


def test_a_sentence_inside_a_sentence_is_converted_once():
    said = message("notice.arrived_short", short=message("reach.short", distance=0.042, turn=math.radians(12.5)))
    assert "0.042 m and 0.218 rad short" in Text("en", SI).render(said)


@pytest.mark.parametrize(
    ("typed", "unit", "value"),
    [
        ("-0.5 rad", "deg", math.degrees(-0.5)),
        ("0.12 m", "mm", 120.0),
        ("12 mm", "mm", 12.0),
        ("30 °", "deg", 30.0),
        ("0.5 rad/s", "°/s", math.degrees(0.5)),
        ("0.5 rad/s^2", "°/s²", math.degrees(0.5)),
        ("0.1 m/s", "mm/s", 100.0),
    ],
)
def test_a_number_counts_in_the_unit_typed_behind_it(typed, unit, value):
    assert parse_number(typed, -170.0, 170.0, unit).value == pytest.approx(value, abs=1e-12)


def test_a_number_out_of_range_is_answered_in_the_units_of_the_page():
    problem = parse_number("9 rad", -170.0, 170.0, "deg").problem
    assert problem is not None
    assert Text("en", SI).render(problem) == "9 rad is outside -2.97 rad to 2.97 rad and is not used."
    problem = parse_number("9 rad/s", 0.0, 180.0, "°/s").problem
    assert problem is not None
    assert Text("en", SI).render(problem) == "9 rad/s is outside 0 rad/s to 3.142 rad/s and is not used."


def test_what_is_typed_without_a_unit_counts_in_that_of_the_page():
    assert SI.unit("deg").complete("-0.25") == "-0.25 rad"
    assert SI.unit("deg").complete("20 deg") == "20 deg"
    assert (SI.unit("°/s²").complete("3"), SI.unit("°/s²").complete("3 °/s^2")) == ("3 rad/s²", "3 °/s^2")
    assert Units().unit("deg").complete("-0.25") == "-0.25"


@given(st.floats(-360.0, 360.0), st.sampled_from(["deg", "mm"]))
def test_a_field_that_is_typed_back_moves_nothing_by_more_than_it_shows(value, usual):
    unit = SI.unit(usual)
    typed = unit.complete(unit.convert(f"{value:.2f}"))
    parsed = parse_number(typed, -1e3, 1e3, usual)
    assert parsed.value == pytest.approx(round(value, 2), abs=0.005)


def test_other_units_stay():
    assert SI.unit("kg") == Unit("kg", 1.0)
    assert SI.from_si("N m/s") == (1.0, "N·m/s")
    assert Units().from_si("rad/s^2") == (pytest.approx(math.degrees(1.0)), "°/s²")
    assert Units().from_si("m/s") == (1000.0, "mm/s")


def test_a_bound_that_means_nothing_at_all_is_no_computer_number():
    assert Units().format_numbers("rad", 0.0, 1e-9) == ("0", "5.7·10⁻⁸")
    assert Units().format_numbers("m", -2.0e-9, 1e-9) == ("-2.0·10⁻⁶", "10⁻⁶")
    assert Units().format_numbers("m", 0.1234, 0.5) == ("123.4", "500")


def test_two_numbers_that_differ_look_different():
    for units in (SI, Units()):
        first, second = units.format_numbers("rad/s", 2.17501, 2.175)
        assert first != second
    assert Units().format_numbers("rad/s^3", 5000.0, 5000.0) == ("286479", "286479")
    assert Units().with_unit("286479", "rad/s^3") == "286479°/s³"
    assert SI.with_unit("0.02", "m") == "0.02 m"
