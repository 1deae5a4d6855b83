"""Joint ranges and limit margin of planned motions."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, inf, radians

import numpy as np

from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits

LIMIT_MARGIN = 0.999
"""Part of each velocity, acceleration and jerk limit that a planned motion uses.

Tuning value. The manual's conditions are strict, and a time-optimal curve runs on its bounds: its backward differences
at 1 ms are means of the derivative, so they reach the bound itself. Rounding of angles to doubles adds 4e-6 rad/s^3 to
a third difference. One part in a thousand covers both, and a start that is 1 nrad off, and costs 0.1 % of the time. It
is not a margin for lost packets; the streaming client adds that.
"""

RECOVERY_RANGE = radians(20.0)
"""Largest distance of a joint from its range at which a recovery may start, [rad]. The arms stop within 18 degrees from
full speed, so a larger distance is not caused by a late stop."""
_BACK = "plan_recovery(model, q) moves back inside (in a shell: rcilab run --to-start)"
_ROUNDING = 1e-6  # [rad] Widening that covers rounding at the start.


def require_inside(what: str, q: JointVector, limits: JointLimits) -> None:
    """Requires joint angles to be strictly inside their limits.

    Args:
        what: Name of the angles for the error; for "start" the error mentions `plan_recovery`.
        q: Joint angles, shape (n,), [rad].
        limits: Limits of the joints.

    Raises:
        PlanningError: A joint is not inside.
    """
    outside = np.flatnonzero(~((limits.lower < q) & (q < limits.upper)))
    if outside.size:
        i = int(outside[0])
        angle, low, high = float(q[i]), float(limits.lower[i]), float(limits.upper[i])
        facts = {"joint": i + 1, "angle": angle, "low": low, "high": high}
        message = (
            f"joint {i + 1}: {what} {angle_text(angle)} is not strictly between {angle_text(low)} and "
            f"{angle_text(high)}; "
        )
        soft = limits.exceeded_soft_limit(i + 1, angle)
        if soft is None and what == "start":
            raise PlanningError(f"{message}if the arm is there, {_BACK}").coded("range_start", **facts)
        if soft is None:
            raise PlanningError(f"{message}choose an angle between them").coded("range", **facts)
        message += f"{degrees(soft):.2f}° is the soft limit that was set; "
        facts["limit"] = soft
        widen = "widen the soft limit"
        if what == "start":
            raise PlanningError(f"{message}if the arm is there, {_BACK}, or {widen}").coded("range_start_soft", **facts)
        raise PlanningError(f"{message}choose an angle between them, or {widen}").coded("range_soft", **facts)


def limit_passed(limits: JointLimits, joint: int, angle: float, advice: str) -> PlanningError:
    """Returns the error for a tool path that would pass a joint's range: its own limit, or a soft limit.

    Args:
        limits: Limits of the joints.
        joint: Number of the joint, from 1.
        angle: Angle outside its range, [rad].
        advice: Remedy, for the message.
    """
    message, facts = _describe_crossing("pass", limits, joint, angle)
    error = PlanningError(f"{message}; {advice}")
    return error.coded("path_limit_soft", **facts) if "limit" in facts else error.coded("path_limit", **facts)


def limit_touched(limits: JointLimits, joint: int, angle: float, advice: str = "") -> PlanningError:
    """Returns the error for a planned motion that touches a bound; see `limit_passed`."""
    message, facts = _describe_crossing("touch", limits, joint, angle)
    error = PlanningError(f"{message}; {advice}" if advice else message)
    return error.coded("touches_soft", **facts) if "limit" in facts else error.coded("touches", **facts)


def _describe_crossing(verb: str, limits: JointLimits, joint: int, angle: float) -> tuple[str, dict[str, float]]:
    """Returns the message and the facts of a crossed bound; the facts have "limit" for a soft limit."""
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
        limits: Limits of the joints.
        q: Joint angles at the start, shape (n,), [rad].
        most: Largest distance outside, [rad]; the range of a joint farther outside is not widened.
    """
    beyond = np.maximum(limits.lower - q, q - limits.upper)
    if (beyond < 0.0).all():
        return limits
    is_near = beyond <= most
    lower = np.where(is_near, np.minimum(limits.lower, q - _ROUNDING), limits.lower)
    upper = np.where(is_near, np.maximum(limits.upper, q + _ROUNDING), limits.upper)
    return replace(limits, lower=readonly_copy(lower), upper=readonly_copy(upper))


def angle_text(value: float) -> str:
    """Returns an angle, [rad], as text in degrees and radians."""
    return f"{degrees(value):.2f}° ({value:.4f} rad)"
