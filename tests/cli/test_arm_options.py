"""Joint angles, tool, load, safety box and soft limits as options of a command."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.cli.arm_options import parse_box, parse_joints, parse_load, parse_soft_limits, parse_tool
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose


def test_a_unit_after_the_last_angle_is_that_of_all() -> None:
    assert parse_joints("0,30,0,60,0,90,-5deg", 7) == pytest.approx(np.radians([0, 30, 0, 60, 0, 90, -5]))
    assert parse_joints(" 0, .5, 1e-1 ,1., 0, 0 rad", 6) == (0.0, 0.5, 0.1, 1.0, 0.0, 0.0)
    assert parse_joints("90deg,1rad", 2) == pytest.approx((math.pi / 2, 1.0))


def test_a_tool_has_lengths_and_turns_with_their_own_units() -> None:
    expected = Pose.from_rpy((0.0, 0.0, 0.12), (0.0, 0.0, math.pi / 2))
    assert parse_tool("0,0,0.12,0,0,90deg").is_close(expected)
    assert parse_tool("0,0,120mm,0,0,90deg").is_close(expected)
    assert parse_tool("-10,0,120mm").is_close(Pose((-0.01, 0.0, 0.12)))


def test_a_load_is_a_point_mass_at_its_centre() -> None:
    assert parse_load("2").mass == 2.0
    load = parse_load("1500g@0,0,50mm")
    assert (load.mass, load.center_of_mass.tolist()) == (1.5, [0.0, 0.0, 0.05])


def test_a_box_has_edges_and_a_centre() -> None:
    box = parse_box("1,0.8,0.6@400,0,500mm,0,0,90deg")
    assert box.size == (1.0, 0.8, 0.6)
    assert box.T_base_box.is_close(Pose.from_rpy((0.4, 0.0, 0.5), (0.0, 0.0, math.pi / 2)))


def test_soft_limits_have_a_range_for_each_joint() -> None:
    limits = parse_soft_limits("-160:160,-110:90deg", 2)
    assert limits.lower == pytest.approx(np.radians([-160, -110]))
    assert limits.upper == pytest.approx(np.radians([160, 90]))


@pytest.mark.parametrize(
    ("parse", "text", "expected"),
    [
        (lambda text: parse_joints(text, 7), "0,30", "with 7 joint angles"),
        (lambda text: parse_joints(text, 2), "0,x", "--start: '0,x' is not of the form"),
        (lambda text: parse_joints(text, 2), "0,nan", "is not of the form"),
        (lambda text: parse_joints(text, 2), "0,1e999", "not finite"),
        (lambda text: parse_joints(text, 2), "0,1mm", "has the unit 'mm' where rad or deg is expected"),
        (lambda text: parse_joints(text, 3), "0,1deg,2", "one after the last, or one after each"),
        (parse_tool, "0,0", "is not of the form X,Y,Z"),
        (parse_tool, "", "is not of the form X,Y,Z"),
        (parse_tool, "0,0,0.1,90deg", "is not of the form X,Y,Z"),
        (parse_load, "heavy", "with a mass in kg"),
        (parse_load, "-1", "--load: load mass must be a finite number, 0 or more [kg], got -1.0"),
        (parse_load, "1@0,0,50", "metres"),
        (parse_box, "1,1,1", "with its centre after @"),
        (parse_box, "1,-1,1@0,0,0", "three lengths above 0"),
        (lambda text: parse_soft_limits(text, 2), "-1:1", "with 2 ranges"),
        (lambda text: parse_soft_limits(text, 2), "-1:1,2", "with 2 ranges"),
        (lambda text: parse_soft_limits(text, 1), "1:-1", "empty range 1:-1 for joint 1"),
    ],
)
def test_bad_text_is_explained_in_one_sentence(parse, text: str, expected: str) -> None:
    with pytest.raises(InvalidValueError) as raised:
        parse(text)
    message = str(raised.value)
    assert expected in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        pytest.param(
            "0,0,120", "120 m from the flange, at most 2 m; lengths without a unit are in m", id="millimetres"
        ),
        pytest.param("0,0,0.12,0,0,90", "more than 2 pi; angles without a unit are in rad", id="degrees"),
    ],
)
def test_a_tool_without_its_units_is_refused(text: str, expected: str) -> None:
    with pytest.raises(InvalidValueError, match=expected):
        parse_tool(text)
