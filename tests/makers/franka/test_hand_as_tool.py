"""The hand as a tool by name: its frame and its mass."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.cli.arm_options import parse_tool_and_load
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model

ARMS = pytest.mark.parametrize("name", ["Panda", "FR3"])


@ARMS
def test_the_hand_is_a_tool_by_name_with_its_mass(name: str) -> None:
    model = load_model(name, tool="hand")
    s = np.sqrt(0.5)
    expected = [[s, s, 0.0, 0.0], [-s, s, 0.0, 0.0], [0.0, 0.0, 1.0, 0.1034], [0.0, 0.0, 0.0, 1.0]]
    np.testing.assert_allclose(model.T_flange_tool.matrix, expected, rtol=0.0, atol=1e-15)
    assert model.load.mass == 0.73
    # At the home pose the flange looks down: the fingertips are below it, and turned straight.
    below = load_model(name).forward(model.home).matrix[:3, 3] - model.forward(model.home).matrix[:3, 3]
    np.testing.assert_allclose(below, [0.0, 0.0, 0.1034], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(model.forward(model.home).matrix[:3, :3], np.diag([1.0, -1.0, -1.0]), atol=1e-12)


def test_it_is_mounted_and_taken_off() -> None:
    model = load_model("FR3").with_tool("Hand")
    assert model.load.mass == 0.73
    assert model.with_tool(Pose((0.0, 0.0, 0.05))).load.mass == 0.73
    assert all(tool.source for tool in model.description.tools)


def test_an_unknown_tool_lists_the_known_ones() -> None:
    with pytest.raises(InvalidValueError, match="'claw' is not a tool of the FR3 by name; known: hand"):
        load_model("FR3", tool="claw")
    with pytest.raises(InvalidValueError, match="xMatePro7 by name; its maker has none"):
        load_model("xMatePro7").with_tool("hand")


def test_on_the_command_line_a_load_replaces_that_of_the_tool() -> None:
    tool, load = parse_tool_and_load("hand", None, "Panda")
    assert tool is not None
    assert load is not None
    assert load.mass == 0.73
    assert parse_tool_and_load("hand", "1.5@0,0,50mm", "Panda")[1].mass == 1.5  # pyright: ignore[reportOptionalMemberAccess]
    assert parse_tool_and_load("0,0,120mm", None, "Panda")[1] is None
    assert parse_tool_and_load(None, None, None) == (None, None)
    with pytest.raises(InvalidValueError, match="--tool: tool: 'claw' is not a tool of the Panda"):
        parse_tool_and_load("claw", None, "Panda")
