from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rcilab.model.robot_model import load_model
from rcilab.sim.reference_trajectory import ReferenceTrajectory

LIMITS = load_model("xMatePro7").limits.joint
UNIT = st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7).map(np.array)


def moving(velocity: np.ndarray, acceleration: np.ndarray) -> tuple[ReferenceTrajectory, list[np.ndarray]]:
    """A commanded motion that has had constant acceleration long enough for its differences to be true."""
    commanded = ReferenceTrajectory(LIMITS, [0.0] * 7)
    t = np.arange(-5, 1)[:, None] * 1e-3
    rows = velocity * t + acceleration * t * t / 2.0
    commanded.reset(rows[0].tolist())
    for row in rows[1:]:
        commanded.move(row.tolist())
    return commanded, list(rows[2:])


@given(UNIT, UNIT)
def test_from_any_state_inside_the_limits_it_comes_to_rest_inside_acceleration_and_jerk(velocity, acceleration) -> None:
    # Not at full acceleration: where rounding decides, the manual's strict bounds leave nothing over.
    commanded, rows = moving(velocity * LIMITS.velocity, 0.95 * acceleration * LIMITS.acceleration)
    for _ in range(3000):
        commanded.stop()
        rows.append(np.array(commanded.q))
        if commanded.is_stationary:
            break
    assert commanded.is_stationary
    ddq = np.diff(rows, 2, axis=0) * 1e6
    jerk = np.diff(rows, 3, axis=0) * 1e9
    assert (np.abs(ddq) < LIMITS.acceleration).all()
    assert (np.abs(jerk) < LIMITS.jerk).all()


def test_the_end_of_a_decent_motion_is_rest_on_the_spot() -> None:
    commanded = ReferenceTrajectory(LIMITS, [0.0] * 7)
    commanded.move([1e-6] * 7)
    goal = commanded.q
    for _ in range(3):
        commanded.stop()
        assert commanded.q == goal
    assert commanded.is_stationary


def test_resting_it_stays_at_rest() -> None:
    commanded = ReferenceTrajectory(LIMITS, [0.5] * 7)
    for _ in range(3):
        commanded.stop()
    assert commanded.is_stationary
    assert commanded.q == [0.5] * 7


@given(UNIT, UNIT)
def test_joined_to_a_moving_arm_it_comes_to_rest_inside_acceleration_and_jerk(velocity, acceleration) -> None:
    q, dq, ddq = np.zeros(7), velocity * LIMITS.velocity, 0.95 * acceleration * LIMITS.acceleration
    commanded = ReferenceTrajectory(LIMITS, [1.0] * 7)
    commanded.join(q.tolist(), dq.tolist(), ddq.tolist())
    rows = [q - 1e-3 * dq + 0.5e-6 * ddq, q]
    while not commanded.is_stationary:
        commanded.stop()
        rows.append(np.array(commanded.q))
        assert len(rows) < 3000
    assert (np.abs(np.diff(rows, 2, axis=0)) * 1e6 < LIMITS.acceleration).all()
    assert (np.abs(np.diff(rows, 3, axis=0)) * 1e9 < LIMITS.jerk).all()


def test_joined_to_an_arm_that_settles_by_rounding_alone_it_rests_at_once() -> None:
    commanded = ReferenceTrajectory(LIMITS, [0.1] * 7)
    commanded.join([0.2] * 7, [2e-6] * 7, [1e-4] * 7)
    assert commanded.is_stationary
    assert commanded.q == [0.2] * 7


def test_an_arm_that_was_thrown_beyond_reason_still_gets_a_stop() -> None:
    commanded = ReferenceTrajectory(LIMITS, [0.0] * 7)
    commanded.join([0.0] * 7, [500.0] * 7, [1e5] * 7)
    for _ in range(3000):
        commanded.stop()
    assert commanded.is_stationary
