"""A run as a table: recording, plan and error, one row per cycle, with units."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import Column, cycle_columns, split_columns
from rcilab.recording.run_file import report_facts

if TYPE_CHECKING:
    from rcilab.recording.run import Run


def run_columns(run: Run) -> list[Column]:
    """Returns the numbers of a run as columns: the recording, then plan and error.

    q_plan[j] is the planned angle at the instant of the measurement, corrected for the play-out delay. error[j] is
    measured minus planned (minus commanded, without a plan), nan from `run.stop_time` on. tool_error and tool_turn are
    the distance and the angle of the tool from its planned pose.
    """
    columns = cycle_columns(run.cycles)
    if run.plan is not None:
        columns += split_columns("q_plan", "rad", run.planned)
    tracking = run.tracking
    columns += split_columns("error", "rad", tracking.joint)
    columns.append(Column("tool_error", "m", tracking.position))
    columns.append(Column("tool_turn", "rad", tracking.rotation))
    return columns


def run_facts(run: Run) -> dict[str, Any]:
    """Returns a run without its cycles as JSON data: arm, configuration, end, errors, health, check result."""
    timing, tracking, report = run.timing, run.tracking, run.report
    return {
        "arm": None if run.model is None else run.model.name,
        **run.setup.as_dict(),
        "started": run.setup.started,
        "duration_s": run.duration,
        "cycles": len(run.cycles),
        "stopped": run.stopped,
        "stop_time_s": run.stop_time,
        "paced": run.has_speed_override,
        "truncated": run.truncated,
        "complete": run.is_complete,
        "faults": [fault.manual_name for fault in run.faults],
        "delay_s": CYCLE_TIME * run.delay,
        "error_rms_rad": tracking.joint_rms.tolist(),
        "error_max_rad": tracking.joint_max.tolist(),
        "tool_error_rms_m": tracking.position_rms,
        "tool_error_max_m": tracking.position_max,
        "lost_cycles": timing.lost,
        "late_cycles": timing.late if run.realtime else None,
        "lateness_p99_s": timing.lateness_p99 if run.realtime else None,
        "conforms": None if report is None else report.ok,
        "report": None if report is None else report_facts(report),
    }


def facts_text(run: Run) -> str:
    """Returns `run_facts` as JSON."""
    return json.dumps(run_facts(run), ensure_ascii=False)
