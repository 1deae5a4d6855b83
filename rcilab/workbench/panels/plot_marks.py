"""Marks on the time axis of the plots: the end of each waypoint of a program, and the fault that ended a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.program.program_draft import waypoint_times
from rcilab.app.run.played_motion import played_at
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import name_faults

if TYPE_CHECKING:
    from rcilab.app.store import UiState

_CLOSEST = 0.05  # Of the time axis, between two marks: a number of two digits has room at the least width of a plot.


def plot_marks(state: UiState, end: float) -> list[dict[str, Any]]:
    """Returns the marks, in the order of their times: position as a share of the time axis, label, whether a fault.

    Of waypoints that are crowded, the first one is marked.

    Args:
        state: State of the page.
        end: End of the time axis, [s].
    """
    marks: list[dict[str, Any]] = []
    plan, recording = state.plan, state.recording
    last = -1.0
    for number, moment in () if plan is None else waypoint_times(plan):
        share = played_at(state, moment) / end
        if share - last >= _CLOSEST and share <= 1.0:
            marks.append({"share": round(share, 4), "label": str(number), "fault": False})
            last = share
    if recording is not None and recording.moment is not None and recording.run is not None:
        share = (recording.moment - recording.delay * CYCLE_TIME) / end
        label = name_faults(recording.run.faults)
        marks.append({"share": round(min(max(share, 0.0), 1.0), 4), "label": label, "fault": True})
    return marks
