"""Queued targets of a planner: paths, speeds, corners, pauses, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.planner import (
    ArcTarget,
    Blend,
    EventKind,
    JointSpeed,
    JointTarget,
    LineTarget,
    PauseTarget,
    Planner,
    PlannerState,
    RefusalReason,
    SplineTarget,
    Target,
    ToolSpeed,
)
from tests.sim.planner.driving import distances_from_line, drive, largest_shares, shifted, speeds

SLOW = ToolSpeed(velocity=0.2)
BEGAN, REACHED, DISCARDED, REFUSED = EventKind.BEGAN, EventKind.REACHED, EventKind.DISCARDED, EventKind.REFUSED


@pytest.fixture(params=["xArm6", "RM75"], scope="module")
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(request.param)


def planner_with(model: RobotModel, *targets: Target) -> Planner:
    planner = Planner(model, model.limits, model.home.tolist())
    for target in targets:
        planner.add(target)
    return planner


def test_a_joint_target_is_reached_at_its_speed(model: RobotModel) -> None:
    goal = model.home + 0.2
    rows, events = drive(planner_with(model, JointTarget(id=7, q=tuple(goal.tolist()), speed=JointSpeed(velocity=0.3))))
    assert [event[:2] for _, event in events] == [(7, BEGAN), (7, REACHED)]
    np.testing.assert_allclose(rows[-1], goal, atol=1e-9)
    assert np.abs(np.diff(rows, axis=0)).max() / 1e-3 == pytest.approx(0.3, rel=1e-6)


def test_joint_targets_are_relative_or_poses(model: RobotModel) -> None:
    there = model.forward(model.home + 0.1)
    planner = planner_with(
        model,
        JointTarget(id=1, q=(0.1,) * model.n, is_relative=True),
        JointTarget(id=2, q=(0.1,) * model.n, is_relative=True),
        JointTarget(id=3, pose=there),
    )
    rows, events = drive(planner)
    second = next(cycle for cycle, event in events if event[:2] == (2, REACHED))
    np.testing.assert_allclose(rows[second + 1], model.home + 0.2, atol=1e-9)
    assert model.forward(rows[-1]).is_close(there, 1e-8)


def test_a_pose_beyond_the_present_elbow_is_reached_by_the_joints() -> None:
    model = load_model("xArm7")
    q = model.home.copy()
    q[2] += 1.2
    there = model.forward(q)
    rows, events = drive(planner_with(model, JointTarget(id=1, pose=there)))
    assert [event.kind for _, event in events] == [BEGAN, REACHED]
    assert model.forward(rows[-1]).is_close(there, 1e-6)


def test_a_line_is_straight_and_has_its_speed(model: RobotModel) -> None:
    start = model.forward(model.home)
    rows, _ = drive(planner_with(model, LineTarget(id=1, pose=shifted(start, -0.05, 0.15, 0.0), speed=SLOW)))
    points = model.position_path(rows)
    assert distances_from_line(points, points[0], points[-1]).max() < 1e-6
    np.testing.assert_allclose(points[-1] - points[0], (-0.05, 0.15, 0.0), atol=1e-8)
    assert speeds(model, rows).max() == pytest.approx(0.2, rel=1e-6)


def test_an_arc_and_two_turns_of_a_circle_stay_on_it(model: RobotModel) -> None:
    start = model.forward(model.home)
    via, end = shifted(start, 0.0, 0.05, 0.05), shifted(start, 0.0, 0.1, 0.0)
    center = start.position + (0.0, 0.05, 0.0)
    arc, _ = drive(planner_with(model, ArcTarget(id=1, via=via, pose=end, speed=SLOW)))
    turns, _ = drive(planner_with(model, ArcTarget(id=1, via=via, pose=end, angle=4.0 * np.pi, speed=SLOW)))
    for rows in (arc, turns):
        radii = np.linalg.norm(model.position_path(rows) - center, axis=1)
        np.testing.assert_allclose(radii, 0.05, atol=1e-6)
        assert speeds(model, rows).max() < 0.2 * (1.0 + 1e-6)
    np.testing.assert_allclose(model.position_path(arc)[-1], end.position, atol=1e-8)
    np.testing.assert_allclose(model.position_path(turns)[-1], start.position, atol=1e-8)
    assert np.abs(np.diff(model.position_path(turns), axis=0)).sum() > 2.0 * np.pi * 0.1


def test_a_spline_passes_its_poses_smoothly(model: RobotModel) -> None:
    start = model.forward(model.home)
    poses = tuple(shifted(start, *offset) for offset in ((0.0, 0.05, 0.02), (-0.05, 0.1, 0.0), (-0.1, 0.05, 0.03)))
    rows, _ = drive(planner_with(model, SplineTarget(id=1, poses=poses, speed=SLOW)))
    points = model.position_path(rows)
    for pose in poses:
        assert np.linalg.norm(points - pose.position, axis=1).min() < 2e-4  # Half of a cycle's distance.
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]
    middle = speeds(model, rows)[400:-400]
    assert middle.min() > 0.1, "it does not stop at the poses"


@pytest.mark.parametrize("last", ["line", "joints"])
def test_a_corner_is_rounded_inside_its_radius_without_a_stop(model: RobotModel, last: str) -> None:
    start = model.forward(model.home)
    corner = shifted(start, 0.0, 0.15, 0.0)
    first = LineTarget(id=1, pose=corner, speed=SLOW, blend=Blend(radius=0.03))
    goal = shifted(start, -0.12, 0.15, 0.0)
    second: Target = LineTarget(id=2, pose=goal, speed=SLOW)
    if last == "joints":
        second = JointTarget(id=2, pose=goal, speed=JointSpeed(velocity=0.4))
    rows, events = drive(planner_with(model, first, second))
    assert [event[:2] for _, event in events] == [(1, BEGAN), (1, REACHED), (2, BEGAN), (2, REACHED)]
    points = model.position_path(rows)
    nearest = np.linalg.norm(points - corner.position, axis=1)
    assert 0.005 < nearest.min() < 0.03
    before = points[: int(nearest.argmin())]
    outside = np.linalg.norm(before - corner.position, axis=1) > 0.03
    assert distances_from_line(before[outside], start.position, corner.position).max() < 1e-6
    tool = speeds(model, rows)
    passed = int(nearest.argmin())
    assert tool[passed - 20 : passed + 20].min() > 0.03, "it does not stop"
    assert np.abs(np.diff(tool)).max() < 0.02, "its speed does not jump"
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_a_target_added_during_the_motion_is_joined_to_it(model: RobotModel) -> None:
    start = model.forward(model.home)
    planner = planner_with(
        model, LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW, blend=Blend(share=0.5))
    )
    second = LineTarget(id=2, pose=shifted(start, -0.1, 0.15, 0.0), speed=SLOW)
    rows, _ = drive(planner, {300: lambda planner: planner.add(second)})
    assert speeds(model, rows)[150:-150].min() > 0.03
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


@pytest.mark.parametrize("cycle", range(360, 600, 40))
def test_a_target_that_comes_late_is_joined_only_if_the_arm_can_slow_down_for_the_corner(cycle: int) -> None:
    model = load_model("xArm6")
    start, speed = model.forward(model.home), ToolSpeed(velocity=0.6)
    first = LineTarget(id=1, pose=shifted(start, 0.0, 0.2, 0.0), speed=speed, blend=Blend(radius=0.01))
    second = LineTarget(id=2, pose=shifted(start, -0.02, 0.02, 0.0), speed=speed)
    rows, events = drive(planner_with(model, first), {cycle: lambda planner: planner.add(second)})
    assert [event.id for _, event in events if event.kind is REACHED] == [1, 2]
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_many_short_lines_are_one_motion(model: RobotModel) -> None:
    start = model.forward(model.home)
    poses = [shifted(start, -0.01 * (k % 2), 0.004 * k, 0.0) for k in range(1, 41)]
    targets = [LineTarget(id=k, pose=pose, speed=SLOW, blend=Blend(share=1.0)) for k, pose in enumerate(poses)]
    rows, events = drive(planner_with(model, *targets))
    assert [event.id for _, event in events if event.kind is REACHED] == list(range(40))
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]
    assert speeds(model, rows)[200:-200].min() > 1e-3, "it does not stop"


@pytest.mark.parametrize("seed", range(3))
def test_random_targets_keep_the_limits_of_the_joints(model: RobotModel, seed: int) -> None:
    random = np.random.default_rng(seed)
    start = model.forward(model.home)
    targets: list[Target] = []
    for number in range(8):
        blend = Blend(radius=float(random.uniform(0.0, 0.05)))
        offset = random.uniform(-0.06, 0.06, 3) - (0.06, 0.0, 0.06)
        pose = Pose.from_rpy(start.position + offset, start.rpy + random.uniform(-0.2, 0.2, 3))
        speed = ToolSpeed(velocity=float(random.uniform(0.05, 1.5)))
        if number % 4 == 3:
            q = model.home + random.uniform(-0.3, 0.3, model.n)
            targets.append(JointTarget(id=number, q=tuple(q.tolist()), blend=blend))
        else:
            targets.append(LineTarget(id=number, pose=pose, speed=speed, blend=blend))
    rows, events = drive(planner_with(model, *targets))
    assert [event.id for _, event in events if event.kind is REACHED] == list(range(8))
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]
    joint = model.limits.joint
    assert ((joint.lower < rows) & (rows < joint.upper)).all()


def test_a_pause_stops_and_continues_on_the_path(model: RobotModel) -> None:
    start = model.forward(model.home)
    line = LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW)
    paused = []
    rows, events = drive(
        planner_with(model, line),
        {300: Planner.pause, 800: lambda planner: paused.append(planner.state), 801: Planner.resume},
    )
    assert paused == [PlannerState.PAUSED]
    assert np.ptp(rows[600:801], axis=0).max() < 1e-12
    points = model.position_path(rows)
    assert distances_from_line(points, points[0], points[-1]).max() < 1e-6
    assert [event.kind for _, event in events] == [BEGAN, REACHED]
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_the_end_of_the_queue_is_a_stop_on_the_path(model: RobotModel) -> None:
    start = model.forward(model.home)
    line = LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW)
    rows, events = drive(planner_with(model, line, replace(line, id=2)), {300: Planner.end})
    assert [event[:2] for _, event in events] == [(1, BEGAN), (1, DISCARDED), (2, DISCARDED)]
    points = model.position_path(rows)
    assert distances_from_line(points, start.position, line.pose.position).max() < 1e-6
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_a_paused_queue_ends_at_once(model: RobotModel) -> None:
    start = model.forward(model.home)
    planner = planner_with(model, LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW))
    for _ in range(200):
        planner.step()
    planner.pause()
    for _ in range(400):
        planner.step()
    planner.end()
    assert planner.state is PlannerState.IDLE
    assert [event[:2] for event in planner.take_events()] == [(1, DISCARDED)]


def test_a_stop_is_as_fast_as_the_limits_allow(model: RobotModel) -> None:
    start = model.forward(model.home)
    line = LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW)
    slow, _ = drive(planner_with(model, line), {300: Planner.end})
    fast, events = drive(planner_with(model, line), {300: Planner.stop})
    assert len(fast) <= len(slow)
    assert [event.kind for _, event in events] == [BEGAN, DISCARDED]
    assert largest_shares(fast, model.limits.joint) < [1.0, 1.0, 1.0]


def test_a_pause_target_takes_its_time(model: RobotModel) -> None:
    rows, events = drive(planner_with(model, PauseTarget(id=1, seconds=0.25)))
    (began, _), (ended, _) = events
    assert ended - began == pytest.approx(250, abs=1)
    assert np.ptp(rows, axis=0).max() == 0.0


def test_the_override_slows_the_running_target_down(model: RobotModel) -> None:
    start = model.forward(model.home)
    line = LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW)
    rows, _ = drive(
        planner_with(model, line),
        {350: lambda planner: planner.set_override(0.25), 900: lambda planner: planner.set_override(1.0)},
    )
    tool = speeds(model, rows)
    assert tool[340] == pytest.approx(0.2, rel=1e-3)
    assert tool[800] == pytest.approx(0.05, rel=1e-3)
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_a_skipped_target_is_left_where_the_arm_stands(model: RobotModel) -> None:
    start = model.forward(model.home)
    first = LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW, blend=Blend(radius=0.02))
    second = LineTarget(id=2, pose=start, speed=SLOW)
    rows, events = drive(
        planner_with(model, first, second), {300: Planner.pause, 700: Planner.skip, 701: Planner.resume}
    )
    assert [event[:2] for _, event in events] == [(1, BEGAN), (1, DISCARDED), (2, BEGAN), (2, REACHED)]
    assert model.forward(rows[-1]).is_close(start, 1e-8)
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_only_targets_that_have_not_begun_are_cleared(model: RobotModel) -> None:
    start = model.forward(model.home)
    first = LineTarget(id=1, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW)
    _, events = drive(
        planner_with(model, first, replace(first, id=2), replace(first, id=3)), {200: Planner.clear_queue}
    )
    assert [event[:2] for _, event in events] == [(1, BEGAN), (2, DISCARDED), (3, DISCARDED), (1, REACHED)]


def test_a_target_out_of_reach_is_refused_before_it_begins(model: RobotModel) -> None:
    start = model.forward(model.home)
    near = LineTarget(id=1, pose=shifted(start, 0.0, 0.05, 0.0), speed=SLOW)
    far = LineTarget(id=2, pose=shifted(start, 3.0, 0.0, 0.0), speed=SLOW)
    rows, events = drive(planner_with(model, near, far, replace(near, id=3)))
    assert [event[:2] for _, event in events] == [(1, BEGAN), (1, REACHED), (2, REFUSED), (3, DISCARDED)]
    refusal = events[2][1].refusal
    assert refusal is not None
    assert refusal.reason in (RefusalReason.UNREACHABLE, RefusalReason.SINGULAR)
    assert refusal.share == 1.0
    np.testing.assert_allclose(model.position_path(rows)[-1], near.pose.position, atol=1e-8)


def test_a_path_that_leaves_the_reach_is_refused_at_that_place() -> None:
    model = load_model("xArm6")
    q = np.array([0.2, -0.5, -0.8, 0.1, 1.1, 0.3])
    start = model.forward(q)
    x, y, _ = start.position
    planner = Planner(model, model.limits, q.tolist())
    planner.add(LineTarget(id=1, pose=shifted(start, -2.0 * x, -2.0 * y, 0.0), speed=SLOW))  # Over the base.
    _, ((_, event),) = drive(planner)
    assert event.refusal is not None
    assert event.refusal.reason in (RefusalReason.UNREACHABLE, RefusalReason.SINGULAR)
    assert 0.0 < event.refusal.share < 1.0


def test_a_joint_beyond_its_range_is_named(model: RobotModel) -> None:
    upper = float(model.limits.joint.upper[1])
    goal = model.home.copy()
    goal[1] = upper + 0.1
    rows, events = drive(planner_with(model, JointTarget(id=1, q=tuple(goal.tolist()))))
    ((_, event),) = events
    assert event.refusal is not None
    assert event.refusal.reason is RefusalReason.JOINT_RANGE
    assert (event.refusal.joint, event.refusal.bound) == (2, upper)
    assert event.refusal.value == pytest.approx(upper + 0.1)
    assert np.ptp(rows, axis=0).max() == 0.0


def test_a_target_where_the_arm_stands_is_reached_at_once(model: RobotModel) -> None:
    here = model.forward(model.home)
    _, events = drive(planner_with(model, LineTarget(id=1, pose=here), JointTarget(id=2, q=tuple(model.home.tolist()))))
    assert [event[:2] for _, event in events] == [(1, BEGAN), (1, REACHED), (2, BEGAN), (2, REACHED)]


def test_a_line_keeps_its_speed_where_the_arm_is_to_report_its_joints() -> None:
    model = load_model("xArm6")
    start = model.forward(model.home)
    tight = replace(model.limits, joint=replace(model.limits.joint, velocity=np.full(model.n, 0.2)))
    line = LineTarget(id=1, pose=shifted(start, 0.0, 0.2, 0.0), speed=SLOW)
    found: list[float] = []
    for slows_down in (True, False):
        planner = Planner(model, tight, model.home.tolist(), slows_down=slows_down)
        planner.add(line)
        rows, _ = drive(planner)
        found.append(speeds(model, rows).max())
        assert (largest_shares(rows, tight.joint)[0] < 1.0) is slows_down
    assert found[0] < 0.15
    assert found[1] == pytest.approx(0.2, rel=1e-3)


def test_progress_and_number_of_targets_are_known(model: RobotModel) -> None:
    start = model.forward(model.home)
    line = LineTarget(id=5, pose=shifted(start, 0.0, 0.15, 0.0), speed=SLOW)
    planner = planner_with(model, line, replace(line, id=6))
    seen: list[float] = []
    for _ in range(300):
        planner.step()
        seen.append(planner.progress)
    assert planner.queued == 2
    assert planner.current is line
    moving = np.array(seen[20:])
    assert 0.0 < moving[-1] < 1.0
    assert (np.diff(moving) > 0.0).all()


@pytest.mark.parametrize(
    "target",
    [
        JointTarget(id=1),
        JointTarget(id=1, q=(0.0,)),
        PauseTarget(id=1, seconds=-1.0),
        SplineTarget(id=1, poses=()),
        ArcTarget(id=1, via=Pose(), pose=Pose(), angle=0.0),
        LineTarget(id=1, pose=Pose(), speed=ToolSpeed(velocity=0.0)),
        JointTarget(id=1, q=(0.0,) * 6, speed=JointSpeed(velocity=(1.0, 1.0))),
    ],
)
def test_invalid_targets_are_errors(target: Target) -> None:
    planner = planner_with(load_model("xMate3"))
    with pytest.raises(InvalidValueError):
        planner.add(target)
