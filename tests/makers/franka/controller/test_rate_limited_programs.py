"""Programs that run along libfranka's rate limiter: no condition stops them, also with states in single precision."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.check import check
from rcilab.conformance.common_conditions import TOOL_CONDITIONS
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.spatial import Pose
from rcilab.makers.franka.conditions import FCI_CONDITIONS, FR3_CONDITIONS
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion
from tests.peers.franka import wire
from tests.peers.franka.arena import FciArena
from tests.peers.franka.rate_limiter import CYCLE, limited_torque, limited_vector, limited_velocity
from tests.peers.franka.robot import Output, Robot

FR3 = load_model("FR3")
FAST = 1.0  # [rad/s] Low enough for the ends of the joints' ranges.


def limits_of(model: RobotModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    joint = model.limits.joint
    return np.full(7, FAST), joint.acceleration, joint.jerk


def test_angles_along_the_limits_of_every_joint_are_followed_and_pass_the_check(robot: Robot, place: FciArena) -> None:
    model = place.controller.model
    begin = model.home.copy()
    begin[5] = min(4.1, model.limits.joint.upper[5] - 0.4)  # Floats above 4 are rounded most.
    assert place.simulate("place_arm", q=begin.tolist())["ok"]
    robot.skip(3)
    state = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    sent = [state.q_d]
    for cycle in range(600):
        wanted = np.full(7, FAST if cycle // 150 % 2 else -FAST)
        dq = limited_velocity(limits_of(model), wanted, state.dq_d, state.ddq_d)
        sent.append(tuple(state.q_d + dq * CYCLE))
        robot.answer(state, Output(q=sent[-1]))
        state = robot.state()
        assert state.errors == (), place.log("fault")
    robot.stop()
    reached = np.abs(np.diff(sent, 2, axis=0)).max(axis=0) / CYCLE**2
    assert (reached > 0.999 * model.limits.joint.acceleration).all()
    assert (reached > model.limits.joint.acceleration).any() == (robot.version == 10)
    report = check(Motion.from_cycles(np.array(sent)), model, distance=None)
    end = CYCLE * (len(sent) - 1.5)  # There the check holds the arm.
    assert {violation.condition.id for violation in report.violations if violation.time < end} == set()


def as_floats(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)


def test_poses_along_the_limits_of_the_tool_conform() -> None:
    cartesian = FR3.limits.cartesian
    limits = cartesian.translation_velocity, cartesian.translation_acceleration, cartesian.translation_jerk
    by_id = {row.id: row for row in FR3_CONDITIONS.conditions}
    rows = [by_id.get(row.id.replace("arm_angle", "elbow"), row) for row in TOOL_CONDITIONS]
    wanted, velocity, acceleration = np.zeros((3, 3))
    place = np.array([0.3, 0.4, 0.8])
    monitor = CartesianMonitor(FR3.limits, rows=rows)
    monitor.reset(Pose(position=place))
    rng = np.random.default_rng(7)
    seen = 0.0
    for cycle in range(2000):
        if cycle % 50 == 0:
            wanted = rng.normal(size=3)
        limited = limited_vector(limits, wanted, as_floats(velocity), as_floats(acceleration))
        following = as_floats(place) + limited * CYCLE
        assert monitor.step(Pose(position=following)) == []
        before, velocity = velocity, (following - place) / CYCLE
        acceleration, place = (velocity - before) / CYCLE, following
        seen = max(seen, float(np.linalg.norm(acceleration)))
    assert seen > limits[1]


@pytest.mark.parametrize("table", [FCI_CONDITIONS, FR3_CONDITIONS], ids=["doubles", "floats"])
def test_torques_along_the_limit_of_their_rate_conform(table) -> None:
    joint = FR3.limits.joint
    monitor = TorqueMonitor(joint, [table.find("torque.rate"), table.find("torque.range")])
    rounded = as_floats if table is FR3_CONDITIONS else np.array
    tau, seen = np.zeros(7), 0.0
    for goal in np.linspace(1.0, 0.05, 40):
        for _ in range(50):
            following = limited_torque(1000.0, goal * (-1.0) ** round(goal * 40) * joint.torque, rounded(tau))
            assert [v for v in monitor.step(following) if v.condition.id == "torque.rate"] == []
            seen, tau = max(seen, float(np.abs(following - tau).max())), following
    assert (seen > 1.0) is (table is FR3_CONDITIONS)


def test_the_bounds_of_a_state_in_single_precision_are_that_much_wider() -> None:
    wide, bound = FR3_CONDITIONS, FCI_CONDITIONS
    joint = FR3.limits.joint
    reach = np.maximum(-joint.lower, joint.upper).astype(np.float32)
    for name, order in (("joint.acceleration", 2), ("joint.jerk", 3), ("start.position", 0)):
        more = wide.find(name).bounds(FR3.limits)[1] - bound.find(name).bounds(FR3.limits)[1]
        assert more * CYCLE**order == pytest.approx(np.spacing(reach) / 2.0, rel=0.01)
    assert wide.find("joint.velocity").bounds(joint)[1].tolist() == joint.velocity.tolist()
