"""What the next command would be."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.sim.command_extrapolator import CommandExtrapolator


def fed(rows: np.ndarray) -> CommandExtrapolator:
    stream = CommandExtrapolator(rows[0].tolist())
    for row in rows[1:]:
        stream.take(row.tolist())
    return stream


def cubic(k: int) -> np.ndarray:
    t = k * 1e-3
    return np.full(7, 0.2 * t + 1.5 * t * t - 700.0 * t**3)


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_without_a_target_the_acceleration_goes_on(steps: int) -> None:
    t = np.arange(-5, 1)[:, None] * 1e-3
    velocity, acceleration = np.full(7, 0.3), np.full(7, 2.0)
    ahead = steps * 1e-3
    found = fed(velocity * t + acceleration * t * t / 2.0).predict(steps)
    assert np.allclose(found, velocity * ahead + acceleration * ahead * ahead / 2.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("gap", [2, 3, 10])
def test_a_bridge_follows_a_constant_jerk_exactly(gap: int) -> None:
    stream = fed(np.array([cubic(k) for k in (-3, -2, -1, 0)]))
    for steps in range(1, gap):
        found = stream.predict(steps, cubic(gap).tolist(), gap)
        assert np.allclose(found, cubic(steps), rtol=0, atol=1e-15)


@pytest.mark.parametrize("steps", [2, 5, 9])
def test_a_command_tells_by_itself_how_far_ahead_it_belongs(steps: int) -> None:
    stream = fed(np.array([cubic(k) for k in (-3, -2, -1, 0)]))
    assert stream.is_next(cubic(1).tolist(), steps)
    assert not stream.is_next(cubic(steps).tolist(), steps)


def test_at_rest_the_same_command_again_is_the_next_one() -> None:
    assert CommandExtrapolator([1.0, 2.0]).is_next([1.0, 2.0], 5)


@pytest.mark.parametrize("gap", [2, 22, 50])
def test_the_commands_of_a_whole_gap_follow_a_constant_jerk_and_are_taken(gap: int) -> None:
    stream = fed(np.array([cubic(k) for k in (-3, -2, -1, 0)]))
    found = stream.bridge(cubic(gap).tolist(), gap)
    assert np.allclose(found, [cubic(k) for k in range(1, gap)], rtol=0, atol=1e-13)
    assert stream.last == found[-1]


def test_the_path_over_a_long_gap_is_straight() -> None:
    found = np.array(fed(np.array([cubic(k) for k in (-3, -2, -1, 0)])).bridge([0.2] * 7, 1000))
    assert found.shape == (49, 7)
    assert np.allclose(np.diff(found, axis=0), (0.2 - cubic(0)) / 1000.0, rtol=0, atol=1e-12)
