"""An FR3's poses are sent without the elbow: what is checked are the joint angles that they lead to."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.conformance.free_elbow import resulting_motion
from rcilab.conformance.motion_monitor import Monitor
from rcilab.conformance.signals import HOLD_SAMPLES
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion, plan_joint, plan_nullspace

OFF = np.array([0.3, 0.2, -0.2, 0.3, 0.2, 0.1, 0.4])


def plan(model: RobotModel, speed: float = 0.4) -> Motion:
    return plan_joint(model, model.home, model.home + OFF, speed=speed)


def test_poses_of_an_fr3_are_followed_with_the_least_motion_of_the_joints() -> None:
    model = load_model("FR3")
    motion = plan(model)
    followed = resulting_motion(motion, model, "cartesian_position")
    assert np.abs(model.forward_path(followed.q) - model.forward_path(motion.q)).max() < 1e-10
    assert np.abs(followed.q - motion.q).max() > 0.2
    assert np.linalg.norm(np.diff(followed.q, axis=0)) < np.linalg.norm(np.diff(motion.q, axis=0))
    assert resulting_motion(followed, model, "cartesian_position").q == pytest.approx(followed.q, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "mode"), [("FR3", "joint_position"), ("FR3", "torque"), ("Panda", "cartesian_position")]
)
def test_a_motion_whose_elbow_is_sent_is_followed_as_planned(name: str, mode: str) -> None:
    model = load_model(name)
    motion = plan(model)
    assert resulting_motion(motion, model, mode) is motion  # type: ignore[arg-type]
    assert "from the plan" not in check(motion, model, mode=mode).title  # type: ignore[arg-type]


def test_the_report_has_the_joint_angles_that_will_be() -> None:
    model = load_model("FR3")
    motion = plan(model)
    followed = resulting_motion(motion, model, "cartesian_position")
    report = check(motion, model, mode="cartesian_position")
    assert report.motion is motion
    assert not any(row.condition.signal == "arm_angle" for row in report.rows)
    row = next(row for row in report.rows if row.id == "inverse.joint.velocity")
    fastest = np.abs(np.diff(followed.q, axis=0)).max(axis=0) / 0.001
    assert abs(row.value) == pytest.approx(fastest[row.joint - 1], rel=1e-6)
    away = np.degrees(np.abs(followed.q - motion.q).max())
    assert report.title.endswith(f"up to {away:.2f}° from the plan")
    assert "与规划最多相差" in report.title.text("zh")


def test_a_motion_of_the_elbow_alone_is_reported_to_move_nothing() -> None:
    model = load_model("FR3")
    motion = plan_nullspace(model, model.home, psi=0.4)
    title = check(motion, model, mode="cartesian_position").title
    assert "nothing else moves: the arm will stand still" in title
    assert "机械臂将保持不动" in title.text("zh")
    assert "stand still" not in check(plan(model), model, mode="cartesian_position").title


def test_a_joint_that_only_the_controller_moves_out_of_its_range_is_found() -> None:
    model = load_model("FR3")
    motion = plan(model)
    followed = resulting_motion(motion, model, "cartesian_position")
    farthest, planned = followed.q.max(axis=0), motion.q.max(axis=0)
    joint = int(np.argmax(farthest - planned))
    upper = model.limits.joint.upper.copy()
    upper[joint] = (farthest[joint] + planned[joint]) / 2.0
    tight = model.with_joint_limits(model.limits.joint.lower, upper)
    assert check(motion, tight).ok
    report = check(motion, tight, mode="cartesian_position")
    assert [violation.condition.id for violation in report.violations] == ["inverse.joint.position"]
    assert report.violations[0].joint == joint + 1
    assert report.certificate is None


def test_a_pose_without_joint_angles_on_the_way_is_a_violation_and_the_path_can_be_drawn() -> None:
    model = load_model("FR3")
    straight = np.array([0.0, 0.3, 0.0, -0.5, 0.0, 1.2, 0.0])
    out = straight.copy()
    out[3] = 0.0
    motion = Motion.from_samples(np.linspace(straight, out, 30), dt=0.1)
    report = check(motion, model, mode="cartesian_position", distance=None)
    assert "cartesian.frame" in {violation.condition.id for violation in report.violations}
    assert len(report.usage().ratio) == len(motion)
    assert not report.slow_down().ok


def test_the_monitor_follows_poses_without_an_elbow_as_the_check_does() -> None:
    model = load_model("FR3")
    rows = plan(model).q[:200].copy()
    rows[100, 3] += 2e-5
    report = check(Motion.from_cycles(rows), model, mode="cartesian_position", distance=None)
    monitor = Monitor(model, "cartesian_position")
    monitor.reset(rows[0])
    poses = [*model.forward_path(rows), *[model.forward(rows[-1]).matrix] * HOLD_SAMPLES]
    found = {
        (violation.condition.id, violation.axis, cycle)
        for cycle, T in enumerate(poses)
        for violation in monitor.step(CartesianPosition(T, finished=cycle == len(rows) - 1))
        if violation.condition.necessity == "necessary"
    }
    expected = {
        (violation.condition.id, violation.joint, round(violation.time / CYCLE_TIME) + k)
        for violation in report.violations
        for k in range(violation.count)
    }
    assert found == expected
    assert ("inverse.joint.jerk", 4, 100) in found
