"""Requests that cannot be carried out: every one is answered, changes nothing, and the controller goes on."""

from __future__ import annotations

import struct
from math import inf, nan

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.errors import UfactoryWarning
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.reports import REPORTS
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.arm_setup import ArmSetup
from tests.makers.ufactory.controller.conftest import Q6, Arm

INVALID, WARNING = 0x08, 0x20
HUGE = 3e38
BOARD, GRIPPER = 9, 8


@pytest.mark.parametrize(
    ("function", "code", "values", "size"),
    [
        (Function.TOOL_WRITE_16, ">BH4s", (BOARD, 0x0A15, struct.pack("<f", nan)), 0),
        (Function.TOOL_WRITE_16, ">BH4s", (BOARD, 0x0A0B, struct.pack("<f", inf)), 0),
        (Function.TOOL_WRITE_16, ">BH4s", (GRIPPER, 0x9999, struct.pack("<f", 1.0)), 0),
        (Function.TOOL_WRITE_32, ">BH4s", (GRIPPER, 0x0700, struct.pack("<f", nan)), 0),
        (Function.TOOL_WRITE_32, ">BH4s", (GRIPPER, 0x9999, struct.pack("<f", 1.0)), 0),
        (Function.TOOL_READ_16, ">BH", (GRIPPER, 0x9999), 4),
        (Function.TOOL_READ_32, ">BH", (GRIPPER, 0x9999), 4),
        (Function.GET_COMMON_PARAMETER, "B", (7,), 56),
        (Function.GET_COMMON_INFORMATION, "B", (99,), 4),
        (Function.GET_POSE_OFFSET, "12f2B", (HUGE,) * 3 + (0.5,) * 3 + (-HUGE,) * 3 + (0.5,) * 3 + (0, 0), 24),
        (Function.GET_FK, "7f", (nan,) * 7, 24),
        (Function.GET_IK, "6f", (nan,) * 6, 28),
        (Function.GET_IK, "6fB7f", (300.0, 0.0, 200.0, 3.0, 0.0, 0.0, 1, *(nan,) * 7), 28),
        (Function.SET_WORLD_OFFSET, "6f", (HUGE,) * 3 + (0.5,) * 3, 0),
        (Function.SET_REDUCED_JOINT_RANGE, "14f", (1e38, 2e38) * 7, 0),
    ],
)
def test_a_request_with_impossible_values_is_answered(
    arm: Arm, function: int, code: str, values: tuple[float, ...], size: int
) -> None:
    before = arm.controller.settings
    status, payload = arm.call(function, code, *values)
    assert status == INVALID | WARNING
    assert payload == bytes(size)
    assert arm.error == (0, UfactoryWarning.PARAMETER)
    assert "W12, a parameter of a request is outside its range: " in arm.link.logged[-1]
    assert arm.controller.settings is before
    assert arm.state == 2


@pytest.mark.parametrize(
    ("function", "code"),
    [
        (Function.SET_TCP_OFFSET, "6f"),
        (Function.SET_WORLD_OFFSET, "6f"),
        (Function.SET_LOAD, "4f"),
        (Function.SET_GRAVITY_DIRECTION, "3f"),
        (Function.SET_TCP_JERK, "f"),
        (Function.SET_TCP_ACCELERATION, "f"),
        (Function.SET_JOINT_JERK, "f"),
        (Function.SET_JOINT_ACCELERATION, "f"),
        (Function.SET_REDUCED_TCP_SPEED, "f"),
        (Function.SET_REDUCED_JOINT_SPEED, "f"),
        (Function.SET_REDUCED_JOINT_RANGE, "14f"),
        (Function.SET_COLLISION_TOOL, "6fB"),
        (Function.SET_COMMON_PARAMETER, "Bf"),
    ],
)
def test_no_setting_is_beyond_what_reports_can_hold(arm: Arm, function: int, code: str) -> None:
    peers = [arm.join(1 + k) for k, _ in enumerate(REPORTS)]
    count = len(struct.unpack(f"<{code}", bytes(struct.calcsize(f"<{code}"))))
    for value in (HUGE, -HUGE, inf, nan):
        numbers = [value] * count
        if function == Function.SET_COLLISION_TOOL:
            numbers[-1] = 1
        if function == Function.SET_COMMON_PARAMETER:
            numbers[0] = 1
        arm.call(function, code, *numbers)
        arm.step(200)
        arm.server.receive(arm.client, bytes.fromhex("0001 0000 0006 01 04 0040 002f"))
        assert arm.link.sent[arm.client][-1][7:9] == b"\x04\x5e"
    assert all(len(arm.link.sent[peer]) > 4 for peer in peers)
    arm.ready()
    assert arm.move_joints(Q6) == 0


def test_a_load_that_is_refused_changes_nothing(arm: Arm) -> None:
    arm.move_joints((Q6[0] + 0.3, *Q6[1:]))
    arm.step(100)
    before = arm.controller.settings
    assert arm.call(Function.SET_LOAD, "4f", 50.0, 0.0, 0.0, 0.0)[0] & INVALID
    assert arm.controller.settings is before
    assert arm.state == 1
    arm.run()
    np.testing.assert_allclose(arm.q, (Q6[0] + 0.3, *Q6[1:]), atol=1e-6)
    with pytest.raises(InvalidValueError, match="load"):
        arm.controller.set_up(ArmSetup(load=Payload(mass=50.0)))
    assert arm.controller.settings is before


def test_motors_that_are_on_can_be_switched_on_again(arm: Arm) -> None:
    arm.move_joints((Q6[0] + 0.3, *Q6[1:]))
    arm.step(100)
    assert arm.call(Function.MOTION_ENABLE, "2B", 8, 1)[0] == 0
    assert arm.state == 1
    arm.run()
    np.testing.assert_allclose(arm.q, (Q6[0] + 0.3, *Q6[1:]), atol=1e-6)
    arm.call(Function.MOTION_ENABLE, "2B", 8, 0)
    assert arm.state == 4


def test_a_failure_inside_the_controller_is_logged_and_answered(arm: Arm) -> None:
    del arm.controller.gripper
    status, payload = arm.call(Function.TOOL_READ_16, ">BH", GRIPPER, 0x0801)
    assert (status & INVALID, payload) == (INVALID, bytes(4))
    assert "a request failed inside the controller (AttributeError: " in arm.link.logged[-1]
    assert "io_requests.py, line " in arm.link.logged[-1]
    assert arm.state == 2


def test_functions_that_do_not_exist_here_are_answered_in_full(arm: Arm) -> None:
    for function, size in ((65, 1), (111, 12), (204, 40), (230, 12), (99, 0)):
        arm.call(Function.CLEAN_WARNING)
        assert arm.call(function) == (WARNING, bytes(size))
        assert f"function {function} was refused: W13, " in arm.link.logged[-1]


def test_an_on_line_target_without_a_curve_is_an_error(arm: Arm) -> None:
    arm.ready(Mode.JOINT_ONLINE)
    arm.call(Function.MOVE_JOINT, "10f", Q6[0] + 1.0, *Q6[1:], 0.0, 2.0, 20.0, 0.0)
    arm.step(100)
    arm.call(Function.MOVE_JOINT, "10f", Q6[0] - 1.0, *Q6[1:], 0.0, 2.0, 1e-30, 0.0)
    assert arm.error[0] == 25
    arm.run()
    assert arm.state == 4
