"""Standstill at the ends of a motion, within the resolution of one cycle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import AnyLimits, Bounds, Signal, all_limits, joint_limits


def resolution(signal: Signal, order: int, limits: AnyLimits, cycles: int = 1) -> Array:
    """Returns the largest difference of commands in the first cycle after standstill within the jerk limit.

    A motion that starts as fast as allowed has already moved at its second command. The controller, which only has the
    commands, cannot distinguish a smaller difference from standstill, so no condition requires one.

    Args:
        signal: The signal at the start or the end: joint, translation, rotation or arm_angle.
        order: Its derivative: 0 the difference of the signal itself, 1 its velocity, 2 its acceleration.
        limits: Limits of the arm.
        cycles: Number of cycles of the difference, 1 or more.

    Returns:
        Shape (n,), or (1,) for a signal of the tool, in the unit of the derivative.
    """
    if signal == "joint":
        jerk = joint_limits(limits).jerk
    elif signal == "arm_angle":
        arm_angle = all_limits(limits).arm_angle
        jerk = np.array([0.0 if arm_angle is None else arm_angle.jerk])
    else:
        jerk = np.array([getattr(all_limits(limits).cartesian, f"{signal}_jerk")])
    return jerk * (cycles * CYCLE_TIME) ** (3 - order)


def standstill_bounds(tolerance: float, signal: Signal, order: int) -> Callable[[AnyLimits], Bounds]:
    """Returns a function that computes the bounds of a velocity or acceleration at standstill.

    Args:
        tolerance: Largest value that counts as zero, beyond the resolution, in the unit of the derivative.
        signal: As for `resolution`.
        order: As for `resolution`.
    """

    def bounds(limits: AnyLimits) -> Bounds:
        bound = tolerance + resolution(signal, order, limits)
        return -bound, bound

    return bounds
