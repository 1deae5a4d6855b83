"""The hand as a tool by name: its frame and its mass."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.cli.arm_options import parse_tool_and_load
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.wire.requests import SetLoad
from rcilab.makers.franka.wire.state_packet import SLICES
from rcilab.makers.franka.wire.versions import VERSION_10, Status
from rcilab.model.robot_model import load_model
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

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


def test_a_virtual_arm_with_the_hand_reports_it_as_end_effector_beside_the_load_of_a_client() -> None:
    fr3 = load_model("FR3")
    controller = FciController(VirtualArm(fr3, build_plant("ideal", fr3), prefill=0), VERSION_10)
    tool, load = parse_tool_and_load("hand", None, "FR3")
    controller.set_up(ArmSetup(T_flange_tool=tool, load=load))
    assert controller.set(SetLoad(0.5, (0.0, 0.0, 0.1), (0.0,) * 9))[0] is Status.SUCCESS
    controller.step()

    def shown(name: str) -> list[float]:
        return controller.packet.numbers[SLICES[name]].tolist()

    s = float(np.sqrt(0.5))
    hand = [s, -s, 0.0, 0.0, s, s, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.1034, 1.0]
    assert shown("F_T_EE") == shown("F_T_NE") == pytest.approx(hand)
    assert shown("m_ee") == [0.73]
    assert shown("F_x_Cee") == [-0.01, 0.0, 0.03]
    assert shown("I_ee") == [0.001, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.0017]
    assert shown("m_load") == [0.5]
    assert controller.settings.load.mass == pytest.approx(1.23)
