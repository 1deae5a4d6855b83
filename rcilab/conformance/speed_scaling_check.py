"""Check of a change of the speed override: the new rows, by the conditions of their mode."""

from __future__ import annotations

import numpy as np

from rcilab.conformance.check import check_speed_change
from rcilab.conformance.report import Violation
from rcilab.conformance.start import StartState
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.state import Mode
from rcilab.model.robot_model import RobotModel
from rcilab.motion.motion import Motion
from rcilab.motion.speed_scaling import (
    PREVIOUS_ROWS,
    SpeedScaledMotion,
    change_speed_override,
    require_speed_override,
    start_with_override,
)

_ATTEMPTS = 12  # Number of candidates that are fully checked; it bounds the computing time.


def plan_start_with_override(motion: Motion, speed_override: float, model: RobotModel, mode: Mode) -> SpeedScaledMotion:
    """Returns a motion with a speed override from its first row on, checked by the conditions of its mode.

    The path is already checked, so safety box and distances need no new check; at an override of 1 nothing does.

    Args:
        motion: The motion, checked as planned.
        speed_override: From `MIN_SPEED_OVERRIDE` to 1.
        model: The arm, with its tool and load.
        mode: Mode of the motion.

    Raises:
        InvalidValueError: The override is out of range.
        PlanningError: With this override it violates a condition that it satisfies as planned, such as a torque limit.
    """
    scaled = start_with_override(motion, require_speed_override(speed_override))
    if not scaled.changed:
        return scaled
    violations = _violations(scaled, model, mode)
    if violations:
        raise PlanningError(
            f"at {100 * speed_override:.0f} % of its speed this motion would violate a condition "
            f"({violations[0].condition.id} at "
            f"t = {violations[0].time:.3f} s) that it satisfies as planned; use another speed override"
        ).coded(
            "override_violates",
            speed_override=f"{100 * speed_override:.0f}",
            id=violations[0].condition.id,
            time=f"{violations[0].time:.3f}",
        )
    return scaled


def plan_speed_override(
    scaled: SpeedScaledMotion, cycle: int, speed_override: float, model: RobotModel, mode: Mode
) -> SpeedScaledMotion:
    """Returns the motion with another speed override, from the first cycle on at which all conditions allow it.

    The path is already checked, so safety box and distances need no new check. The current override has no effect.

    Args:
        scaled: The current motion.
        cycle: Index of the first row that may change.
        speed_override: From 0 (held) to 1.
        model: The arm, with its tool and load.
        mode: Mode of the motion.

    Raises:
        PlanningError: No change is possible: the motion ends before, or uses a limit in full until then.
    """
    for _, candidate in zip(
        range(_ATTEMPTS), change_speed_override(scaled, cycle, speed_override, model.limits.joint), strict=False
    ):
        if not _violations(candidate, model, mode):
            return candidate
    raise PlanningError(
        f"at t = {scaled.plan_time_at(cycle):.2f} s of {scaled.motion.duration:.2f} s of the plan no change to "
        f"{100 * speed_override:.0f} % of its speed is possible within the limits; the motion continues "
        "unchanged, and stop() always works"
    ).coded("override_impossible", speed_override=f"{100 * speed_override:.0f}")


def _violations(candidate: SpeedScaledMotion, model: RobotModel, mode: Mode) -> list[Violation]:
    """Returns the violations in the rows from the change on."""
    first = candidate.changed - 1
    rows = candidate.q[first:]
    if first < PREVIOUS_ROWS:
        rows, start = candidate.q, None
    else:
        start = _state(candidate.q[first - PREVIOUS_ROWS : first + 1])
    report = check_speed_change(Motion.from_cycles(rows), model, start=start, mode=mode)
    return list(report.violations)


def _state(q: Array) -> StartState:
    h = CYCLE_TIME
    return StartState(q[-1], (q[-1] - q[-2]) / h, np.diff(q, n=2, axis=0)[-1] / h**2)
