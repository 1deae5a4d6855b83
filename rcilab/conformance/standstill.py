"""Standstill at the ends of a motion, within the resolution of one cycle."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import AnyLimits, Condition, all_limits, joint_limits


def resolution(condition: Condition, limits: AnyLimits, cycles: int = 1) -> Array:
    """Returns the largest difference of commands in the first cycle after standstill within the jerk limit.

    A motion that starts as fast as allowed has already moved at its second command. The controller, which only has the
    commands, cannot distinguish a smaller difference from standstill, so no condition requires one.

    Args:
        condition: A row on the position, velocity or acceleration at the start or the end.
        limits: Limits of the arm.
        cycles: Number of cycles of the difference, 1 or more.

    Returns:
        Shape (n,), or (1,) for a row on the tool, in the condition's unit.
    """
    if condition.is_per_joint:
        jerk = joint_limits(limits).jerk
    elif condition.signal == "arm_angle":
        arm_angle = all_limits(limits).arm_angle
        jerk = np.array([0.0 if arm_angle is None else arm_angle.jerk])
    else:
        jerk = np.array([getattr(all_limits(limits).cartesian, f"{condition.signal}_jerk")])
    return jerk * (cycles * CYCLE_TIME) ** (3 - condition.order)


def above_resolution(value: Array, condition: Condition, limits: AnyLimits, cycles: int = 1) -> Array:
    """Returns the part of velocities or accelerations above the resolution of one cycle.

    Args:
        value: Differences of commands, shape (..., n), or (..., 1) for norms of the tool.
        condition: The row on them.
        limits: Limits of the arm.
        cycles: Number of cycles of the differences.
    """
    return np.sign(value) * np.maximum(np.abs(value) - resolution(condition, limits, cycles), 0.0)
