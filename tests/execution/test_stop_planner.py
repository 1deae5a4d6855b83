"""The brakes: from any stream of commands to rest, in the controller's own arithmetic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.core.command import JointPosition, JointTorque
from rcilab.core.state import unknown_state
from rcilab.execution.stop_planner import JointStopPlanner, StreamStopPlanner, TorqueStopPlanner
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_joint

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits.joint


@settings(max_examples=40)
@given(st.integers(0, 2**31), st.floats(0.0, 1.0), st.floats(0.05, 1.0))
def test_a_stop_from_anywhere_in_a_motion_breaks_no_condition(seed, share, speed):
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(0.7 * LIMITS.lower, 0.7 * LIMITS.upper, (2, 7))
    rows = plan_joint(MODEL, start, goal, speed=speed).q
    count = 1 + int(share * (len(rows) - 1))
    brake = StreamStopPlanner(LIMITS)
    brake.begin(*((cycle, start) for cycle in (-3, -2, -1)))
    for cycle, row in enumerate(rows[:count]):
        brake.remember(row, cycle)
    way = brake.rows()
    monitor = JointMonitor(LIMITS)
    monitor.reset(start.tolist())
    for row in [*rows[:count], *way, way[-1], way[-1], way[-1]]:
        assert monitor.step(row.tolist()) == []


def test_missing_samples_do_not_look_like_speed():
    brake = StreamStopPlanner(LIMITS)
    speed = np.full(7, 0.5)
    brake.begin(*((cycle, speed * cycle * 1e-3) for cycle in (-3, -2, -1)))
    for cycle in (0, 1, 7, 12):
        brake.remember(speed * cycle * 1e-3, cycle)
    first = brake.rows()[0]
    assert np.allclose((first - speed * 0.012) / 1e-3, speed, atol=0.02)


def test_a_repeated_cycle_changes_nothing():
    brake = StreamStopPlanner(LIMITS)
    still = np.zeros(7)
    brake.begin(*((cycle, still) for cycle in (-3, -2, -1)))
    brake.remember(still, 0)
    brake.remember(np.full(7, 0.1), 0)
    assert np.array_equal(brake.rows(), np.zeros((1, 7)))


def test_torques_go_to_zero_at_the_allowed_rate():
    brake = TorqueStopPlanner(LIMITS)
    tau = np.array([20.0, -20.0, 5.0, 0.0, 1.0, -1.0, 0.3])
    brake.remember(JointTorque(tau), 0, None)
    way = np.array([command.tau for command in brake.plan()])
    assert np.array_equal(way[-1], np.zeros(7))
    assert (np.abs(np.diff(way, axis=0)) < LIMITS.torque_rate * 1e-3).all()


@pytest.mark.parametrize("distance", [0.1, 0.2, 0.3, 0.4])
def test_a_motion_that_is_sent_every_tenth_cycle_may_stand_at_its_end_and_not_before(distance):
    limits = replace(LIMITS, jerk=np.full(MODEL.n, 500.0))
    model = RobotModel(replace(MODEL.description, limits=replace(MODEL.limits, joint=limits)))
    rows = plan_joint(model, model.home, model.home + distance, speed=0.5).q
    last = 10 * -(-(len(rows) - 1) // 10)
    for stop, may_stand in ((last, True), (last // 20 * 10, False)):
        planner, state = JointStopPlanner(limits, 10), replace(unknown_state(MODEL.n), q_c=MODEL.home)
        planner.begin(state)
        for cycle in range(0, stop + 1, 10):
            planner.remember(JointPosition(rows[min(cycle, len(rows) - 1)]), cycle, state)
        assert (planner.find_motion() is None) is may_stand
