"""What counts as standstill at the ends of a motion: what is below the resolution of one cycle."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import AnyLimits, Condition, all_limits, joint_limits


def unresolved(condition: Condition, limits: AnyLimits, cycles: int = 1) -> Array:
    """Returns how large a difference of commands can be in the first cycle after standstill, within the jerk limit.

    A motion that starts as fast as it may has moved by the time of its second command. So the controller, which has
    only the commands, cannot distinguish less than this from standstill, and no row of the table asks for more.

    Args:
        condition: A row on the velocity or acceleration at the start or the end.
        limits: Of the arm.
        cycles: Over how many cycles the difference is taken, 1 or more.

    Returns:
        Shape (n,), or (1,) for a row on the tool, in the condition's unit.
    """
    jerk = (
        joint_limits(limits).jerk
        if condition.is_per_joint
        else np.array([getattr(all_limits(limits).cartesian, f"{condition.signal}_jerk")])
    )
    return jerk * (cycles * CYCLE_TIME) ** (3 - condition.order)


def beyond_a_cycle(value: Array, condition: Condition, limits: AnyLimits, cycles: int = 1) -> Array:
    """Returns what is left of velocities or accelerations without what one cycle cannot resolve.

    Args:
        value: Differences of commands, shape (..., n), or (..., 1) for norms of the tool's.
        condition: The row on them.
        limits: Of the arm.
        cycles: Over how many cycles the differences are taken.
    """
    return np.sign(value) * np.maximum(np.abs(value) - unresolved(condition, limits, cycles), 0.0)
