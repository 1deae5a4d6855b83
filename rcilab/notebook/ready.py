"""Whether the plan may be executed now, and if not, why; and what a robot is about to do."""

from __future__ import annotations

import numpy as np

from rcilab.notebook.state import LabState
from rcilab.words.text import Message, message

_SAME_PLACE = 1e-9  # [rad] What the checker allows between the arm and the start of a motion.
_NOT_IDLE = {
    "starting": "ready.starting",
    "connecting": "ready.starting",
    "moving": "ready.moving",
    "stopping": "ready.moving",
    "fault": "ready.fault",
    "lost": "ready.lost",
    "crashed": "ready.lost",
    "closed": "ready.closed",
}


def obstacle(state: LabState) -> Message | None:
    """Returns what stands in the way of Execute, or None when it may be pressed."""
    status, plan = state.status, state.plan
    if status is None:
        return message("ready.closed")
    if status.phase in _NOT_IDLE:
        return message(_NOT_IDLE[status.phase])
    if not status.powered:
        return message("ready.power")
    if plan is None:
        return message("ready.no_plan")
    if not plan.report.ok:
        return message("ready.violations", count=len(plan.report.violations))
    if status.q_c is None or float(np.abs(status.q_c - plan.starts_at).max()) > _SAME_PLACE:
        return message("ready.elsewhere")
    return None


def describe_move(state: LabState, address: str) -> Message:
    """Returns what a robot is about to do, as the question before it does."""
    plan = state.plan
    assert plan is not None  # Without one there is an obstacle.
    travel = np.degrees(np.abs(plan.motion.goal - plan.motion.start))
    joint = int(travel.argmax())
    return message(
        "run.ask",
        model=state.model.name,
        address=address,
        duration=f"{plan.motion.duration:.2f}",
        joint=joint + 1,
        angle=f"{travel[joint]:.1f}",
        mm=f"{1000.0 * float(np.linalg.norm(plan.path[-1] - plan.path[0])):.0f}",
    )
