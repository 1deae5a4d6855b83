"""Whether the planned motion may be executed now, and if not, why: one answer for the button and for the act."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rcilab.workbench.run.driving import control_obstacle
from rcilab.workbench.setup.wanted import name_parts, setup_obstacle
from rcilab.workbench.store import UiState
from rcilab.workbench.telling import tell_status
from rcilab.workbench.text import Message, message

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus

_SAME_PLACE = 1e-9  # [rad] What the checker allows between the arm and the start of a motion.

_NOT_IDLE = {
    "starting": "ready.starting",
    "connecting": "ready.starting",
    "moving": "ready.moving",
    "stopping": "ready.moving",
    "fault": "ready.fault",
    "lost": "ready.lost",
    "closed": "ready.closed",
}


def obstacle(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns what stands in the way of Execute, or None when it may be pressed."""
    if state.busy is not None:
        return message("ready.busy")
    if status.code == "moving.guided":
        return message("ready.guided")
    if status.code == "moving.held":
        return message("ready.held")
    if status.phase == "crashed" or (status.phase == "lost" and state.target == "virtual"):
        return tell_status(status)
    if status.phase in _NOT_IDLE:
        return message(_NOT_IDLE[status.phase])
    if not status.powered:
        return message("ready.power")
    if state.plan is None:
        return message("ready.no_plan")
    program = state.program
    if state.plan.program is not None and program.planned is not program.draft:
        return message("ready.program")
    if state.plan.program is not None and not program.draft.has_tool_of(state.model):
        return message("ready.program_tool")
    stale = state.plan.stale_parts(state.model, state.setup.wanted.box)
    if stale:
        return message("ready.stale", what=name_parts(stale))
    unset = setup_obstacle(state, status)
    if unset is not None:
        return unset
    untold = control_obstacle(state, status)
    if untold is not None:
        return untold
    if not state.plan.report.ok:
        return message("ready.violations", count=len(state.plan.report.violations))
    if status.q_c is None or float(np.abs(status.q_c - state.plan.starts_at).max()) > _SAME_PLACE:
        return message("ready.elsewhere")
    return None


def describe_move(state: UiState) -> Message | None:
    """Returns what a foreign robot is about to do and waits for a second yes to, or None when nothing waits."""
    plan = state.plan
    if plan is None or state.asked is not plan.motion:
        return None
    travel = np.degrees(np.abs(plan.motion.goal - plan.motion.start))
    joint = int(travel.argmax())
    return message(
        "run.ask",
        model=state.model.name,
        address=state.target,
        duration=f"{plan.motion.duration:.2f}",
        joint=joint + 1,
        angle=f"{travel[joint]:.1f}",
        mm=f"{1000.0 * float(np.linalg.norm(plan.path[-1] - plan.path[0])):.0f}",
    )


def is_moving(status: SupervisorStatus) -> bool:
    """Returns whether the arm is being moved by us."""
    return status.phase in ("moving", "stopping")
