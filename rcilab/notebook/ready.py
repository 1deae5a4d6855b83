"""Whether the plan may be executed now, and if not, why: one answer for the button and for the act."""

from __future__ import annotations

from rcilab.app.run.drive_state import parameter_obstacle
from rcilab.app.run.plan_readiness import arm_obstacle, plan_obstacle
from rcilab.core.errors import SAFETY_STOP
from rcilab.i18n.translator import Message, message
from rcilab.notebook.state import LabState


def obstacle(state: LabState) -> Message | None:
    """Returns what stands in the way of Execute, or None when it may be pressed."""
    status = state.status
    if status is None:
        return message("ready.closed")
    if status.phase == "closed" and state.session is not None:
        return message("ready.session_closed")
    was_stop = status.phase == "fault" and state.error is not None and state.error.code == SAFETY_STOP
    is_released = status.code == "fault.released" or was_stop
    resting = arm_obstacle(status.phase, status.powered, is_pressed=status.is_pressed, is_released=is_released)
    if resting is not None or state.now.plan is None:
        return resting or plan_obstacle(None, status.q_c)
    return parameter_obstacle(state.now, status) or plan_obstacle(state.now.plan, status.q_c)
