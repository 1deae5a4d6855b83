"""Low passes on commands: the vendor's formula, off at 1000 Hz, and what a motion shows of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.spatial import IDENTITY, Pose, rotation_between
from rcilab.makers.rokae import wire as rci
from rcilab.motion.joint import plan_joint
from rcilab.sim.filters import LowPass, PoseLowPass, low_pass_gain


@pytest.mark.parametrize("frequency", [1.0, 100.0, 999.0])
def test_the_gain_is_the_vendors(frequency: float) -> None:
    assert low_pass_gain(frequency) == pytest.approx(1e-3 / (1e-3 + 1.0 / (2.0 * math.pi * frequency)), rel=1e-15)


def test_at_1000_hz_it_is_off() -> None:
    assert LowPass(1000.0, [0.0]).step([1.0]) == [1.0]


@pytest.mark.parametrize("frequency", [5.0, 50.0])
def test_a_ramp_comes_through_late_by_the_time_constant(frequency: float) -> None:
    low_pass = LowPass(frequency, [0.0])
    out = 0.0
    for k in range(1, 2001):
        (out,) = low_pass.step([1e-3 * k])
    assert 2.0 - out == pytest.approx(1.0 / (2.0 * math.pi * frequency), rel=1e-9)


def test_a_pose_is_filtered_in_position_orientation_and_arm_angle_alike() -> None:
    goal = Pose.from_rpy((0.1, -0.2, 0.3), (0.0, 0.0, 0.5))
    low_pass = PoseLowPass(100.0, IDENTITY, 3.1)
    pose, psi = low_pass.step(goal, -3.1)
    gain = low_pass_gain(100.0)
    assert np.allclose(pose.position, gain * goal.position, rtol=0, atol=1e-15)
    assert math.hypot(*rotation_between(IDENTITY.parts[0], pose.parts[0])) == pytest.approx(gain * 0.5, rel=1e-12)
    assert psi == pytest.approx(3.1 + gain * (math.tau - 6.2), rel=1e-12)  # The short way, through pi.


def test_set_filters_delays_a_motion_before_it_is_judged(make_hand) -> None:
    hand = make_hand()
    assert hand.ask(rci.SetFilters(20.0, 1000.0, 1000.0)) == 0
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.1).q
    hand.play(rows)
    assert np.abs(hand.state.q_c - rows[-1]).max() > 1e-4
    hand.play(np.tile(rows[-1], (200, 1)))
    assert hand.state.faults == ()
    assert np.allclose(hand.state.q_c, rows[-1], rtol=0, atol=1e-9)


def test_a_step_that_a_filter_makes_bearable_is_no_fault(make_hand) -> None:
    for frequency, is_fault in ((1000.0, True), (1.0, False)):
        hand = make_hand()
        hand.ask(rci.SetFilters(frequency, frequency, frequency))
        hand.start()
        q = hand.state.q_c.copy()
        hand.command(q)
        q[0] += 1e-5
        for _ in range(50):
            hand.command(q)
        assert bool(hand.state.faults) is is_fault


def test_filtered_poses_and_torques_arrive_too(make_hand) -> None:
    hand = make_hand()
    assert hand.ask(rci.SetFilters(1000.0, 30.0, 30.0)) == 0
    hand.start(1, 2)
    T = hand.state.T_base_tool_c.matrix
    hand.shift((0.0, 0.0, 0.05), 0.6)
    T[2, 3] += 0.05
    for _ in range(200):
        hand.pose(T)
    assert hand.state.faults == ()
    assert np.allclose(hand.state.T_base_tool_c, T, rtol=0, atol=1e-9)
    assert hand.ask(rci.StopMove()) == 0
    hand.start(4, 0)
    assert hand.torque((1.0,) + (0.0,) * 6).tau_c[0] == pytest.approx(low_pass_gain(30.0))
