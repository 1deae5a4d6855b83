"""Whether the planned motion may be executed now, and if not, why: one function for button and request."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.app.arm_features import explain_missing_feature, explain_missing_robot, is_only_planned
from rcilab.app.check.freshness import outdated
from rcilab.app.planning import explain_outside, find_outside
from rcilab.app.run.drive_state import destination, parameter_obstacle
from rcilab.app.run.plan_readiness import arm_obstacle, ask_to_move, is_moving, plan_obstacle
from rcilab.app.setup.configuration_state import setup_obstacle, tool_outside
from rcilab.app.status_text import describe_status
from rcilab.app.store import UiState
from rcilab.i18n.translator import Message, message

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus

_OF_PROGRAMS = {
    "ready.done": "ready.done_program",
    "ready.done_elbow": "ready.done_program",
    "ready.elsewhere": "ready.elsewhere_program",
}


def obstacle(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns what prevents Execute, or None if it may be pressed."""
    if state.watched:
        return message("ready.watched", address=state.watched)
    if state.replay is not None:
        return message("ready.replay")
    if state.busy is not None:
        return message("ready.busy")
    missing = explain_missing_robot(state.model, is_virtual=state.target == "virtual")
    missing = explain_missing_feature(state.model, state.drive.mode) if missing is None else missing
    if missing is not None:
        return missing
    if status.code == "moving.guided":
        return message("ready.guided")
    if status.code == "moving.held":
        return message("ready.held")
    if status.phase == "crashed" or (status.phase == "lost" and state.target == "virtual"):
        return _describe_arm(state, status)
    is_released = status.code == "fault.released"
    resting = arm_obstacle(status.phase, status.powered, is_pressed=status.is_pressed, is_released=is_released)
    if resting is not None:
        return resting
    outside = None if status.q_c is None else explain_outside(state.model, "start", status.q_c)
    if state.plan is None:
        return outside or plan_obstacle(None, status.q_c)
    changed = outdated(state)
    if changed is not None:
        return outside or changed
    unset = setup_obstacle(state, status)
    if unset is not None:
        return unset
    obstacle = parameter_obstacle(state, status)
    if obstacle is not None:
        return obstacle
    reason = plan_obstacle(state.plan, status.q_c)
    if reason is not None and reason.code == "ready.violations":
        # From outside, a motion may lead into the box; one that does not is refused for that reason.
        reason = tool_outside(state, state.plan.path[0]) or reason
    if reason is None or state.plan.program is None or reason.code not in _OF_PROGRAMS:
        return reason
    return message(_OF_PROGRAMS[reason.code])


def may_plan_again(reason: Message | None) -> bool:
    """Returns whether planning the program again removes an obstacle."""
    return reason is not None and reason.code in ("ready.program", "ready.program_fails", *_OF_PROGRAMS.values())


def may_go_back(state: UiState, reason: Message | None) -> bool:
    """Returns whether the plan has been executed, and its start is a position to which the arm can return."""
    is_done = reason is not None and reason.code in ("ready.done", "ready.done_elbow", "ready.done_program")
    return is_done and state.plan is not None and find_outside(state.model, state.plan.starts_at) is None


def may_lead_inside(state: UiState, status: SupervisorStatus) -> bool:
    """Returns whether the arm is outside a joint's range, so that only the recovery motion can start there."""
    return status.q_c is not None and not is_moving(status) and find_outside(state.model, status.q_c) is not None


def describe_move(state: UiState) -> Message | None:
    """Returns the motion of a foreign robot that awaits a second confirmation, or None."""
    plan = state.plan
    if plan is None or state.asked is not plan.motion:
        return None
    return ask_to_move(plan, state.target)


def time_shown(state: UiState, status: SupervisorStatus) -> float:
    """Returns the time of the plan, [s], at the scrubber and cursor: that of the arm during its motion."""
    if is_moving(status) and status.motion_plan_time is not None:
        return status.motion_plan_time
    return 0.0 if state.plan is None else state.playhead * state.plan.motion.duration


def is_connected(status: SupervisorStatus) -> bool:
    """Returns whether a robot reports its position."""
    return status.q is not None and status.phase not in ("closed", "lost", "crashed")


def is_plan_current(state: UiState, status: SupervisorStatus) -> bool:
    """Returns whether the verdict on the plan is valid now: an arm is connected, or can only be planned for."""
    return is_connected(status) or is_only_planned(state.model)


def connection_note(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns the message next to the destination, at the top of Run: why no motion can run there; None: none."""
    if state.watched:
        code = "watch.gone" if status.phase == "lost" else "ready.watched"
        return message(code, address=state.watched)
    missing = explain_missing_robot(state.model, is_virtual=state.target == "virtual")
    if status.phase in ("fault", "lost", "crashed"):
        return _describe_arm(state, status)
    return message("destination.note") if missing is None and destination(state, status) == "preview" else missing


def pulled_cable(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns that the connection is lost because the operator has pulled the cable of the network lab, or None."""
    return message("incident.lost.pulled") if status.phase == "lost" and state.world.pulled else None


def _describe_arm(state: UiState, status: SupervisorStatus) -> Message:
    return pulled_cable(state, status) or describe_status(status)
