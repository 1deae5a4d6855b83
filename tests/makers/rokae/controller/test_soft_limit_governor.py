"""auto_limit: joints are led to rest inside their soft limits, whatever is commanded, and follow again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.makers.rokae import wire as rci
from rcilab.model.robot_model import load_model
from rcilab.motion.joint import plan_joint
from rcilab.sim.soft_limit_governor import SoftLimitGovernor, plan_fastest_stop

LIMITS = load_model("xMatePro7").limits.joint


def waves(centre: np.ndarray, amplitude: np.ndarray, frequency: np.ndarray, count: int) -> np.ndarray:
    """Commands that swing about a centre; they begin at rest, with a jerk inside the limits."""
    t = np.arange(1, count + 1)[:, None] * 1e-3
    ramp = np.clip(t / 1.5, 0.0, 1.0)
    ramp = ramp**4 * (35.0 - 84.0 * ramp + 70.0 * ramp**2 - 20.0 * ramp**3)
    return centre + amplitude * np.sin(frequency * t) * ramp


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_no_command_leads_out_and_every_step_keeps_the_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frequency = rng.uniform(0.5, 5.0, 7)
    largest = LIMITS.velocity / (frequency + 1.5), LIMITS.acceleration / (frequency**2 + 3.0 * frequency + 3.5)
    amplitude = np.minimum(*largest) * rng.uniform(0.1, 0.9, 7)
    centre = rng.choice((-1.0, 1.0), 7) * (LIMITS.upper - amplitude * rng.uniform(0.2, 1.2, 7))
    fence = SoftLimitGovernor(LIMITS, centre.tolist())
    rows = [centre] * 3 + [np.array(fence.step(row.tolist())) for row in waves(centre, amplitude, frequency, 3000)]
    rows = np.array(rows)
    assert (rows < LIMITS.upper).all()
    assert (rows > LIMITS.lower).all()
    assert (np.abs(np.diff(rows, axis=0)) * 1e3 < LIMITS.velocity).all()
    assert (np.abs(np.diff(rows, 2, axis=0)) * 1e6 < LIMITS.acceleration).all()
    assert (np.abs(np.diff(rows, 3, axis=0)) * 1e9 < LIMITS.jerk).all()


def test_what_stays_inside_is_followed_to_the_last_bit() -> None:
    fence = SoftLimitGovernor(LIMITS, [0.0] * 7)
    for row in waves(np.zeros(7), np.full(7, 0.3), np.full(7, 2.0), 2000).tolist():
        assert fence.step(row) == row
    assert fence.holds == ()


def test_a_joint_that_was_held_follows_again_when_its_command_is_back() -> None:
    start = LIMITS.upper - 0.3
    fence = SoftLimitGovernor(LIMITS, start.tolist())
    rows = waves(start, np.full(7, 0.5), np.full(7, 1.0), 2800)
    held = [fence.holds for row in rows.tolist() if fence.step(row) is not None]
    assert (1, 2, 3, 4, 5, 6, 7) in held
    for _ in range(5000):
        fence.step(start.tolist())
    assert fence.step(start.tolist()) == start.tolist()
    assert fence.holds == ()


@given(st.floats(0.0, 3.0), st.floats(-10.0, 10.0))
def test_the_fastest_stop_ends_at_rest(v: float, a: float) -> None:
    acceleration, jerk = 12.0, 4000.0
    stop = plan_fastest_stop(v, a, acceleration, jerk)
    speed, acc = v, a
    for duration, rate in zip(stop.times, (-jerk, 0.0, jerk), strict=True):
        speed += duration * (acc + duration * rate / 2.0)
        acc += duration * rate
    assert acc == pytest.approx(0.0, abs=1e-9)
    if stop.times[0]:
        assert speed == pytest.approx(0.0, abs=1e-9)
        assert 0.0 <= stop.distance <= 1.1 * (v * v / acceleration + 0.1)


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_with_auto_limit_a_motion_beyond_the_soft_limit_ends_inside_it_without_a_fault(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    hand.cycle.auto_limit = True
    upper = hand.model.home + math.radians(10.0)
    assert hand.ask(rci.SetJointLimit(tuple(upper), tuple(hand.model.home - 1.0))) == 0
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.5, speed=1.0).q
    hand.play(np.vstack((rows, np.tile(rows[-1], (200, 1)))))
    assert hand.state.faults == ()
    assert (hand.state.q_c < upper).all()
    assert np.allclose(hand.state.q_c, upper, rtol=0, atol=0.02)
    back = plan_joint(hand.model, rows[-1], hand.model.home, speed=0.5).q
    hand.play(np.vstack((back, np.tile(back[-1], (3000, 1)))))
    assert hand.state.faults == ()
    assert np.allclose(hand.state.q_c, hand.model.home, rtol=0, atol=1e-8)
    hand.assert_smooth()


@pytest.mark.parametrize("absurd", [1e3, 1e300, -1e300])
def test_absurd_commands_are_held_like_any_others(absurd: float) -> None:
    fence = SoftLimitGovernor(LIMITS, [0.0] * 7)
    rows = [np.zeros(7)] * 3 + [np.array(fence.step([absurd] * 7)) for _ in range(200)]
    rows += [np.array(fence.step([0.1] * 7)) for _ in range(4000)]
    assert (np.abs(np.diff(rows, 3, axis=0)) * 1e9 < LIMITS.jerk).all()
    assert np.allclose(rows[-1], 0.1, rtol=0, atol=1e-7)
