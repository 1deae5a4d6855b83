"""Reports and runs as JSON, for `rcilab check --json` and `rcilab run --json`. SI units; null for NaN and infinity."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from rcilab.cli.output import one_line_each
from rcilab.core.errors import ControlError, RcilabError
from rcilab.i18n.translator import Remark

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report, Violation
    from rcilab.motion import Motion
    from rcilab.recording.run import Run


def motion_as_json(motion: Motion) -> dict[str, Any]:
    """Returns the duration of a motion, [s], and the notes of its planner."""
    return {"duration": motion.duration, "notes": [str(note) for note in motion.notes]}


def report_as_json(report: Report) -> dict[str, Any]:
    """Returns the result of a check, every condition with its worst value, and violations and warnings as sentences."""
    return {
        "ok": report.ok,
        "title": str(report.title),
        "motion": motion_as_json(report.motion),
        "conditions": [_condition(row) for row in report.rows],
        "violations": [_violation(violation) for violation in report.violations],
        "warnings": [_violation(violation) for violation in report.warnings],
    }


def run_as_json(run: Run) -> dict[str, Any]:
    """Returns duration, [s], reason of the stop or null, largest joint error and, at the goal, joint errors, [rad]."""
    goal_error = run.goal_error
    return {
        "duration": _finite(run.duration),
        "stopped": run.stopped,
        "largest_error": _finite(run.largest_error),
        "goal_error": None if goal_error is None else [_finite(value) for value in goal_error],
    }


def error_as_json(error: RcilabError) -> dict[str, Any]:
    """Returns the class of an error, its message and, of a fault, the manual's names and what the cycles show."""
    faults = error.faults if isinstance(error, ControlError) else ()
    finding = error.finding if isinstance(error, ControlError) else ""
    parts = finding.parts if isinstance(finding, Remark) and finding else ()
    return {
        "type": type(error).__name__,
        "text": one_line_each(str(error)),
        "faults": [getattr(fault, "manual_name", str(fault)) for fault in faults],
        "findings": [{"text": str(part), **_facts(part)} for part in parts],
    }


def as_json_text(content: dict[str, Any]) -> str:
    """Returns one JSON object."""
    return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)


def _condition(row: ConditionResult) -> dict[str, Any]:
    return {
        "id": row.id,
        "necessity": row.necessity,
        "ok": row.ok,
        "value": _finite(row.value),
        "bound": _finite(row.bound),
        "unit": row.unit,
        "ratio": _finite(row.ratio),
        "place": row.location,
        "time": _finite(row.time),
        "source": row.source,
        "fault": None if row.fault is None else row.fault.manual_name,
    }


def _violation(violation: Violation) -> dict[str, Any]:
    return {
        "id": violation.condition.id,
        "place": violation.location,
        "time": _finite(violation.time),
        "worst_time": _finite(violation.worst_time),
        "value": _finite(violation.value),
        "bound": _finite(violation.bound),
        "unit": violation.condition.unit,
        "fault": None if violation.fault is None else violation.fault.manual_name,
        "text": str(violation),
    }


def _facts(remark: Remark) -> dict[str, Any]:
    facts: Any = remark.as_dict()["facts"]
    return {name: _finite(fact) if isinstance(fact, float) else fact for name, fact in facts.items()}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
