"""Whether the planned motion may be executed now, and if not, why: one answer for the button and for the act."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.app.arm_features import is_only_planned, tell_lack, tell_lack_to_run
from rcilab.app.check.freshness import outdated
from rcilab.app.planning import find_outside
from rcilab.app.run.drive_state import destination, parameter_obstacle
from rcilab.app.run.plan_readiness import arm_obstacle, ask_to_move, is_moving, plan_obstacle
from rcilab.app.setup.configuration_state import setup_obstacle, tool_outside
from rcilab.app.status_text import tell_status
from rcilab.app.store import UiState
from rcilab.i18n.translator import Message, message

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus

_OF_PROGRAMS = {"ready.done": "ready.done_program", "ready.elsewhere": "ready.elsewhere_program"}


def obstacle(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns what stands in the way of Execute, or None when it may be pressed."""
    if state.busy is not None:
        return message("ready.busy")
    lack = tell_lack_to_run(state.model, is_virtual=state.target == "virtual")
    lack = tell_lack(state.model, state.drive.mode) if lack is None else lack
    if lack is not None:
        return lack
    if status.code == "moving.guided":
        return message("ready.guided")
    if status.code == "moving.held":
        return message("ready.held")
    if status.phase == "crashed" or (status.phase == "lost" and state.target == "virtual"):
        return tell_status(status)
    is_released = status.code == "fault.released"
    resting = arm_obstacle(status.phase, status.powered, is_pressed=status.is_pressed, is_released=is_released)
    if resting is not None:
        return resting
    if state.plan is None:
        return plan_obstacle(None, status.q_c)
    changed = outdated(state)
    if changed is not None:
        return changed
    unset = setup_obstacle(state, status)
    if unset is not None:
        return unset
    untold = parameter_obstacle(state, status)
    if untold is not None:
        return untold
    reason = plan_obstacle(state.plan, status.q_c)
    if reason is not None and reason.code == "ready.violations":
        # From outside a motion may lead into the box; one that does not is refused for that.
        reason = tool_outside(state, state.plan.path[0]) or reason
    if reason is None or state.plan.program is None or reason.code not in _OF_PROGRAMS:
        return reason
    return message(_OF_PROGRAMS[reason.code])


def may_plan_again(reason: Message | None) -> bool:
    """Returns whether planning the program anew is what this obstacle asks for."""
    return reason is not None and reason.code in ("ready.program", "ready.program_fails", *_OF_PROGRAMS.values())


def may_go_back(state: UiState, reason: Message | None) -> bool:
    """Returns whether the plan has been carried out, and its start is a place to go to again."""
    is_done = reason is not None and reason.code in ("ready.done", _OF_PROGRAMS["ready.done"])
    return is_done and state.plan is not None and find_outside(state.model, state.plan.starts_at) is None


def may_lead_inside(state: UiState, status: SupervisorStatus) -> bool:
    """Returns whether the arm stands outside a joint's range, so that no plan but the way back inside starts there."""
    return status.q_c is not None and not is_moving(status) and find_outside(state.model, status.q_c) is not None


def describe_move(state: UiState) -> Message | None:
    """Returns what a foreign robot is about to do and waits for a second yes to, or None when nothing waits."""
    plan = state.plan
    if plan is None or state.asked is not plan.motion:
        return None
    return ask_to_move(plan, state.target)


def time_shown(state: UiState, status: SupervisorStatus) -> float:
    """Returns where in the plan's time, [s], scrubber and cursor stand: where the arm is while it moves along it."""
    if is_moving(status) and status.motion_plan_time is not None:
        return status.motion_plan_time
    return 0.0 if state.plan is None else state.place * state.plan.motion.duration


def is_connected(status: SupervisorStatus) -> bool:
    """Returns whether a robot reports where it is."""
    return status.q is not None and status.phase not in ("closed", "lost", "crashed")


def is_plan_current(state: UiState, status: SupervisorStatus) -> bool:
    """Returns whether a verdict on the plan holds now: an arm is connected, or this one is only ever planned for."""
    return is_connected(status) or is_only_planned(state.model)


def connection_note(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns what is said beside the destination, at the top of Run: why nothing can be run there; None: nothing."""
    lack = tell_lack_to_run(state.model, is_virtual=state.target == "virtual")
    if status.phase in ("fault", "lost", "crashed"):
        return tell_status(status)
    return message("destination.note") if lack is None and destination(state, status) == "preview" else lack
