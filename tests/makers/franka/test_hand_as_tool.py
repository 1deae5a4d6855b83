"""The hand as a tool by name: its frame and its mass."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.cli.arm_options import parse_tool_and_load
from rcilab.core.clearance import LinkPair
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import AsyncMove, Move, SetJointImpedance, SetLoad, SetNEToEE
from rcilab.makers.franka.wire.state_packet import SLICES
from rcilab.makers.franka.wire.versions import VERSION_5, VERSION_10, Status
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


@ARMS
def test_the_floor_and_boxes_see_the_hand(name: str) -> None:
    bare, model = load_model(name), load_model(name, tool="hand")
    flange = Pose([0.45, 0.0, 0.105], bare.forward(model.home).wxyz)  # The fingers are 7 mm below the floor.
    q = bare.inverse(flange, psi=0.0).nearest(model.home)
    assert bare.clearance(q).distance > 0.0
    assert model.clearance(q).distance == pytest.approx(0.105 - 0.1124, abs=1e-4)
    assert str(LinkPair(*model.clearance(q).links.tolist())) == "tool and floor"
    assert model.with_tool(Pose([0.0, 0.0, 0.2])).clearance(q).distance < 0.0  # Another frame on the same hand.
    assert model.with_tool(Pose()).clearance(q).distance > 0.0
    assert model.clearance(model.home).distance > 0.05


@ARMS
def test_the_fingers_rest_on_a_table(name: str) -> None:
    fr3 = load_model(name)
    plant = build_plant("mujoco", fr3)
    controller = FciController(VirtualArm(fr3, plant, prefill=0), VERSION_10 if name == "FR3" else VERSION_5)
    tool, load = parse_tool_and_load("hand", None, name)
    controller.set_up(ArmSetup(T_flange_tool=tool, load=load))
    assert controller.set(SetNEToEE((*np.eye(4).ravel()[:14].tolist(), 0.02, 1.0)))[0] is Status.SUCCESS
    x, y, tip = (controller.arm.signals.tool.pose @ Pose([0.0, 0.0, 0.009 - 0.02])).position
    plant.place_box("table", [0.3, 0.3, 0.1], Pose([x, y, tip - 0.05 - 0.001]))  # 1 mm below the fingertips.
    plant.push([0.0, 0.0, -20.0, 0.0, 0.0, 0.0])
    assert controller.set(SetJointImpedance((100.0,) * 7))[0] is Status.SUCCESS
    far = (10.0, 3.12, 6.28)
    move = AsyncMove(0, 0, far, far) if name == "FR3" else Move(0, 0, far, far)
    assert controller.begin_move(move) is Status.MOTION_STARTED
    q, zero = tuple(controller.arm.commanded.q), (0.0,) * 7
    for k in range(800):
        rest = (0.0,) * 16, (0.0,) * 6, (0.0, -1.0), False, False, zero, False
        controller.receive(CommandPacket(k, q, zero, *rest))
        controller.step()
    yielded = (controller.arm.signals.tool.pose @ Pose([0.0, 0.0, 0.009 - 0.02])).position[2] - tip
    assert -2e-3 < yielded < -0.9e-3  # Without a body the fingers go down by some 50 mm.
