"""On-line commands of a planner, which may come at any time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.planner import (
    EventKind,
    JointSpeed,
    JointTarget,
    LineTarget,
    Planner,
    PlannerState,
    RefusalReason,
    ToolSpeed,
)
from tests.sim.planner.driving import distances_from_line, drive, largest_shares, shifted, speeds

INSIDE = [1.0, 1.0, 1.0]
SLOW = ToolSpeed(velocity=0.2)


@pytest.fixture(params=["xArm6", "RM75"], scope="module")
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(request.param)


def planner_of(model: RobotModel) -> Planner:
    return Planner(model, model.limits, model.home.tolist())


def test_joints_arrive_together_on_a_straight_line(model: RobotModel) -> None:
    goal = model.home + np.linspace(-0.3, 0.25, model.n)
    rows, _ = drive(
        planner_of(model), {0: lambda planner: planner.move_joints(goal.tolist(), JointSpeed(velocity=0.5))}
    )
    np.testing.assert_allclose(rows[-1], goal, atol=1e-8)
    parts = (rows - model.home) / (goal - model.home)
    np.testing.assert_allclose(parts, parts[:, :1].repeat(model.n, axis=1), atol=1e-6)
    assert np.abs(np.diff(rows, axis=0)).max() / 1e-3 == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_random_changes_of_joint_goals_keep_the_limits(model: RobotModel, seed: int) -> None:
    random = np.random.default_rng(seed)
    goals = [model.home + random.uniform(-0.3, 0.3, model.n) for _ in range(12)]
    actions = {
        int(50 * number): lambda planner, goal=goal: planner.move_joints(goal.tolist())
        for number, goal in enumerate(goals)
    }
    rows, _ = drive(planner_of(model), actions)
    assert largest_shares(rows, model.limits.joint) < INSIDE
    np.testing.assert_allclose(rows[-1], goals[-1], atol=1e-8)


def test_a_pose_is_reached_on_a_straight_line(model: RobotModel) -> None:
    start = model.forward(model.home)
    goal = Pose.from_rpy(start.position + (-0.1, 0.1, 0.05), start.rpy + (0.1, 0.2, -0.1))
    rows, _ = drive(planner_of(model), {0: lambda planner: planner.move_tool(goal, SLOW)})
    points = model.position_path(rows)
    assert distances_from_line(points, start.position, goal.position).max() < 1e-6
    assert model.forward(rows[-1]).is_close(goal, 1e-8)
    assert speeds(model, rows).max() == pytest.approx(0.2, rel=1e-4)
    assert largest_shares(rows, model.limits.joint) < INSIDE


@pytest.mark.parametrize("seed", range(3))
def test_random_changes_of_poses_keep_the_limits(model: RobotModel, seed: int) -> None:
    random = np.random.default_rng(seed)
    start = model.forward(model.home)
    poses = [
        Pose.from_rpy(
            start.position + random.uniform(-0.06, 0.06, 3) - (0.06, 0.0, 0.06),
            start.rpy + random.uniform(-0.2, 0.2, 3),
        )
        for _ in range(8)
    ]
    speed = ToolSpeed(velocity=0.25, acceleration=1.0, rotation_velocity=1.0)
    actions = {
        80 * number: lambda planner, pose=pose: planner.move_tool(pose, speed) for number, pose in enumerate(poses)
    }
    rows, _ = drive(planner_of(model), actions)
    assert largest_shares(rows, model.limits.joint) < INSIDE
    assert model.forward(rows[-1]).is_close(poses[-1], 1e-8)


def test_an_unreachable_pose_is_refused_and_the_motion_continues(model: RobotModel) -> None:
    start = model.forward(model.home)
    near, far = shifted(start, 0.0, 0.1, 0.0), shifted(start, 3.0, 0.0, 0.0)
    refusals = []
    rows, _ = drive(
        planner_of(model),
        {
            0: lambda planner: planner.move_tool(near, SLOW),
            100: lambda planner: refusals.append(planner.move_tool(far, SLOW)),
            101: lambda planner: refusals.append(planner.move_joints([9.0] * model.n)),
        },
    )
    assert refusals[0].reason in (RefusalReason.UNREACHABLE, RefusalReason.SINGULAR, RefusalReason.JOINT_RANGE)
    assert (refusals[1].reason, refusals[1].joint) == (RefusalReason.JOINT_RANGE, 1)
    assert model.forward(rows[-1]).is_close(near, 1e-8)


def test_joint_velocities_are_reached_together_held_and_end(model: RobotModel) -> None:
    dq = np.linspace(0.1, 0.3, model.n)
    speed = JointSpeed(acceleration=1.0)
    rows, _ = drive(
        planner_of(model),
        {0: lambda planner: planner.set_joint_velocity(dq.tolist(), speed=speed, duration=0.8)},
    )
    rates = np.diff(rows, axis=0) / 1e-3
    np.testing.assert_allclose(rates[700], dq, atol=1e-6)
    half = rates[200] / dq
    np.testing.assert_allclose(half, half[0], atol=0.02)
    assert np.abs(np.diff(rates, axis=0)).max() / 1e-3 < 1.0 + 1e-3
    assert len(rows) < 1800
    assert largest_shares(rows, model.limits.joint) < INSIDE


def test_joint_velocities_that_are_repeated_end_as_fast(model: RobotModel) -> None:
    dq, speed = np.linspace(0.1, 0.3, model.n).tolist(), JointSpeed(acceleration=1.0)
    rows, _ = drive(
        planner_of(model),
        {
            0: lambda planner: planner.set_joint_velocity(dq, speed=speed),
            600: lambda planner: planner.set_joint_velocity(dq, speed=speed, duration=0.2),
        },
    )
    assert len(rows) < 1400
    shares = (np.diff(rows[800:], axis=0) / np.array(dq))[:200]
    np.testing.assert_allclose(shares, shares[:, :1] * np.ones(model.n), atol=2e-5)


def test_a_joint_stops_at_the_end_of_its_range(model: RobotModel) -> None:
    dq = [0.0] * model.n
    dq[0] = 1.5
    planner = planner_of(model)
    planner.set_joint_velocity(dq)
    rows = np.array([planner.step().q for _ in range(6000)])
    assert (rows[:, 0] < model.limits.joint.upper[0]).all()
    assert rows[-1, 0] > model.limits.joint.upper[0] - 0.1
    assert planner.state is PlannerState.MOVING, "until another command"


def test_a_twist_in_tool_axes_moves_the_tool_and_ends(model: RobotModel) -> None:
    start = model.forward(model.home)
    twist = (0.0, 0.0, 0.05, 0.0, 0.0, 0.3)
    rows, _ = drive(planner_of(model), {0: lambda planner: planner.set_twist(twist, frame="tool", duration=1.0)})
    points = model.position_path(rows)
    along = start.rotation[:, 2]
    moved = (points[-1] - points[0]) @ along
    assert moved == pytest.approx(0.05, rel=0.02)
    assert distances_from_line(points, points[0], points[0] + along).max() < 2e-5
    assert largest_shares(rows, model.limits.joint) < INSIDE


@pytest.mark.parametrize("seed", range(3))
def test_any_command_follows_any_other_inside_the_limits(model: RobotModel, seed: int) -> None:
    random = np.random.default_rng(seed)
    start = model.forward(model.home)

    def some_pose() -> Pose:
        return Pose.from_rpy(
            start.position + random.uniform(-0.06, 0.06, 3) - (0.06, 0.0, 0.06),
            start.rpy + random.uniform(-0.2, 0.2, 3),
        )

    def command(planner: Planner) -> None:
        kind = int(random.integers(6))
        if kind == 0:
            planner.move_joints((model.home + random.uniform(-0.2, 0.2, model.n)).tolist())
        elif kind == 1:
            planner.move_tool(some_pose(), SLOW)
        elif kind == 2:
            planner.set_joint_velocity(random.uniform(-0.3, 0.3, model.n).tolist())
        elif kind == 3:
            planner.set_twist(random.uniform(-0.1, 0.1, 6).tolist())
        elif kind == 4:
            planner.servo_joints((model.home + random.uniform(-0.2, 0.2, model.n)).tolist())
        else:
            planner.add(LineTarget(id=1, pose=some_pose(), speed=SLOW))

    actions: dict[int, Callable[[Planner], object]] = {120 * number: command for number in range(12)}
    actions[1600] = Planner.stop
    rows, _ = drive(planner_of(model), actions)
    assert largest_shares(rows, model.limits.joint) < INSIDE


def test_a_queued_target_waits_for_standstill_and_a_command_discards_it(model: RobotModel) -> None:
    goal = (model.home + 0.1).tolist()
    target = JointTarget(id=1, q=tuple(model.home.tolist()))
    rows, events = drive(
        planner_of(model), {0: lambda planner: planner.move_joints(goal), 1: lambda planner: planner.add(target)}
    )
    assert [event.kind for _, event in events] == [EventKind.BEGAN, EventKind.REACHED]
    began = events[0][0]
    np.testing.assert_allclose(rows[began - 1], goal, atol=1e-6)
    _, events = drive(
        planner_of(model), {0: lambda planner: planner.add(target), 1: lambda planner: planner.move_joints(goal)}
    )
    assert events[-1][1].kind in (EventKind.DISCARDED, EventKind.REACHED)


def test_velocities_outside_the_range_are_refused(model: RobotModel) -> None:
    q = model.home.copy()
    q[1] = model.limits.joint.upper[1] + 0.01
    planner = Planner(model, model.limits, q.tolist())
    for refusal in (planner.set_joint_velocity([0.1] * model.n), planner.set_twist([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])):
        assert refusal is not None
        assert refusal.reason is RefusalReason.JOINT_RANGE
    assert planner.state is PlannerState.IDLE


def test_invalid_commands_are_errors(model: RobotModel) -> None:
    planner = planner_of(model)
    with pytest.raises(InvalidValueError):
        planner.move_joints([0.0])
    with pytest.raises(InvalidValueError):
        planner.move_joints(model.home.tolist(), JointSpeed(velocity=-1.0))
    with pytest.raises(InvalidValueError):
        planner.set_twist([0.0] * 5)
    with pytest.raises(InvalidValueError):
        planner.follow_joints(model.home.tolist(), smoothing=2.0)
    with pytest.raises(InvalidValueError):
        planner.set_override(0.0)
