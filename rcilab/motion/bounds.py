"""The bounds of planners: joint ranges, and the margin of planned motions to the limits."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, inf, radians

import numpy as np

from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits

LIMIT_MARGIN = 0.999
"""Part of each velocity, acceleration and jerk limit that a planned motion uses.

Tuning value. The manual's conditions are strict, and a time-optimal curve sits on its bounds: its backward differences
at 1 ms are means of the derivative, so they reach the bound itself. Angles as doubles add rounding of 4e-6 rad/s^3 to a
third difference. A part in a thousand covers both, and a start that is 1 nrad off, for 0.1 % of the time. It is not a
margin for lost packets: that one belongs to the side that streams.
"""

RECOVERY_RANGE = radians(20.0)
"""Largest distance of a joint from its range at which a recovery may start, [rad]. The arms stop within 18 degrees from
full speed, so a larger distance has another cause than a late stop."""
_ROUNDING = 1e-6  # [rad] How far outwards rounding may move a joint that starts outside.


def require_inside(what: str, q: JointVector, limits: JointLimits) -> None:
    """Requires joint angles to be strictly inside their limits.

    Args:
        what: Name of the angles: "start", for which the error mentions `plan_recovery`, or another one.
        q: Joint angles, shape (n,), [rad].
        limits: Of each joint.

    Raises:
        PlanningError: One is not.
    """
    outside = np.flatnonzero(~((limits.lower < q) & (q < limits.upper)))
    if outside.size:
        i = int(outside[0])
        angle, low, high = float(q[i]), float(limits.lower[i]), float(limits.upper[i])
        facts = {"joint": i + 1, "angle": angle, "low": low, "high": high}
        said = (
            f"joint {i + 1}: {what} {angle_text(angle)} is not strictly between {angle_text(low)} and "
            f"{angle_text(high)}; "
        )
        soft, back = limits.exceeded_soft_limit(i + 1, angle), "plan_recovery(model, q) moves back inside"
        if soft is None and what == "start":
            raise PlanningError(f"{said}where the arm is there, {back}").coded("range_start", **facts)
        if soft is None:
            raise PlanningError(f"{said}choose an angle between them").coded("range", **facts)
        said += f"{degrees(soft):.2f}° is the soft limit that was set; "
        facts["limit"] = soft
        widen = "widen the soft limit"
        if what == "start":
            raise PlanningError(f"{said}where the arm is there, {back}, or {widen}").coded("range_start_soft", **facts)
        raise PlanningError(f"{said}choose an angle between them, or {widen}").coded("range_soft", **facts)


def limit_passed(limits: JointLimits, joint: int, angle: float, advice: str) -> PlanningError:
    """Returns the error that says which bound a way of the tool passes: the joint's own, or the soft limit set there.

    Args:
        limits: Of each joint.
        joint: Which one, counted from 1.
        angle: Where it would be, [rad].
        advice: What helps, for people.
    """
    said, facts = _crossed("pass", limits, joint, angle)
    error = PlanningError(f"{said}; {advice}")
    return error.coded("path_limit_soft", **facts) if "limit" in facts else error.coded("path_limit", **facts)


def limit_touched(limits: JointLimits, joint: int, angle: float, advice: str = "") -> PlanningError:
    """Returns the error that says which bound a planned motion touches; see `limit_passed`."""
    said, facts = _crossed("touch", limits, joint, angle)
    error = PlanningError(f"{said}; {advice}" if advice else said)
    return error.coded("touches_soft", **facts) if "limit" in facts else error.coded("touches", **facts)


def _crossed(verb: str, limits: JointLimits, joint: int, angle: float) -> tuple[str, dict[str, float]]:
    """Returns which bound is crossed and where, in words and as facts: with a limit where a soft one was set."""
    low, high = float(limits.lower[joint - 1]), float(limits.upper[joint - 1])
    facts: dict[str, float] = {"joint": joint, "angle": angle, "low": low, "high": high}
    soft = limits.exceeded_soft_limit(joint, angle)
    if soft is None:
        what = f"joint {joint} would {verb} its limit at {degrees(angle):.2f} deg"
        return f"{what} ({degrees(low):.0f} to {degrees(high):.0f} deg)", facts
    what = f"joint {joint} would {verb} the soft limit of {degrees(soft):.2f} deg that was set, at "
    return f"{what}{degrees(angle):.2f} deg; widen it", facts | {"limit": soft}


def range_from(limits: JointLimits, q: JointVector, most: float = inf) -> JointLimits:
    """Returns the limits of a motion that starts at `q`: a joint that starts outside may only move inwards.

    Args:
        limits: Of each joint.
        q: Where the arm is, shape (n,), [rad].
        most: How far outside a joint may be for this, [rad]; the range of one that is farther out stays.
    """
    beyond = np.maximum(limits.lower - q, q - limits.upper)
    if (beyond < 0.0).all():
        return limits
    is_near = beyond <= most
    lower = np.where(is_near, np.minimum(limits.lower, q - _ROUNDING), limits.lower)
    upper = np.where(is_near, np.maximum(limits.upper, q + _ROUNDING), limits.upper)
    return replace(limits, lower=readonly_copy(lower), upper=readonly_copy(upper))


def angle_text(value: float) -> str:
    """Returns an angle, [rad], for an error: in degrees and radians."""
    return f"{degrees(value):.2f}° ({value:.4f} rad)"
