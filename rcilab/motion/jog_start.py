"""Check that a moving arm can still stop inside its limits."""

from __future__ import annotations

from math import degrees

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits
from rcilab.motion.stop import plan_stop


def require_stoppable(limits: JointLimits, q: JointVector, dq: JointVector, ddq: JointVector) -> None:
    """Requires a state inside the limits, from which the fastest stop stays inside them.

    Args:
        limits: Bounds of the joints.
        q: Joint angles, shape (n,), [rad].
        dq: Joint velocities, shape (n,), [rad/s].
        ddq: Joint accelerations, shape (n,), [rad/s^2].

    Raises:
        PlanningError: The message names the joint, the value and the bound.
    """
    # While full jerk removes the acceleration, the velocity still changes by ddq^2 / (2 jerk).
    peak = dq + ddq * np.abs(ddq) / (2.0 * limits.jerk)
    (lowest, _), (highest, _) = plan_stop(limits, q, dq, ddq).polynomial.extremes()
    for name, value, lower, upper, unit in (
        ("angle", q, limits.lower, limits.upper, "rad"),
        ("velocity", dq, -limits.velocity, limits.velocity, "rad/s"),
        ("acceleration", ddq, -limits.acceleration, limits.acceleration, "rad/s^2"),
        ("velocity once the acceleration is zero", peak, -limits.velocity, limits.velocity, "rad/s"),
        ("angle after the fastest stop", lowest, limits.lower, limits.upper, "rad"),
        ("angle after the fastest stop", highest, limits.lower, limits.upper, "rad"),
    ):
        outside = np.flatnonzero(~((lower < value) & (value < upper)))
        if outside.size:
            i = int(outside[0])
            x, bound = float(value[i]), float(upper[i] if value[i] >= upper[i] else lower[i])
            angle = f" ({degrees(x):.2f}°, limit {degrees(bound):.2f}°)" if unit == "rad" else ""
            raise PlanningError(
                f"joint {i + 1}: {name} {x:.4f} {unit} is not inside {bound:.4f} {unit}{angle}; "
                f"start from a state inside the limits, or brake with plan_stop"
            ).coded("jog_start", joint=i + 1)
