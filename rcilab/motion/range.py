"""The joint range as the robot demands it: its bounds do not belong to it."""

from __future__ import annotations

from math import degrees

import numpy as np

from rcilab.arrays import JointVector
from rcilab.errors import PlanningError
from rcilab.limits import JointLimits


def require_inside(what: str, q: JointVector, limits: JointLimits) -> None:
    """Makes sure that joint angles are strictly inside their limits.

    Args:
        what: What they are, such as "start".
        q: Joint angles, shape (n,), [rad].
        limits: Of each joint.

    Raises:
        PlanningError: One is not.
    """
    outside = np.flatnonzero(~((limits.lower < q) & (q < limits.upper)))
    if outside.size:
        i = int(outside[0])
        angle, low, high = float(q[i]), float(limits.lower[i]), float(limits.upper[i])
        raise PlanningError(
            f"joint {i + 1}: {what} {angle_text(angle)} is not strictly between {angle_text(low)} and "
            f"{angle_text(high)}; choose an angle between them"
        ).coded("range", joint=i + 1, **_in_degrees(angle=angle, low=low, high=high))


def angle_text(value: float) -> str:
    """Returns an angle, [rad], as errors have it: in degrees, and as it was given."""
    return f"{degrees(value):.2f}° ({value:.4f} rad)"


def _in_degrees(**angles: float) -> dict[str, str]:
    return {name: f"{degrees(angle):.2f}" for name, angle in angles.items()}
