"""C23 comes before a joint leaves its range, in the modes in which a client steers the arm on-line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.sim.arm_setup import ArmSetup
from tests.makers.ufactory.controller.conftest import Q6, Arm

NOTHING = (0.0,) * 4
HALF = 0.25  # [rad] Half of the width of the reduced ranges.
SPEED = 400.0  # [mm/s]
PERIOD = 4  # [cycles]


def narrowed(arm: Arm, mode: Mode, lower: np.ndarray, upper: np.ndarray) -> None:
    """Sets reduced ranges, shape (6,), [rad], and a mode."""
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.call(Function.SET_SELF_COLLISION, "B", 0)
    arm.call(Function.SET_REDUCED_JOINT_RANGE, "14f", *np.column_stack((lower, upper)).ravel(), 0.0, 0.0)
    arm.call(Function.SET_REDUCED_MODE, "B", 1)
    arm.ready(mode)


def farthest(arm: Arm, lower: np.ndarray, upper: np.ndarray, act: Callable[[int], object] = lambda cycle: 0) -> float:
    """Returns how far joints get outside their ranges until some time after the error, or for 2 s, [rad]."""
    excess, left = -np.inf, 200
    for cycle in range(2000):
        if arm.controller.error is None:
            act(cycle)
        elif (left := left - 1) < 0:
            break
        arm.step()
        q = np.array(arm.controller.arm.commanded.q)
        excess = max(excess, float(np.maximum(lower - q, q - upper).max()))
    return excess


@pytest.mark.parametrize(("error", "stop"), [(None, 0.0), (23, 0.1)])
def test_joint_targets_of_mode_1(arm: Arm, error: int | None, stop: float) -> None:
    """They move with 1.5 rad/s, and end abruptly at the end of the range, or beyond it."""
    lower, upper = Q6 - np.full(6, HALF), Q6 + np.full(6, HALF)
    narrowed(arm, Mode.SERVO, lower, upper)

    def act(cycle: int) -> None:
        if cycle % PERIOD == 0:
            angle = Q6[4] + min(0.75e-3 * cycle * min(1.0, cycle / 100), HALF + stop - 1e-6)
            arm.call(Function.SERVO_JOINT, "10f", *Q6[:4], angle, Q6[5], *NOTHING)

    assert farthest(arm, lower, upper, act) < 1e-5
    assert arm.controller.error == error


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)])
@pytest.mark.parametrize("mode", [Mode.SERVO, Mode.CARTESIAN_VELOCITY])
def test_poses_and_velocities_of_the_tool(arm: Arm, mode: Mode, direction: tuple[float, ...]) -> None:
    lower, upper = Q6 - np.full(6, HALF), Q6 + np.full(6, HALF)
    narrowed(arm, mode, lower, upper)
    position, rpy = np.array(arm.pose[:3]), arm.pose[3:]

    def act(cycle: int) -> None:
        if mode is Mode.SERVO and cycle % PERIOD == 0:
            moved = position + 1e-3 * SPEED * cycle * min(1.0, cycle / 500) * np.array(direction)
            arm.call(Function.SERVO_CARTESIAN, "9f", *moved, *rpy, *NOTHING[:3])
        elif mode is Mode.CARTESIAN_VELOCITY and cycle == 0:
            arm.call(Function.CARTESIAN_VELOCITY, "6fB", *(SPEED * np.array(direction)), 0.0, 0.0, 0.0, 0)

    assert farthest(arm, lower, upper, act) < 1e-5
    assert arm.controller.error == 23


def test_a_line_of_mode_7_on_which_a_joint_is_outside_for_a_moment(arm: Arm) -> None:
    """Joint 2 is lowest 4 mm after the middle of a line across the arm, between the poses that are checked before."""
    arm.controller.set_up(ArmSetup(q=Q6))
    x, y, z, *rpy = arm.pose
    across = np.array((-y, x)) / np.hypot(x, y)
    arm.ready()
    arm.move_line((x - 40.0 * across[0], y - 40.0 * across[1], z, *rpy))
    arm.run()
    start = tuple(arm.q)
    lower, upper = np.full(6, -1.5), np.full(6, 1.5)
    lower[1] = -0.4990
    arm.call(Function.SET_REDUCED_JOINT_RANGE, "14f", *np.column_stack((lower, upper)).ravel(), 0.0, 0.0)
    arm.call(Function.SET_REDUCED_MODE, "B", 1)
    arm.ready(Mode.CARTESIAN_ONLINE)
    arm.move_line((x + 90.0 * across[0], y + 90.0 * across[1], z, *rpy))
    assert arm.controller.error is None
    assert farthest(arm, lower, upper) < 1e-5
    assert arm.controller.error == 23
    assert np.abs(np.subtract(arm.q, start)).max() > 0.05


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.SERVO, Mode.JOINT_ONLINE])
def test_a_joint_that_stands_outside_its_range_may_move_back_inside(arm: Arm, mode: Mode) -> None:
    lower, upper = Q6 - np.full(6, HALF), Q6 + np.full(6, HALF)
    upper[4] = Q6[4] - 0.1
    narrowed(arm, mode, lower, upper)

    def move(angle: float) -> None:
        q = (*Q6[:4], angle, Q6[5])
        if mode is Mode.SERVO:
            arm.call(Function.SERVO_JOINT, "10f", *q, *NOTHING)
        else:
            arm.move_joints(q)
        arm.run()

    for inwards in (0.0, -0.05, -0.12):  # Where it stands, on the way, and inside.
        move(Q6[4] + inwards)
        assert arm.controller.error is None
        assert arm.q[4] == pytest.approx(Q6[4] + inwards, abs=1e-6)
    move(Q6[4])  # No longer allowed.
    assert arm.controller.error == 23
    assert arm.q[4] == pytest.approx(Q6[4] - 0.12, abs=1e-6)


def test_a_joint_that_stands_outside_its_range_moves_no_farther_out(arm: Arm) -> None:
    lower, upper = Q6 - np.full(6, HALF), Q6 + np.full(6, HALF)
    upper[4] = Q6[4] - 0.1
    narrowed(arm, Mode.POSITION, lower, upper)
    arm.move_joints((*Q6[:4], Q6[4] + 0.01, Q6[5]))
    arm.run()
    assert arm.controller.error == 23
    assert arm.q == pytest.approx(Q6, abs=1e-6)
