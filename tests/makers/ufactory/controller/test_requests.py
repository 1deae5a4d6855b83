"""Frames, kinematics, relative and tool motions, signals, gripper, reports and Modbus, as bytes."""

from __future__ import annotations

import struct
from itertools import pairwise

import numpy as np
import pytest

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.controller.gripper import OPEN
from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.poses import pose_as_mm_rpy, pose_from_mm_rotation, pose_from_mm_rpy
from rcilab.makers.ufactory.wire.reports import HIGH_RATE, NORMAL, REAL, REPORTS, RICH
from rcilab.sim.arm_setup import ArmSetup
from tests.makers.ufactory.controller.conftest import Q6, Arm

SPEEDS = (200.0, 2000.0, 0.0)
UNNAMED = float("inf")


def floats(payload: bytes) -> tuple[float, ...]:
    return struct.unpack(f"<{len(payload) // 4}f", payload)


@pytest.mark.parametrize(
    ("model", "pose"),
    [("xArm6", (207.0, 0.0, 112.0)), ("xArm7", (206.0, 0.0, 120.5))],
)
def test_zero_angles_give_the_pose_of_the_client_library(model: str, pose: tuple[float, ...]) -> None:
    arm = Arm(model)
    found = floats(arm.call(Function.GET_FK, "7f", *(0.0,) * 7)[1])
    np.testing.assert_allclose(found[:3], pose, atol=1e-3)
    np.testing.assert_allclose(np.abs(found[3:]), (np.pi, 0.0, 0.0), atol=1e-5)


@pytest.mark.parametrize("model", ["xArm6", "xArm7", "Lite6", "850"])
def test_the_inverse_of_the_forward_kinematics_are_the_reference_angles(model: str) -> None:
    arm = Arm(model)
    random = np.random.default_rng(3)
    n = arm.controller.model.n
    for _ in range(5):
        q = arm.controller.model.home + random.uniform(-0.2, 0.2, n)
        padded = (*q, *(0.0,) * (7 - n))
        pose = floats(arm.call(Function.GET_FK, "7f", *padded)[1])
        status, payload = arm.call(Function.GET_IK, "6fB7f", *pose, 1, *padded)
        assert status & 0x08 == 0
        np.testing.assert_allclose(floats(payload)[:n], q, atol=1e-4)


def test_limits_of_joints_and_poses(arm: Arm) -> None:
    assert arm.call(Function.IS_JOINT_LIMIT, "7f", *Q6, 0.0)[1] == b"\0"
    assert arm.call(Function.IS_JOINT_LIMIT, "7f", Q6[0], 2.5, *Q6[2:], 0.0)[1] == b"\1"
    assert arm.call(Function.IS_TCP_LIMIT, "6f", *arm.pose)[1] == b"\0"
    assert arm.call(Function.IS_TCP_LIMIT, "6f", 2000.0, *arm.pose[1:])[1] == b"\1"


def test_unnamed_axes_keep_their_value_at_the_end_of_the_queue(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose
    arm.move_line((x, y + 30.0, z, *rpy))
    arm.move_line((UNNAMED, UNNAMED, z + 20.0, UNNAMED, UNNAMED, UNNAMED))
    arm.run()
    np.testing.assert_allclose(arm.pose, (x, y + 30.0, z + 20.0, *rpy), atol=1e-2)
    q = arm.q
    arm.move_joints((UNNAMED, q[1] - 0.1, UNNAMED, UNNAMED, UNNAMED, UNNAMED))
    arm.run()
    np.testing.assert_allclose(arm.q, (q[0], q[1] - 0.1, *q[2:]), atol=1e-6)


def test_unnamed_parts_of_a_rotation_vector_keep_the_orientation(arm: Arm) -> None:
    x, y, z = arm.pose[:3]
    turned = pose_from_mm_rpy(arm.pose) @ pose_from_mm_rotation((0.0, 0.0, 0.0, 0.3, -0.4, 0.5))
    arm.move_line((x, y, z, *pose_as_mm_rpy(turned)[3:]))
    arm.run()
    arm.call(Function.MOVE_LINE_AXIS_ANGLE, "9f2B", UNNAMED, y + 20.0, *(UNNAMED,) * 4, *SPEEDS, 0, 0)
    arm.run()
    np.testing.assert_allclose(arm.pose[:3], (x, y + 20.0, z), atol=1e-2)
    np.testing.assert_allclose(pose_from_mm_rpy(arm.pose).rotation, turned.rotation, atol=1e-5)
    arm.call(Function.MOVE_LINE, "10f3B", *(UNNAMED,) * 2, z + 20.0, *(UNNAMED,) * 3, *SPEEDS, -1.0, 0, 1, 0)
    arm.run()
    np.testing.assert_allclose(arm.pose[:3], (x, y + 20.0, z + 20.0), atol=1e-2)
    np.testing.assert_allclose(pose_from_mm_rpy(arm.pose).rotation, turned.rotation, atol=1e-5)


def test_relative_motions_refer_to_the_end_of_the_queue(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose
    step = (0.0, 20.0, -10.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(2):
        arm.call(Function.MOVE_RELATIVE, "11f2B", *step, *SPEEDS, -1.0, 0, 0)
    arm.run()
    np.testing.assert_allclose(arm.pose, (x, y + 40.0, z - 20.0, *rpy), atol=1e-2)
    q = arm.q
    turn = (0.1, 0.0, 0.0, 0.0, 0.0, -0.2, 0.0)
    arm.call(Function.MOVE_RELATIVE, "11f2B", *turn, 1.0, 10.0, 0.0, -1.0, 1, 0)
    arm.run()
    np.testing.assert_allclose(arm.q, np.add(q, turn[:6]), atol=1e-6)


def test_tool_and_axis_angle_motions(arm: Arm) -> None:
    start = pose_from_mm_rpy(arm.pose)
    step = (5.0, 10.0, -20.0, 0.1, -0.1, 0.2)
    arm.call(Function.MOVE_LINE_TOOL, "9f", *step, *SPEEDS)
    arm.run()
    expected = start @ pose_from_mm_rpy(step)
    np.testing.assert_allclose(arm.pose, pose_as_mm_rpy(expected), atol=1e-2)
    arm.call(Function.MOVE_LINE_AXIS_ANGLE, "9f2B", *step, *SPEEDS, 1, 0)
    arm.run()
    expected = expected @ pose_from_mm_rotation(step)
    np.testing.assert_allclose(arm.pose, pose_as_mm_rpy(expected), atol=1e-2)
    arm.call(Function.MOVE_LINE_AXIS_ANGLE, "9f2B", *step, *SPEEDS, 0, 1)
    arm.run()
    turned = pose_from_mm_rotation(step).rotation @ expected.rotation
    np.testing.assert_allclose(pose_from_mm_rpy(arm.pose).rotation, turned, atol=1e-4)
    np.testing.assert_allclose(arm.pose[:3], expected.position * 1e3 + np.array(step[:3]), atol=1e-2)


def test_a_circle_returns_to_its_start_and_passes_its_points(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose
    points = ((x + 30.0, y + 30.0, z), (x + 60.0, y, z))
    values = (*points[0], *rpy, *points[1], *rpy, 300.0, 2000.0, 0.0, 100.0)
    arm.call(Function.MOVE_CIRCLE, "16f3B", *values, 0, 0, 0)
    nearest = [1e9, 1e9]
    while True:
        arm.step()
        position = arm.controller.arm.tool_c.position
        for k, point in enumerate(points):
            nearest[k] = min(nearest[k], float(np.linalg.norm(np.array(position) * 1e3 - point)))
        if not arm.controller.is_moving:
            break
    assert max(nearest) < 0.5
    np.testing.assert_allclose(arm.pose, (x, y, z, *rpy), atol=1e-2)


def test_a_blend_does_not_stop_at_the_corner(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose

    def slowest(radius: float) -> float:
        """Returns the least speed of the tool between its first and last fast cycle, [m/s]."""
        arm.move_line((x, y + 60.0, z, *rpy), radius=radius)
        arm.move_line((x, y + 60.0, z + 60.0, *rpy))
        speeds: list[float] = []
        arm.step()
        while arm.controller.is_moving:
            arm.step()
            speeds.append(float(np.linalg.norm(arm.controller.arm.tool_c.twist[:3])))
        arm.move_line((x, y, z, *rpy))
        arm.run()
        fast = [k for k, speed in enumerate(speeds) if speed > 0.1]
        return min(speeds[fast[0] : fast[-1]])

    assert slowest(-1.0) < 1e-3
    assert slowest(20.0) > 0.05


def test_the_tool_offset_and_the_user_frame_move_the_reported_pose(arm: Arm) -> None:
    flange = pose_from_mm_rpy(arm.pose)
    arm.call(Function.SET_TCP_OFFSET, "6f", 0.0, 0.0, 100.0, 0.0, 0.0, 0.5)
    arm.step()
    tool = flange @ pose_from_mm_rpy((0.0, 0.0, 100.0, 0.0, 0.0, 0.5))
    np.testing.assert_allclose(arm.pose, pose_as_mm_rpy(tool), atol=1e-2)
    user = (50.0, 20.0, 0.0, 0.0, 0.0, 0.3)
    arm.call(Function.SET_WORLD_OFFSET, "6f", *user)
    arm.step()
    expected = pose_from_mm_rpy(user).inverse() @ tool
    np.testing.assert_allclose(arm.pose, pose_as_mm_rpy(expected), atol=1e-2)
    arm.call(Function.SET_STATE, "B", 0)
    goal = (*(value + 10.0 for value in arm.pose[:3]), *arm.pose[3:])
    arm.move_line(goal)
    arm.run()
    np.testing.assert_allclose(arm.pose, goal, atol=1e-2)
    aa = floats(arm.call(Function.GET_TCP_POSE_AXIS_ANGLE)[1])
    np.testing.assert_allclose(pose_from_mm_rotation(aa).rotation, pose_from_mm_rpy(arm.pose).rotation, atol=1e-5)


def test_the_offset_between_two_poses(arm: Arm) -> None:
    first, second = arm.pose, (300.0, 50.0, 200.0, 3.0, 0.1, 0.2)
    found = floats(arm.call(Function.GET_POSE_OFFSET, "12f2B", *first, *second, 0, 0)[1])
    offset: Pose = pose_from_mm_rpy(first).inverse() @ pose_from_mm_rpy(second)
    np.testing.assert_allclose(found, pose_as_mm_rpy(offset), atol=1e-3)


def test_reduced_mode_limits_speeds_and_is_reported(arm: Arm) -> None:
    arm.call(Function.SET_REDUCED_JOINT_SPEED, "f", 0.2)
    arm.call(Function.SET_REDUCED_TCP_SPEED, "f", 50.0)
    arm.call(Function.SET_REDUCED_MODE, "B", 1)
    arm.move_joints((Q6[0] + 0.3, *Q6[1:]), speed=2.0)
    fastest = 0.0
    while True:
        arm.step()
        fastest = max(fastest, *map(abs, arm.controller.arm.commanded.dq))
        if not arm.controller.is_moving:
            break
    assert 0.19 < fastest < 0.2001
    payload = arm.call(Function.GET_REDUCED_STATE)[1]
    assert len(payload) == 79
    assert payload[0] == 1
    np.testing.assert_allclose(floats(payload[13:21]), (50.0, 0.2), atol=1e-5)


def test_the_factor_on_the_tool_speed_of_mode_1_is_set_read_and_acts(arm: Arm) -> None:
    assert floats(arm.call(233, "B", 1)[1]) == pytest.approx((1.2,))
    arm.call(232, "<Bf", 1, 0.05)
    assert floats(arm.call(233, "B", 1)[1]) == pytest.approx((0.05,))
    arm.ready(Mode.SERVO)
    arm.call(Function.SERVO_JOINT, "10f", Q6[0] + 0.1, *Q6[1:], 0.0, 0.0, 0.0, 0.0)
    arm.run(until=lambda: arm.controller.error is not None)
    assert arm.error[0] == 60
    arm.call(232, "<Bf", 2, 0.05)
    assert arm.error[1] == 12


def test_the_teach_sensitivity_changes_how_far_the_hand_moves_the_arm() -> None:
    moved: list[float] = []
    for level in (1, 3, 5):
        arm = Arm(plant="mujoco")
        arm.controller.set_up(ArmSetup(q=Q6))
        arm.call(Function.SET_TEACH_SENSITIVITY, "B", level)
        arm.ready(Mode.TEACH)
        arm.step(310)
        arm.controller.arm.plant.push((0.0, 10.0, 0.0, 0.0, 0.0, 0.0))
        arm.step(300)
        moved.append(abs(arm.q[0] - Q6[0]))
    assert moved[0] < 0.8 * moved[1] < 0.8 * moved[2]


def test_joint_states_have_positions_velocities_and_torques(arm: Arm) -> None:
    for code, values, count in (("", (), 7), ("B", (1,), 7), ("B", (2,), 14), ("B", (3,), 21)):
        payload = arm.call(Function.GET_JOINTS, code, *values)[1]
        assert len(payload) == 4 * count
        np.testing.assert_allclose(floats(payload)[:6], Q6, atol=1e-6)
    torque = floats(arm.call(Function.GET_JOINT_TORQUE)[1])
    np.testing.assert_allclose(torque[:6], arm.controller.arm.measured_state.measured.tau, atol=1e-4)


def test_outputs_are_set_and_wired_back(arm: Arm) -> None:
    arm.controller.loop_back = True
    arm.call(Function.SET_OUTPUTS, ">HB", 0x0101, 1)
    arm.call(Function.SET_OUTPUTS, ">2HB", 0x0000, 0x0202, 1)
    assert arm.call(Function.GET_INPUTS)[1] == struct.pack(">H", 0x0201)
    assert arm.controller.inputs == (0, 9)
    arm.call(Function.SET_ANALOG_2, ">HB", 2048, 1)
    assert arm.call(Function.GET_ANALOG_2)[1] == struct.pack(">H", 2048)
    state = arm.call(Function.GET_IO_STATE)[1]
    assert len(state) == 50
    assert struct.unpack(">8H", state[2:18]) == (0, 0x0201, 0, 0x0201, 0, 2048, 0, 2048)
    payload = struct.pack(">BH", 9, 0x0A15) + struct.pack("<f", float(0x0202))
    arm.call(Function.TOOL_WRITE_16, f"{len(payload)}s", payload)
    assert arm.call(Function.TOOL_READ_16, ">BH", 9, 0x0A14)[1] == struct.pack(">i", 2)


def test_a_wire_carries_the_level_that_its_output_already_has(arm: Arm) -> None:
    arm.call(Function.SET_OUTPUTS, ">HB", 0x0101, 1)
    arm.call(Function.SET_ANALOG_2, ">HB", 2048, 1)
    assert arm.controller.inputs == ()
    arm.controller.loop_back = True
    assert arm.controller.inputs == (0,)
    assert arm.call(Function.GET_ANALOG_2)[1] == struct.pack(">H", 2048)


def test_an_output_waits_for_the_motions_before_it_or_not(arm: Arm) -> None:
    arm.call(Function.SET_FEEDBACK, "B", 4)
    arm.move_joints((Q6[0] + 0.1, *Q6[1:]))
    arm.call(Function.SET_OUTPUTS, ">HB", 0x0101, 1)
    arm.call(Function.SET_OUTPUTS, ">HB", 0x0202, 0)
    assert arm.controller.signals.box_outputs == 2
    arm.run()
    assert arm.controller.signals.box_outputs == 3
    (trigger,) = (frame for frame in arm.link.sent[arm.client] if frame[6] == 0xFF)
    assert (trigger[8], trigger[9], trigger[12]) == (4, Function.SET_OUTPUTS, 0)


def test_an_output_is_set_later_or_at_a_position(arm: Arm) -> None:
    arm.call(Function.DELAYED_OUTPUT, "<2Bf", 3, 1, 0.1)
    arm.step(99)
    assert arm.controller.signals.box_outputs == 0
    arm.step(2)
    assert arm.controller.signals.box_outputs == 8
    x, y, z, *rpy = arm.pose
    arm.call(Function.OUTPUT_AT_POSITION, "<2B4f", 0, 1, x, y + 30.0, z, 2.0)
    arm.move_line((x, y + 60.0, z, *rpy))
    arm.run(until=lambda: arm.controller.signals.box_outputs == 9)
    assert 27.9 < 1e3 * arm.controller.arm.tool_c.position[1] - y < 29.0


def test_a_stop_clears_outputs_where_it_is_configured(arm: Arm) -> None:
    arm.call(Function.SET_OUTPUTS, ">HB", 0x0101, 0)
    arm.call(Function.SET_STATE, "B", 4)
    assert arm.controller.signals.box_outputs == 1
    arm.call(Function.SET_IO_RESET, "2B", 0, 1)
    arm.call(Function.SET_STATE, "B", 4)
    assert arm.controller.signals.box_outputs == 0


def gripper(arm: Arm, frame: str) -> bytes:
    data = bytes.fromhex(frame)
    return arm.call(Function.RS485, f"{len(data)}s", data)[1]


def test_the_gripper_moves_with_its_speed(arm: Arm) -> None:
    assert gripper(arm, "09 08 10 0100 0001 02 0001") == bytes.fromhex("09 08 10 0100 0001")
    gripper(arm, "09 08 10 0303 0001 02 1388")
    gripper(arm, "09 08 10 0700 0002 04 00000064")
    arm.step(500)
    assert gripper(arm, "09 08 03 0000 0001") == bytes.fromhex("09 08 03 02 0001")
    assert 100 < arm.controller.gripper.position < OPEN
    arm.step(4000)
    assert gripper(arm, "09 08 03 0702 0002") == bytes.fromhex("09 08 03 04 00000064")
    assert gripper(arm, "09 08 03 0000 0001") == bytes.fromhex("09 08 03 02 0000")
    assert gripper(arm, "09 08 03 4000 0001") == bytes.fromhex("09 08 83 02")
    assert gripper(arm, "0b 01 03 0000 0001") == b""


def test_reports_come_at_their_rates_and_are_true(arm: Arm) -> None:
    peers = {layout: arm.join(1 + k) for k, layout in enumerate(REPORTS)}
    arm.move_joints((Q6[0] + 0.5, *Q6[1:]))
    arm.step(1000)
    sent = {layout: arm.link.sent[peer] for layout, peer in peers.items()}
    assert [len(sent[layout]) - 1 for layout in (RICH, NORMAL, REAL, HIGH_RATE)] == [5, 5, 100, 200]
    arm.run()
    arm.step(200)
    measured = arm.controller.arm.measured_state.measured
    for layout, frames in sent.items():
        report = frames[-1]
        assert struct.unpack(">I", report[:4]) == (layout.size,)
        at = layout.offsets["q"]
        np.testing.assert_allclose(struct.unpack("<6f", report[at : at + 24]), measured.q, atol=1e-6)
        assert report[layout.offsets["state_and_mode"]] == 2
    rich, at = sent[RICH][-1], RICH.offsets["pose"]
    np.testing.assert_allclose(struct.unpack("<6f", rich[at : at + 24]), arm.pose, rtol=1e-5, atol=1e-4)
    assert (rich[87], rich[88], rich[145], rich[146]) == (0x3F, 0x3F, 6, 6)


def test_the_report_in_real_time_has_the_motion_of_joints_and_tool(arm: Arm) -> None:
    arm.call(Function.SET_WORLD_OFFSET, "6f", 100.0, 0.0, 0.0, 0.0, 0.0, 0.7)
    arm.call(Function.SET_STATE, "B", 0)
    peer = arm.join(1 + REPORTS.index(HIGH_RATE))
    arm.move_joints([x + 0.5 for x in Q6])
    arm.run()

    def column(name: str, count: int) -> np.ndarray:
        at = HIGH_RATE.offsets[name]
        return np.array([struct.unpack(f"<{count}f", report[at : at + 4 * count]) for report in arm.link.sent[peer]])

    fastest = {}
    for names in (("q", "dq", "ddq"), ("target_q", "target_dq", "target_ddq"), ("pose_aa", "twist", "tcp_acceleration"),
                  ("target_pose_aa", "target_twist", "target_tcp_acceleration")):  # fmt: skip
        count = 6 if "q" in names[0] else 3  # Rotation vectors are not the integral of a rotation velocity.
        for value, rate in pairwise(column(name, count) for name in names):
            middle = (value[2:] - value[:-2]) / (2 * 5 * CYCLE_TIME)
            largest = np.abs(rate).max()
            assert np.abs(rate[1:-1] - middle).max() < 0.1 * largest
            fastest[names] = largest
    assert min(fastest.values()) > 1.0


def test_clients_that_leave_are_forgotten(arm: Arm) -> None:
    other, report = arm.join(0), arm.join(1)
    arm.call(Function.SET_FEEDBACK, "B", 2, client=other)
    q = (Q6[0] + 0.2, *Q6[1:], 0.0)
    arm.call(Function.MOVE_JOINT, "10f", *q, 1.0, 10.0, 0.0, client=other)
    arm.server.disconnect(other)
    arm.server.disconnect(report)
    before = len(arm.link.sent[other]), len(arm.link.sent[report])
    arm.run()
    np.testing.assert_allclose(arm.q, q[:6], atol=1e-6)
    assert (len(arm.link.sent[other]), len(arm.link.sent[report])) == before


def modbus(arm: Arm, pdu: str) -> str:
    data = bytes.fromhex(pdu)
    arm.server.receive(arm.client, struct.pack(">HHHB", 9, 0, 1 + len(data), 1) + data)
    return arm.link.sent[arm.client][-1][7:].hex(" ")


def test_standard_modbus_reads_and_writes_the_arm(arm: Arm) -> None:
    assert modbus(arm, "06 0000 0005") == "06 00 00 00 05"
    assert arm.controller.signals.box_outputs == 5
    assert modbus(arm, "01 0000 0008") == "01 01 05"
    assert modbus(arm, "05 0001 ff00") == "05 00 01 ff 00"
    assert arm.controller.signals.box_outputs == 7
    assert modbus(arm, "10 0100 0002 04 0011 0022") == "10 01 00 00 02"
    assert modbus(arm, "03 0100 0002") == "03 04 00 11 00 22"
    joints = struct.unpack(">7h", bytes.fromhex(modbus(arm, "04 0059 0007"))[2:])
    np.testing.assert_allclose(np.array(joints[:6]) / 10.0, np.degrees(Q6), atol=0.06)
    pose = struct.unpack(">3h", bytes.fromhex(modbus(arm, "04 0040 0003"))[2:])
    np.testing.assert_allclose(np.array(pose) / 10.0, arm.pose[:3], atol=0.06)
    assert modbus(arm, "03 0020 0002") == "03 04 00 00 00 02"
    assert modbus(arm, "06 0020 0001") == "06 00 20 00 01"
    assert arm.controller.mode is Mode.SERVO
    assert modbus(arm, "06 0020 0003") == "86 03"
    assert modbus(arm, "06 0021 0000") == "06 00 21 00 00"
    assert arm.state == 2
    assert modbus(arm, "0f 008e 0001 01 01") == "0f 00 8e 00 01"
    assert arm.controller.settings.reduced
    assert modbus(arm, "01 01ff 0002") == "81 02"


@pytest.mark.parametrize(
    "write",
    [
        "06 000a 0001",  # An analog output of the tool, which has none.
        "06 000b 0000",  # Reserved.
        "06 0030 0001",  # An offline task.
        "06 0002 0004",  # The third digital output of the tool.
        "10 0000 0002 04 0001 0001",  # Digital outputs of the box, beyond the 16th too.
        "10 0200 0001 02 0001",
        "05 0010 ff00",  # Its 17th output.
        "05 0028 0000",  # Reserved.
        "05 0086 ff00",  # The brake of joint 7.
        "0f 000f 0002 01 03",
    ],
)
def test_standard_modbus_refuses_to_write_what_would_not_be_kept(arm: Arm, write: str) -> None:
    assert modbus(arm, write) == f"{int(write[:2], 16) | 0x80:02x} 02"
    assert arm.controller.signals.outputs == 0
    assert modbus(arm, "03 0000 0022").startswith("03 44 ")
    assert modbus(arm, "10 0000 0002 04 0001 0000") == "10 00 00 00 02"


def test_the_bit_of_a_brake_switches_its_motor(arm: Arm) -> None:
    for bit, enabled in (("0000", 0x3D), ("ff00", 0x3F)):
        modbus(arm, f"05 0081 {bit}")
        assert arm.controller.enabled == enabled
        assert modbus(arm, "01 0080 000e") == f"01 02 {(enabled | enabled << 7) & 0xFF:02x} {enabled >> 1:02x}"


def test_a_heartbeat_has_no_answer(arm: Arm) -> None:
    before = len(arm.link.sent[arm.client])
    arm.server.receive(arm.client, bytes.fromhex("0000 0001 0002 0000"))
    assert len(arm.link.sent[arm.client]) == before
