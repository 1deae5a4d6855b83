"""The xArm5, whose flange stays level on lines, after a stop that has tilted it."""

from __future__ import annotations

from collections.abc import Callable
from math import acos, inf, pi, radians

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.errors import PlanningError
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.model.robot_model import load_model
from rcilab.motion.cartesian import plan_line
from tests.makers.ufactory.controller.conftest import Arm

HOME_DEG = (0.0, -30.0, -60.0, 90.0, 0.0)
DOWN = (1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0)


def tilt(arm: Arm) -> float:
    return acos(min(1.0, -arm.controller.model.forward(arm.controller.planner.q).rotation[2, 2]))


def at_home(mode: Mode = Mode.POSITION, pitch_deg: float = 0.0) -> Arm:
    arm = Arm("xArm5")
    arm.ready()
    arm.move_joints(np.radians(np.add(HOME_DEG, (20.0, 0.0, 0.0, -pitch_deg, 0.0))).tolist())
    arm.run()
    arm.ready(mode)
    return arm


def keep(arm: Arm) -> None:
    arm.move_line((inf, 0.0, inf, inf, inf, inf))


def level(arm: Arm) -> None:
    x, _, z, *_ = arm.pose
    arm.move_line((x, 0.0, z, pi, 0.0, 0.0))


def joints_behind_a_line(arm: Arm) -> None:
    keep(arm)
    arm.call(Function.MOVE_RELATIVE, "11f2B", 0.1, *(0.0,) * 6, 1.0, 10.0, 0.0, -1.0, 1, 0)


@pytest.mark.parametrize("speed", [100.0, 1000.0])
@pytest.mark.parametrize(
    ("mode", "move"),
    [
        (Mode.POSITION, keep),
        (Mode.POSITION, level),
        (Mode.POSITION, joints_behind_a_line),
        (Mode.CARTESIAN_ONLINE, keep),
        (Mode.CARTESIAN_ONLINE, level),
    ],
)
def test_lines_go_on_after_a_stop_has_tilted_the_tool(speed: float, mode: Mode, move: Callable[[Arm], None]) -> None:
    arm = at_home()
    x, y, *others = arm.pose
    arm.move_line((x, y + 250.0, *others), speed=speed)
    arm.run(until=lambda: arm.pose[1] > y + 120.0)
    arm.call(Function.SET_STATE, "B", 4)
    arm.run()
    before = tilt(arm)
    assert before > 1e-4
    arm.ready(mode)
    move(arm)
    arm.run()
    assert arm.error == (0, 0)
    assert tilt(arm) < (1e-6 if move is level else before + 1e-6)
    if move is not joints_behind_a_line:
        assert abs(arm.pose[1]) < 1e-3


def test_a_stream_of_poses_keeps_the_position_of_a_tilted_tool() -> None:
    arm = at_home(Mode.SERVO, pitch_deg=0.3)
    x, y, *others = arm.pose
    for _ in range(150):
        y -= 1.0
        arm.call(Function.SERVO_CARTESIAN, "9f", x, y, *others, 0.0, 0.0, 0.0)
        arm.step(4)
    arm.run()
    assert arm.error == (0, 0)
    np.testing.assert_allclose(arm.pose[:3], (x, y, others[0]), atol=1e-2)


def test_a_twist_moves_a_tilted_tool_as_far_as_a_level_one() -> None:
    arm = at_home(Mode.CARTESIAN_VELOCITY, pitch_deg=0.3)
    y = arm.pose[1]
    arm.call(Function.CARTESIAN_VELOCITY, "6fBf", 0.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0, 1.0)
    arm.run()
    assert arm.error == (0, 0)
    assert arm.pose[1] - y == pytest.approx(60.0, abs=3.0)


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.SERVO, Mode.CARTESIAN_ONLINE])
def test_a_tilt_out_of_the_plane_of_the_arm_is_refused_with_its_angle(mode: Mode) -> None:
    arm = at_home()
    arm.move_joints(np.radians(HOME_DEG).tolist())
    arm.run()
    arm.ready(mode)
    x, y, z, roll, pitch, yaw = arm.pose
    if mode is Mode.SERVO:
        arm.call(Function.SERVO_CARTESIAN, "9f", x, y, z, roll + radians(5.0), pitch, yaw, 0.0, 0.0, 0.0)
    else:
        arm.move_line((x, y, z + 20.0, roll + radians(5.0), pitch, yaw))
    arm.run()
    assert arm.error[0] == 21
    assert "the orientation would differ by 5 deg, more than 1 deg" in str(arm.controller.reason)


def test_a_twist_out_of_the_plane_of_the_arm_is_refused() -> None:
    arm = at_home(Mode.CARTESIAN_VELOCITY)
    arm.call(Function.CARTESIAN_VELOCITY, "6fBf", 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0, 1.0)
    arm.run()
    assert arm.error[0] == 21


@pytest.mark.parametrize("name", ["xArm5", "850", "xArm7"])
@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.CARTESIAN_ONLINE])
def test_the_reason_of_a_target_out_of_reach_has_the_distance_of_the_target(name: str, mode: Mode) -> None:
    arm = Arm(name)
    arm.ready()
    arm.move_joints(arm.controller.model.home.tolist())
    arm.run()
    arm.ready(mode)
    excess = []
    for x in (1500.0, 2000.0):
        arm.move_line((x, *arm.pose[1:]))
        arm.run()
        assert arm.error[0] == 21
        text = str(arm.controller.reason)
        excess.append(float(text.removeprefix("out of reach by ").split(" mm")[0]))
        arm.ready(mode)
    assert excess[1] - excess[0] == pytest.approx(500.0, abs=100.0)


def test_a_planned_line_begins_at_a_tilted_tool_as_well() -> None:
    model = load_model("xArm5")
    q = np.radians(np.add(HOME_DEG, (20.0, 0.0, 0.0, -0.3, 0.0)))
    start = model.forward(q)
    x, y, z = start.parts[1]
    goal = Pose.from_parts(start.parts[0], (x, y - 0.25, z))
    line = plan_line(model, q, goal)
    assert check(line, model).ok
    end = model.forward(line.goal)
    np.testing.assert_allclose(end.position, goal.position, atol=1e-6)
    assert plan_line(model, q, Pose.from_parts(DOWN, (x, y - 0.25, z))).duration > 0.0
    with pytest.raises(PlanningError, match="no joint angles"):
        plan_line(model, q, goal @ Pose.from_rpy((0.0, 0.0, 0.0), (radians(5.0), 0.0, 0.0)))


def test_a_stream_with_pauses_is_one_motion_in_the_log() -> None:
    arm = at_home(Mode.SERVO)
    arm.step(1500)
    arm.link.logged.clear()
    q = list(arm.q)
    for _ in range(3):
        q[0] += 0.01
        arm.call(Function.SERVO_JOINT, "10f", *q, *(0.0,) * 5)
        arm.run()
        arm.step(400)
    assert arm.link.logged == ["motion started in mode 1"]
    arm.step(700)
    assert arm.link.logged == ["motion started in mode 1", "motion ended; the state is 2 (ready)"]
    q[0] += 0.01
    arm.call(Function.SERVO_JOINT, "10f", *q, *(0.0,) * 5)
    arm.run()
    arm.call(Function.SET_STATE, "B", 4)
    arm.step()
    assert arm.link.logged[2:] == ["motion started in mode 1", "motion ended; the state is 4 (stopped)"]
