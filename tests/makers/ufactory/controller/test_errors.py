"""Each error and warning is raised by its condition, stops the arm, and is cleaned."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.errors import UsageError
from rcilab.makers.ufactory.controller.modes import Mode, State
from rcilab.makers.ufactory.controller.reporter import encode_report
from rcilab.makers.ufactory.controller.xarm_controller import LARGEST_QUEUE
from rcilab.makers.ufactory.wire.frame import STATUS_ERROR, STATUS_INVALID, STATUS_WARNING
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.identity import IDENTITIES
from rcilab.makers.ufactory.wire.reports import RICH
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.arm_setup import ArmSetup
from tests.makers.ufactory.controller.conftest import ALL, Q6, Arm

NOTHING = (0.0,) * 4


def press(arm: Arm) -> None:
    arm.controller.press_button("estop")


def open_input(arm: Arm) -> None:
    arm.controller.press_button("gstop")


def press_switch(arm: Arm) -> None:
    arm.controller.press_button("switch")


def over_the_base(arm: Arm) -> None:
    """Moves on a line between two reachable poses that passes the axis of joint 1."""
    arm.controller.set_up(ArmSetup(q=Q6))
    x, y, z, roll, pitch, yaw = arm.pose
    arm.move_line((-x, -y, z, roll, pitch, yaw))


def to_another_branch_on_line(arm: Arm) -> None:
    """The end has joint angles, but with joint 5 on its other side."""
    arm.ready(Mode.CARTESIAN_ONLINE)
    _, pose = arm.call(Function.GET_FK, "7f", 0.904, -0.806, 0.064, -0.78, -0.42, -1.953, 0.0)
    arm.move_line(struct.unpack("<6f", pose))


def out_of_reach(arm: Arm) -> None:
    arm.move_line((1500.0, 0.0, 300.0, 3.1, 0.0, 0.0))


def beyond_the_range(arm: Arm) -> None:
    arm.move_joints((Q6[0], Q6[1], 0.5, *Q6[3:]))


def through_itself(arm: Arm) -> None:
    arm.move_joints((0.2, 0.7, 0.0, 0.0, 1.9, 0.3))  # The wrist reaches the base.


def fast_at_a_singularity(arm: Arm) -> None:
    arm.move_joints((0.0, -0.5, -0.8, 0.0, 0.02, 0.0))
    arm.run()
    x, y, z, roll, pitch, yaw = arm.pose
    arm.move_line((x, y, z, roll + 0.5, pitch, yaw), speed=900.0)


def points_on_a_line(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose
    values = (x, y + 30.0, z, *rpy, x, y + 60.0, z, *rpy, 100.0, 1000.0, 0.0, 50.0)
    arm.call(Function.MOVE_CIRCLE, "16f3B", *values, 0, 0, 0)


def leave_the_boundary(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose
    bounds = (int(x) + 50, int(x) - 50, int(y) + 20, int(y) - 50, int(z) + 50, int(z) - 50)
    arm.call(Function.SET_BOUNDARY, "6i", *bounds)
    arm.call(Function.SET_FENCE, "B", 1)
    arm.move_line((x, y + 40.0, z, *rpy))


def fast_servo_targets(arm: Arm) -> None:
    arm.ready(Mode.SERVO)
    arm.call(Function.SERVO_JOINT, "10f", *(angle + 0.5 for angle in Q6), *NOTHING)


def leave_the_reduced_range(arm: Arm) -> None:
    narrow = [bound for angle in (*Q6, 0.0) for bound in (angle - 0.1, angle + 0.1)]
    arm.call(Function.SET_REDUCED_JOINT_RANGE, "14f", *narrow)
    arm.call(Function.SET_REDUCED_MODE, "B", 1)
    arm.move_joints((Q6[0] + 0.2, *Q6[1:]))


def velocity_beyond_reach(arm: Arm) -> None:
    arm.ready(Mode.CARTESIAN_VELOCITY)
    arm.call(Function.CARTESIAN_VELOCITY, "6fB", 200.0, *(0.0,) * 5, 0)


CAUSES: list[tuple[int, Callable[[Arm], None]]] = [
    (1, press),
    (2, open_input),
    (3, press_switch),
    (21, out_of_reach),
    (21, velocity_beyond_reach),
    (22, through_itself),
    (23, beyond_the_range),
    (23, leave_the_reduced_range),
    (24, fast_at_a_singularity),
    (25, points_on_a_line),
    (35, leave_the_boundary),
    (40, over_the_base),
    (40, to_another_branch_on_line),
    (60, fast_servo_targets),
]


@pytest.mark.parametrize(("number", "cause"), CAUSES, ids=[cause.__name__ for _, cause in CAUSES])
def test_an_error_is_raised_by_its_condition_and_stops_the_arm(
    arm: Arm, number: int, cause: Callable[[Arm], None]
) -> None:
    cause(arm)
    arm.run(until=lambda: arm.controller.error is not None)
    assert arm.controller.error == number
    assert arm.controller.reason
    assert arm.state == State.STOPPED
    assert arm.move_joints(Q6) & STATUS_ERROR
    arm.run()
    assert arm.controller.queued == 0
    arm.controller.press_button("none")
    arm.call(Function.SET_FENCE, "B", 0)
    arm.call(Function.SET_REDUCED_MODE, "B", 0)
    arm.ready()
    assert arm.move_joints(Q6) == 0
    arm.run()
    np.testing.assert_allclose(arm.q, Q6, atol=1e-6)
    assert arm.error == (0, 0)


def test_a_servo_target_raises_c60_above_the_bound_of_the_check_and_not_below_it(arm: Arm) -> None:
    bound = arm.controller.model.limits.joint_tool_velocity
    far = (0.2, 0.6, -1.8, 0.0, 1.2, 0.0)
    arm.controller.set_up(ArmSetup(q=far))
    arm.ready(Mode.SERVO)
    lever = float(np.linalg.norm(arm.controller.arm.tool_c.position[:2]))
    speeds: list[float] = []
    angle = far[0]
    for cycle in range(600):  # Ever faster.
        angle += 0.5 * cycle / 200 * 0.001 * bound / lever
        if cycle % 4 == 0:
            arm.call(Function.SERVO_JOINT, "10f", angle, *far[1:], *NOTHING)
        arm.step()
        if arm.controller.error is not None:
            break
        speeds.append(float(np.linalg.norm(arm.controller.arm.tool_c.twist[:3])))
    assert arm.controller.error == 60
    assert 0.95 * bound < max(speeds) < 1.01 * bound


def test_an_emergency_stop_switches_the_motors_off_and_stays_while_it_is_pressed(arm: Arm) -> None:
    press(arm)
    arm.step()
    assert arm.controller.enabled == 0
    arm.call(Function.CLEAN_ERROR)
    assert arm.error == (1, 0)
    arm.controller.press_button("none")
    arm.call(Function.CLEAN_ERROR)
    assert arm.error == (0, 0)
    arm.call(Function.SET_STATE, "B", 0)
    assert arm.state == State.STOPPED, "the motors are off"


def test_inside_the_boundary_the_arm_moves_and_outside_only_inwards(arm: Arm) -> None:
    leave_the_boundary(arm)
    arm.run()
    assert arm.error[0] == 35
    outside = arm.pose[1]
    arm.ready()
    x, y, z, *rpy = arm.pose
    arm.move_line((x, y - 30.0, z, *rpy))
    arm.run()
    assert arm.error == (0, 0)
    assert arm.pose[1] < outside - 25.0


def test_a_target_rounded_outwards_does_not_stop_an_arm_outside_its_boundary(arm: Arm) -> None:
    leave_the_boundary(arm)
    arm.run()
    arm.ready(Mode.SERVO)
    first, *others = arm.q
    for off, error in ((0.0, 0), (5e-7, 0), (-1e-4, 0), (5e-7 - 1e-4, 0), (1e-4, 35)):  # 1e-4 rad are 0.04 mm.
        for _ in range(3):
            arm.call(Function.SERVO_JOINT, "10f", first + off, *others, *NOTHING)
            arm.step(4)
        assert arm.error[0] == error, off


def test_a_boundary_acts_from_the_motion_after_its_setting(arm: Arm) -> None:
    x, y, z, *rpy = arm.pose
    arm.move_line((x, y + 5.0, z, *rpy))
    arm.run()
    arm.call(Function.SET_BOUNDARY, "6i", int(x) + 50, int(x) - 50, int(y), int(y) - 50, int(z) + 50, int(z) - 50)
    arm.call(Function.SET_FENCE, "B", 1)
    arm.move_line((x, y - 5.0, z, *rpy))
    arm.run()
    assert arm.error == (0, 0)
    arm.move_line((x, y + 5.0, z, *rpy))
    arm.run()
    assert arm.error[0] == 35


def blocked(sensitivity: int) -> Arm:
    """Returns an arm in MuJoCo that moves against a push that it cannot overcome."""
    arm = Arm(plant="mujoco")
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.call(Function.SET_COLLISION_SENSITIVITY, "B", sensitivity)
    arm.ready()
    arm.move_joints((Q6[0] + 1.0, *Q6[1:]), speed=0.3)
    arm.step(300)
    arm.controller.arm.plant.push((0.0, -300.0, 0.0, 0.0, 0.0, 0.0))
    return arm


def test_a_collision_is_an_error() -> None:
    arm = blocked(3)
    arm.run(until=lambda: arm.controller.error is not None)
    assert arm.controller.error == 31
    assert "external torque" in str(arm.controller.reason)
    joint, expected, actual = struct.unpack("<B2f", arm.call(Function.GET_COMMON_INFORMATION, "B", 101)[1])
    assert joint == 1
    assert abs(expected) < 5.0  # [N m] It turns about the vertical.
    assert abs(actual - expected) > 30.0


def test_a_drive_at_its_largest_torque_is_the_error_of_its_joint_and_switches_motors_off() -> None:
    arm = blocked(0)
    arm.run(until=lambda: arm.controller.error is not None)
    assert arm.controller.error == 11
    assert arm.controller.enabled == 0
    overloaded = bytes((1, 33)) + bytes(14)
    assert arm.call(Function.SERVO_STATUS)[1] == overloaded
    report = encode_report(arm.controller, IDENTITIES["xArm6"], RICH)
    assert report[229:245] == overloaded


def test_a_joint_that_is_pushed_faster_than_its_limit_is_an_error_in_motion() -> None:
    arm = blocked(0)
    arm.controller.arm.plant.push((0.0, 0.0, 0.0, 0.0, 0.0, 500.0))
    arm.run(most=1000, until=lambda: arm.controller.error is not None)
    assert arm.controller.error == 30
    assert "velocity" in str(arm.controller.reason)


def test_a_joint_that_is_pushed_faster_than_its_limit_is_an_error_in_mode_2() -> None:
    arm = Arm(plant="mujoco")
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.ready(Mode.TEACH)
    arm.step(400)
    arm.controller.arm.plant.push((0.0, 150.0, 0.0, 0.0, 0.0, 0.0))
    arm.run(most=1000, until=lambda: arm.controller.error is not None)
    assert arm.controller.error == 30
    assert arm.state == State.STOPPED


@pytest.mark.parametrize(("undetected", "error"), [(0, 37), (1, None)])
def test_an_arm_with_another_load_moves_by_itself_in_mode_2(undetected: int, error: int | None) -> None:
    arm = Arm(plant="mujoco")
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.controller.arm.plant.mount(Payload(mass=1.0, center_of_mass=np.array([0.0, 0.0, 0.05])))
    arm.ready()
    arm.call(Function.SET_MODE, "2B", Mode.TEACH, undetected)
    arm.call(Function.SET_STATE, "B", 0)
    arm.step(400)
    assert arm.controller.error == error
    joint, angle = struct.unpack("<Bf", arm.call(Function.GET_COMMON_INFORMATION, "B", 102)[1])
    assert (joint > 0) is (error is not None)
    assert angle == pytest.approx(Q6[joint - 1] if joint else 0.0, abs=0.1)


@pytest.mark.parametrize(
    ("warning", "function", "code", "values"),
    [
        (12, Function.MOVE_JOINT, "10f", (*Q6, 0.0, 0.0, 10.0, 0.0)),
        (12, Function.MOVE_JOINT, "10f", (*Q6, 0.0, float("nan"), 10.0, 0.0)),
        (12, Function.MOVE_JOINT, "3f", Q6[:3]),
        (12, Function.SET_COLLISION_SENSITIVITY, "B", (6,)),
        (12, Function.SET_LOAD, "4f", (-1.0, 0.0, 0.0, 0.0)),
        (12, Function.SET_TCP_OFFSET, "6f", (9000.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        (12, Function.SET_BOUNDARY, "6i", (0, 100, 100, 0, 100, 0)),
        (13, 250, "", ()),
        (13, 99, "2f", (1.0, 2.0)),
        (14, Function.GET_IK, "6f", (2000.0, 0.0, 0.0, 3.1, 0.0, 0.0)),
    ],
)
def test_a_request_that_is_not_valid_is_a_warning_and_changes_nothing(
    arm: Arm, warning: int, function: int, code: str, values: tuple[float, ...]
) -> None:
    settings, before = arm.controller.settings, arm.q
    status, _ = arm.call(function, code, *values)
    assert status & STATUS_WARNING
    assert not status & STATUS_ERROR
    assert arm.error == (0, warning)
    assert arm.controller.settings is settings
    arm.step(20)
    assert (arm.q, arm.state) == (before, State.READY)
    arm.call(Function.CLEAN_WARNING)
    assert arm.error == (0, 0)


def test_a_full_queue_is_a_warning(arm: Arm) -> None:
    arm.call(Function.SET_STATE, "B", 3)
    for _ in range(LARGEST_QUEUE):
        assert arm.call(Function.SLEEP, "f", 0.001)[0] == 0
    assert arm.call(Function.SLEEP, "f", 0.001)[0] & STATUS_WARNING
    assert arm.error == (0, 11)
    assert struct.unpack(">H", arm.call(Function.GET_COMMAND_COUNT)[1]) == (LARGEST_QUEUE,)


def test_a_checked_pose_does_not_move_the_arm(arm: Arm) -> None:
    before = arm.q
    far = (2000.0, 0.0, 300.0, 3.1, 0.0, 0.0)
    for pose, error in ((arm.pose, 0), (far, 21)):
        _, payload = arm.call(Function.MOVE_LINE, "10f3B", *pose, 100.0, 1000.0, 0.0, -1.0, 0, 0, 1)
        assert payload == bytes((0, 0, error))
    arm.step(20)
    assert (arm.q, arm.error) == (before, (0, 0))


def test_the_hand_guides_the_arm_in_mode_2_and_it_stays_there() -> None:
    arm = Arm(plant="mujoco")
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.ready(Mode.TEACH)
    with pytest.raises(UsageError, match="mode 2"):
        arm.controller.guide(True)
    arm.step(300)
    np.testing.assert_allclose(arm.q, Q6, atol=2e-3)
    arm.controller.arm.plant.push((0.0, 20.0, 0.0, 0.0, 0.0, 0.0))
    arm.step(400)
    arm.controller.arm.plant.push((0.0,) * 6)
    arm.step(1500)
    guided = arm.q
    assert abs(guided[0] - Q6[0]) > 0.03
    arm.ready()
    arm.run()
    np.testing.assert_allclose(arm.q, guided, atol=0.05)
    assert arm.move_joints(Q6) == 0
    arm.run()
    np.testing.assert_allclose(arm.q, Q6, atol=2e-3)


def test_switched_off_motors_hold_the_arm_by_its_brakes() -> None:
    arm = Arm(plant="mujoco")
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.ready()
    arm.call(Function.MOTION_ENABLE, "2B", ALL, 0)
    arm.step(500)
    np.testing.assert_allclose(arm.q, Q6, atol=1e-3)
    assert arm.call(Function.SET_BRAKE, "2B", 9, 0)[0] & STATUS_INVALID


@pytest.mark.parametrize(("direction", "error"), [((0.0, 0.0, -2.0), 0), ((0.0, 0.0, 1.0), 37), ((0.0, 1.0, 0.0), 37)])
def test_an_arm_that_is_compensated_for_another_mounting_moves_by_itself_in_mode_2(
    arm: Arm, direction: tuple[float, float, float], error: int
) -> None:
    arm.call(Function.SET_GRAVITY_DIRECTION, "3f", *direction)
    arm.ready(Mode.TEACH)
    arm.step(400)
    assert arm.error[0] == error
