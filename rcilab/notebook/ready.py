"""Whether the plan may be executed now, and if not, why: one answer for the button and for the act."""

from __future__ import annotations

from rcilab.notebook.state import LabState
from rcilab.posing.readiness import arm_obstacle, plan_obstacle
from rcilab.words.text import Message, message


def obstacle(state: LabState) -> Message | None:
    """Returns what stands in the way of Execute, or None when it may be pressed."""
    status = state.status
    if status is None:
        return message("ready.closed")
    return arm_obstacle(status.phase, status.powered) or plan_obstacle(state.plan, status.q_c)
