"""Commands with gaps between them: a motion that keeps its bounds keeps them whichever of its samples are missing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.divided_differences import difference_times
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import faults_of
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_JOINT_CONDITIONS, RCI_TOOL_CONDITIONS, RCI_TORQUE_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint, plan_line

MODEL = load_model("xMatePro7")
HOME = MODEL.home
SWING = plan_joint(MODEL, HOME, HOME + 0.4, speed=1.0).q
_START = MODEL.forward(HOME)
LINE = plan_line(
    MODEL, HOME, Pose.from_parts(_START.parts[0], np.array(_START.parts[1]) + (0.0, 0.15, -0.1)), speed=0.8
)


def kept(seed: int, share: float, count: int) -> list[tuple[int, int]]:
    """Rows that arrive, each with the cycles since the one before; the first always does."""
    rows = np.flatnonzero(np.random.default_rng(seed).random(count) >= share)
    rows = rows[rows > 0]
    return list(zip(rows.tolist(), np.diff(rows, prepend=0).tolist(), strict=True))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32), share=st.sampled_from([0.0, 0.01, 0.1, 0.5, 0.9]))
def test_no_gap_makes_a_good_joint_motion_bad(seed: int, share: float) -> None:
    monitor = JointMonitor(MODEL.limits.joint, RCI_JOINT_CONDITIONS)
    monitor.reset(SWING[0].tolist())
    for row, cycles in kept(seed, share, len(SWING)):
        assert faults_of(monitor.step(SWING[row].tolist(), cycles)) == (), monitor.violations()


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32), share=st.sampled_from([0.01, 0.1, 0.5]))
def test_no_gap_makes_a_good_line_bad(seed: int, share: float) -> None:
    monitor = CartesianMonitor(MODEL.limits, rows=RCI_TOOL_CONDITIONS)
    poses = [MODEL.forward(q) for q in LINE.q]
    angles = [MODEL.arm_angle(q) for q in LINE.q]
    monitor.reset(poses[0], angles[0])
    for row, cycles in kept(seed, share, len(poses)):
        assert faults_of(monitor.step(poses[row], angles[row], cycles)) == (), monitor.violations()


@pytest.mark.parametrize("cycles", [1, 2, 7])
def test_a_jump_behind_a_gap_is_still_a_jump(cycles: int) -> None:
    monitor = JointMonitor(MODEL.limits.joint, RCI_JOINT_CONDITIONS)
    monitor.reset(HOME.tolist())
    row = HOME + [2.2e-3 * cycles, 0, 0, 0, 0, 0, 0]  # 2.2 rad/s on average, whatever happened in between.
    assert Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION in faults_of(monitor.step(row.tolist(), cycles))
    assert monitor.dq[0] == pytest.approx(2.2)


def test_the_differences_of_a_cubic_are_its_derivatives_at_any_spacing() -> None:
    monitor = JointMonitor(MODEL.limits.joint, RCI_JOINT_CONDITIONS)
    times = np.cumsum([0, 3, 1, 5, 2, 1, 1, 1]) * 1e-3
    monitor.reset([0.0] * 7)
    for t, cycles in zip(times[1:], (3, 1, 5, 2, 1, 1, 1), strict=True):
        monitor.step([600.0 * t**3] * 7, cycles)
    assert monitor.jerk == pytest.approx([3600.0] * 7, rel=1e-9)
    assert monitor.ddq == pytest.approx([3600.0 * (times[-1] + times[-2] + times[-3]) / 3.0] * 7, rel=1e-9)


def test_torques_are_judged_by_their_rate_over_the_gap() -> None:
    monitor = TorqueMonitor(MODEL.limits.joint, RCI_TORQUE_CONDITIONS)
    rate = float(MODEL.limits.joint.torque_rate[0])
    first = 0.9 * rate * 5e-3
    assert faults_of(monitor.step([first, 0, 0, 0, 0, 0, 0], 5)) == ()
    assert monitor.dtau[0] == pytest.approx(0.9 * rate)
    assert faults_of(monitor.step([first + 1.1 * rate * 4e-3, 0, 0, 0, 0, 0, 0], 4)) == (
        Fault.COMMAND_TORQUE_DISCONTINUITY,
    )


def test_even_spacing_is_divided_by_the_cycle_time() -> None:
    assert difference_times(1, (1, 1)) == (1e-3, 1e-3, 1e-3)
    assert difference_times(2, (1, 3)) == pytest.approx((2e-3, 1.5e-3, 2e-3))
