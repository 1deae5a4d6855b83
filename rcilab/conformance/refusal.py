"""A report with a violation whose value is not in the signals of the motion: of a command that was refused."""

from __future__ import annotations

import math
from dataclasses import replace

from rcilab.conformance.advice import advise
from rcilab.conformance.catalogue import Phrase
from rcilab.conformance.report import ConditionResult, Report, Violation
from rcilab.core.condition import Condition
from rcilab.core.limits import Limits


def with_refusal(
    report: Report, condition: Condition, limits: Limits, time: float, *, joint: int = 0, reported: str = ""
) -> Report:
    """Returns a report with one more violation.

    Args:
        report: The report on the commands before the refused one.
        condition: The condition that the refused command violates.
        limits: Of the arm.
        time: Of the refused command, [s] since the start of the motion.
        joint: The joint, from 1; 0 for the tool, or where it is not known.
        reported: What the controller reported; "": the command is not a finite number.
    """
    bound = float(condition.bounds(limits)[1][max(joint - 1, 0)])
    row = ConditionResult(
        condition=condition, value=math.nan, bound=bound, ratio=math.inf, joint=joint, time=time, broken=1
    )
    advice = advise(condition, report.motion, row=len(report.motion) - 1, count=1, ratio=math.inf, is_off_start=False)
    violation = Violation(
        condition=condition,
        joint=joint,
        time=time,
        count=1,
        value=math.nan,
        worst_time=time,
        bound=bound,
        ratio=math.inf,
        advice=advice if reported else Phrase("advice.finite"),
        reported=reported,
    )
    others = tuple(result for result in report.rows if result.id != condition.id)
    is_there = len(others) < len(report.rows)
    rows = tuple(row if result.id == condition.id else result for result in report.rows)
    return replace(report, rows=rows if is_there else (*rows, row), violations=(violation, *report.violations))
