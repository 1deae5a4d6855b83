"""Filters and rate limits as functions, and what they make of streams of commands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.check import check
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.execution.filters import LowPass, RateLimiter, is_near
from rcilab.makers.rokae.conditions import rci_faults
from rcilab.makers.rokae.limit_tables import cartesian_limits
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint
from rcilab.motion.cartesian import schedule
from rcilab.motion.low_pass import low_pass, smoothing
from rcilab.motion.path import build_line

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits
HOME = MODEL.home


def limited(commands, limits=LIMITS):
    limiter = RateLimiter(limits)
    limiter.begin(commands[0])
    return [limiter.step(command) for command in commands]


def joint_faults(commands):
    monitor = JointMonitor(LIMITS.joint)
    monitor.reset(commands[0].q.tolist())
    return {fault for command in commands for fault in rci_faults(monitor.step(command.q.tolist()))}


def tool_faults(commands, limits):
    monitor = CartesianMonitor(limits)
    monitor.reset(Pose.from_matrix(commands[0].T_base_tool), commands[0].psi)
    return {
        fault for c in commands for fault in rci_faults(monitor.step(Pose.from_matrix(c.T_base_tool), c.psi))
    }  # fmt: skip


def test_the_vendors_default_filter_is_its_formula_and_lags_as_its_moves_do():
    k = smoothing(100.0)
    assert k == pytest.approx(0.001 / (0.001 + 1.0 / (2.0 * math.pi * 100.0)), abs=1e-15)
    # MOVEJ at speed 0.2 with the vendor's filter on: command 3516 of joint 2, beside 0.261753751887588 without.
    goal = [0.0, 0.5235983333333333, 0.0, 1.0471966666666666, 0.0, 1.570795, 0.0]
    x = np.zeros(7)
    rows = plan_joint(MODEL, np.zeros(7), goal, speed=0.2, law="s_profile").q
    for row in rows[2:3517]:  # Its filter starts at the first command, that of t = 1 ms.
        x = low_pass(row, x, k)
    assert x[1] == pytest.approx(0.261631243640531, abs=1e-9)


@pytest.mark.parametrize(("frequency", "k"), [(1000.0, 1.0), (2000.0, 1.0)])
def test_a_thousand_hertz_is_no_filter(frequency, k):
    assert smoothing(frequency) == k


@pytest.mark.parametrize("frequency", [0.0, -1.0, math.nan, "fast"])
def test_what_is_no_frequency_is_named(frequency):
    with pytest.raises(InvalidValueError, match="cut_off"):
        smoothing(frequency)


def test_a_low_pass_turns_and_moves_in_the_same_proportion():
    low = LowPass(50.0)
    k = smoothing(50.0)
    low.begin(CartesianPosition(np.eye(4), 0.0))
    goal = CartesianPosition(Pose.from_rpy((0.1, 0.0, 0.0), (0.0, 0.0, 0.4)).matrix, 0.2)
    sent = low.step(goal)
    assert sent.T_base_tool[0, 3] == pytest.approx(0.1 * k)
    assert math.atan2(sent.T_base_tool[1, 0], sent.T_base_tool[0, 0]) == pytest.approx(0.4 * k)
    assert sent.psi == pytest.approx(0.2 * k)
    for _ in range(400):
        sent = low.step(goal)
    assert is_near(sent, goal)


def test_a_low_pass_starts_at_the_first_command_of_torques_and_angles():
    low = LowPass(10.0)
    for kind in (JointPosition, JointTorque):
        first = kind(np.full(7, 0.3))
        low.begin(first)
        assert is_near(low.step(first), first)
        assert not is_near(low.step(kind(np.full(7, 0.4))), first)


@settings(max_examples=15)
@given(st.integers(0, 2**31), st.floats(0.01, 1.0))
def test_motions_inside_the_limits_pass_unchanged(seed, speed):
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(0.7 * LIMITS.joint.lower, 0.7 * LIMITS.joint.upper, (2, 7))
    rows = plan_joint(MODEL, start, goal, speed=speed).q
    sent = limited([JointPosition(row) for row in rows[:3000]])
    assert np.abs([c.q for c in sent] - rows[:3000]).max() <= 1e-9


@settings(max_examples=25)
@given(st.integers(0, 2**31), st.sampled_from([1e-4, 1e-2, 0.3]))
def test_whatever_angles_are_asked_for_no_condition_breaks(seed, size):
    rng = np.random.default_rng(seed)
    jumps = np.where(rng.random((400, 1)) < 0.05, rng.normal(0.0, size, (400, 7)), 0.0)
    walk = rng.normal(0.0, size * 0.01, (400, 7))
    rows = np.clip(np.cumsum(jumps + walk, axis=0), -0.8, 0.8)  # Far from the position limits, which are not its.
    rows[0] = 0.0
    assert joint_faults(limited([JointPosition(row) for row in rows])) == set()


@pytest.mark.parametrize("jump", [0.003, 0.01, 0.1, 0.5, -1.0])
def test_a_jump_is_reached_and_hardly_passed(jump):
    goal = JointPosition(HOME + jump)
    sent = limited([JointPosition(HOME), *[goal] * 1500])
    way = (np.array([c.q for c in sent]) - HOME) / jump
    assert np.abs(way[-1] - 1.0).max() < 1e-9
    assert (way.max() - 1.0) * abs(jump) < 5e-4
    assert is_near(sent[-1], goal)


@settings(max_examples=15)
@given(st.integers(0, 2**31), st.sampled_from(["manual", "sdk"]))
def test_whatever_poses_are_asked_for_no_condition_breaks(seed, table):
    rng = np.random.default_rng(seed)
    limits = cartesian_limits(LIMITS, table)
    poses, here = [], Pose((0.4, 0.0, 0.5))
    for k in range(300):
        if k and rng.random() < 0.05:
            here = Pose.from_rpy(here.position + rng.normal(0.0, 0.1, 3), rng.uniform(-1.0, 1.0, 3))
        poses.append(CartesianPosition(here.matrix, float(np.clip(here.position[1], -1.0, 1.0))))
    assert tool_faults(limited(poses, limits), limits) == set()


def test_a_jump_of_the_pose_is_reached():
    goal = CartesianPosition(Pose.from_rpy((0.6, 0.1, 0.5), (0.5, -0.5, 1.0)).matrix, 0.7)
    sent = limited([CartesianPosition(Pose((0.4, 0.0, 0.5)).matrix, 0.0), *[goal] * 2000])
    assert is_near(sent[-1], goal)


def test_a_line_inside_the_limits_passes_unchanged():
    path = build_line(Pose((0.4, 0.0, 0.5)), Pose.from_rpy((0.6, 0.1, 0.5), (0.1, 0.3, 0.0)), 0.0, 0.3)
    commands = [CartesianPosition(pose.matrix, psi) for pose, psi in map(path.at, schedule(path, 0.4))]
    for wanted, sent in zip(commands, limited(commands), strict=True):
        assert np.abs(wanted.T_base_tool - sent.T_base_tool).max() < 1e-9
        assert sent.psi == pytest.approx(wanted.psi, abs=1e-9)


def test_torques_keep_their_rate_and_start_at_zero():
    sent = limited([JointTorque(np.full(7, 10.0))] * 20)
    monitor = TorqueMonitor(LIMITS.joint)
    assert all(monitor.step(c.tau.tolist()) == [] for c in sent)
    assert np.array_equal(sent[-1].tau, np.full(7, 10.0))


@pytest.mark.parametrize("period", [1, 10])
def test_commands_of_any_period_keep_the_limits_over_that_period(period):
    joint, h = LIMITS.joint, period * 1e-3
    limiter = RateLimiter(LIMITS, period)
    limiter.begin(JointPosition(HOME))
    rows = np.array([HOME] * 3 + [limiter.step(JointPosition(HOME + 0.5)).q for _ in range(2000 // period)])
    for order, bound in enumerate((joint.velocity, joint.acceleration, joint.jerk), 1):
        assert (np.abs(np.diff(rows, order, axis=0)) / h**order <= bound).all()
    assert np.abs(rows[-1] - HOME - 0.5).max() < 1e-3
    assert smoothing(100.0, period) == pytest.approx(h / (h + 1.0 / (200.0 * math.pi)))


@pytest.mark.parametrize(("name", "period"), [("xArm7", 1), ("xArm7", 5), ("Lite6", 5), ("RM65", 5), ("FR3", 1)])
@pytest.mark.parametrize("jump", [0.003, 0.01, 0.05, 0.5])
def test_a_jump_is_reached_where_an_acceleration_takes_long_to_change(name: str, period: int, jump: float) -> None:
    model = load_model(name)
    limiter = RateLimiter(model.limits, period)
    limiter.begin(JointPosition(model.home))
    goal = model.home + jump
    rows = np.array([limiter.step(JointPosition(goal)).q for _ in range(2000 // period)])
    assert np.abs(rows[-1] - goal).max() < 1e-9
    assert (rows - goal).max() < 0.25 * jump


@pytest.mark.parametrize("seed", range(6))
def test_jumps_towards_the_ends_of_ranges_keep_velocity_bounds_that_decrease_there(seed: int) -> None:
    fr3 = load_model("FR3")
    joint, rng = fr3.limits.joint, np.random.default_rng(seed)
    is_up = rng.integers(0, 2, 7) == 1
    goal = np.where(is_up, joint.upper - 0.02, joint.lower + 0.02)
    limiter = RateLimiter(fr3.limits)
    limiter.begin(JointPosition(fr3.home))
    rows = [fr3.home]
    for cycle in range(6000):
        target = fr3.home if cycle < 1500 and rng.random() < 0.3 else goal
        command = limiter.step(JointPosition(target))
        assert isinstance(command, JointPosition)
        rows.append(command.q)
    report = check(Motion.from_cycles(np.array(rows)), fr3, distance=None)
    assert report.violations == ()
    assert np.abs(rows[-1] - goal).max() < 1e-6
