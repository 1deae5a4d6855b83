"""The check of a change of the speed override: the new rows, by the conditions of the mode they run in."""

from __future__ import annotations

import numpy as np

from rcilab.conformance.check import check
from rcilab.conformance.report import Violation
from rcilab.conformance.start import StartState
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.state import Mode
from rcilab.model.robot_model import RobotModel
from rcilab.motion.motion import Motion
from rcilab.motion.speed_scaling import (
    SpeedScaledMotion,
    change_speed_override,
    require_speed_override,
    start_with_override,
)

_ATTEMPTS = 12  # Candidates that are checked in full, which bounds the time of a change.
_PAST = 3  # Rows that the differences of a row reach back to.


def plan_start(motion: Motion, speed_override: float, model: RobotModel, mode: Mode) -> SpeedScaledMotion:
    """Returns a motion that runs with a speed override from its first row on, checked by the conditions of its mode.

    The path is the one that was checked, so safety box and distances need no other check; at 1 nothing does.

    Args:
        motion: The motion, checked as planned.
        speed_override: `MIN_SPEED_OVERRIDE` to 1.
        model: The arm, with its tool and load.
        mode: How it is commanded.

    Raises:
        InvalidValueError: The override is out of range.
        PlanningError: At this speed it breaks a condition that it keeps as planned, as torques that hold the arm may.
    """
    paced = start_with_override(motion, require_speed_override(speed_override))
    if not paced.changed:
        return paced
    broken = _violations(paced, model, mode)
    if broken:
        raise PlanningError(
            f"at {100 * speed_override:.0f} % of its speed this motion would break a condition "
            f"({broken[0].condition.id} at "
            f"t = {broken[0].time:.3f} s) that it keeps as planned; choose another speed override"
        ).coded(
            "pace_breaks",
            speed_override=f"{100 * speed_override:.0f}",
            id=broken[0].condition.id,
            time=f"{broken[0].time:.3f}",
        )
    return paced


def plan_speed_override(
    paced: SpeedScaledMotion, cycle: int, speed_override: float, model: RobotModel, mode: Mode
) -> SpeedScaledMotion:
    """Returns the motion that continues with another speed override from a cycle on, once all conditions allow it.

    The path stays the one that was checked, so safety box and distances need no other check. The override that it has
    already changes nothing.

    Args:
        paced: The motion as it runs so far.
        cycle: The first row that may differ.
        speed_override: From 0, to be held, to 1.
        model: The arm, with its tool and load.
        mode: How it is commanded.

    Raises:
        PlanningError: There is no such change from there: the motion arrives before, or uses all of a limit until then.
    """
    for _, candidate in zip(
        range(_ATTEMPTS), change_speed_override(paced, cycle, speed_override, model.limits.joint), strict=False
    ):
        if not _violations(candidate, model, mode):
            return candidate
    raise PlanningError(
        f"at t = {paced.plan_time_at(cycle):.2f} s of {paced.motion.duration:.2f} s of the plan no change to "
        f"{100 * speed_override:.0f} % of its speed is possible within the limits; the motion continues "
        "unchanged, and stop() always works"
    ).coded("no_way_to_pace", speed_override=f"{100 * speed_override:.0f}")


def _violations(candidate: SpeedScaledMotion, model: RobotModel, mode: Mode) -> list[Violation]:
    """Returns what the rows from the change on would break."""
    first = candidate.changed - 1
    rows = candidate.q[first:]
    if first < _PAST:
        rows, start = candidate.q, None
    else:
        start = _state(candidate.q[first - _PAST : first + 1])
    report = check(Motion.from_cycles(rows), model, start=start, distance=None, mode=mode)
    return list(report.violations)


def _state(q: Array) -> StartState:
    h = CYCLE_TIME
    return StartState(q[-1], (q[-1] - q[-2]) / h, np.diff(q, n=2, axis=0)[-1] / h**2)
