"""Run: Execute, pause, speed override, power, Recover, and the controller's faults."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.check.freshness import outdated
from rcilab.app.goal.goal_actions import PlanGoal, PlanRecovery, PoseGoal
from rcilab.app.program.program_actions import PlanProgram
from rcilab.app.run.mode_actions import SetDrive
from rcilab.app.run.readiness import (
    connection_note,
    describe_move,
    is_connected,
    is_moving,
    is_plan_current,
    may_go_back,
    may_lead_inside,
    may_plan_again,
    obstacle,
)
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.status_text import describe_remedy
from rcilab.app.text import Text
from rcilab.core.fault import name_faults
from rcilab.i18n.translator import Remark
from rcilab.makers.maker import capabilities_of
from rcilab.motion.speed_scaling import MIN_SPEED_OVERRIDE
from rcilab.sim.api import WorldStatus
from rcilab.workbench.panels.outcome import outcome_html, progress_html
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, esc_names, on_press, why_html

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


_RECOVER: tuple[tuple[Any, Any, Any], ...] = (("recover", "first-aid-kit", "orange"),)
_POWER: tuple[tuple[Any, Any, Any], ...] = (("power_on", "power", "blue"), ("power_off", "plug-connected-x", "gray"))


class RunPanel:
    """Execute needs a valid certificate; otherwise the reason is shown next to it."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._planned = Html(gui)
        speed_override = gui.add_slider(
            text("run.speed_override"),
            100.0 * MIN_SPEED_OVERRIDE,
            100.0,
            5.0,
            100.0 * state.drive.speed_override,
            hint=text("run.speed_override_hint"),
        )
        self._speed_override = BoundControl(
            speed_override, ask, lambda v, p: SetDrive(page=p, speed_override=float(v) / 100.0)
        )
        self._execute = gui.add_button(text("run.execute"), color=(23, 128, 68), icon="player-play", disabled=True)
        on_press(self._execute, ask, lambda page: RobotCommand(page=page, what="execute"))
        self._question = Html(gui)
        self._agree = gui.add_button(text("run.confirm"), color="red", icon="player-play", visible=False)
        on_press(self._agree, ask, _drive("confirm"))
        self._cancel = gui.add_button(text("run.cancel"), color="gray", visible=False)
        on_press(self._cancel, ask, _drive("cancel"))
        self._pause = gui.add_button(
            text("run.pause"), icon="player-pause", color="orange", disabled=True, hint=text("run.pause_hint")
        )
        on_press(self._pause, ask, _drive("pause"))
        self._resume = gui.add_button(text("run.resume"), icon="player-play", color="blue", visible=False)
        on_press(self._resume, ask, _drive("resume"))
        self._way, self._outcome = Html(gui), Html(gui)
        self._reason = Html(gui)
        self._again = gui.add_button(text("run.again"), icon="route", visible=False, hint=text("program.plan_hint"))
        on_press(self._again, ask, lambda page: PlanProgram(page=page))
        self._back = gui.add_button(
            text("run.back"), icon="arrow-back-up", color="gray", visible=False, hint=text("run.back_hint")
        )
        on_press(self._back, ask, lambda page: PoseGoal(page=page, name="start"))
        self._inside = gui.add_button(
            text("run.inside"), icon="arrow-bar-to-right", color="orange", visible=False, hint=text("run.inside_hint")
        )
        on_press(self._inside, ask, lambda page: PlanRecovery(page=page))
        self._buttons: dict[str, Any] = {}
        with gui.add_folder(text("run.robot")):
            gui.add_html('<i class="rl-buttons"></i>')
            self._plan = gui.add_button(text("run.plan"), icon="route", color="gray", hint=text("target.plan_hint"))
            on_press(self._plan, ask, lambda page: PlanGoal(page=page))
            self._to_target = gui.add_button(
                text("run.to_target"),
                icon="current-location",
                color="gray",
                visible=False,
                hint=text("run.to_target_hint"),
            )
            on_press(self._to_target, ask, lambda page: PlanGoal(page=page))
            has_power = capabilities_of(state.model).switches_power
            for what, icon, color in (*_RECOVER, *(_POWER if has_power else ())):
                button = gui.add_button(text(f"run.{what}"), icon=icon, color=color, hint=text(f"run.{what}_hint"))
                on_press(button, ask, _drive(what))
                self._buttons[what] = button
            self._faults = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the robot."""
        text, reason, moving = self._text, obstacle(state, status), is_moving(status)
        self._planned.show(planned_html(state, status, text) if is_plan_current(state, status) else "")
        self._execute.disabled = reason is not None
        question = None if reason is not None else describe_move(state)
        sentence = "" if question is None else esc(text.render(question))
        self._question.show(sentence and f'<p class="rl-verdict rl-warn" role="alert">{sentence}</p>')
        self._execute.visible = question is None
        self._agree.visible = self._cancel.visible = question is not None
        is_said = moving or bool(state.watched)  # The bar shows that it moves, the destination that it is watched.
        is_said |= reason in (outdated(state), connection_note(state, status))
        is_said |= reason is not None and reason.code == "ready.no_plan" and state.no_plan is not None
        unsaid = None if is_said else reason
        self._reason.show(why_html(text, unsaid))
        is_program = state.plan is not None and state.plan.program is not None
        self._again.visible = is_program and (may_plan_again(reason) or outdated(state) is not None)
        self._back.visible = may_go_back(state, reason)
        self._inside.visible = may_lead_inside(state, status) and not state.watched
        is_held = status.code == "moving.held"
        self._pause.visible, self._resume.visible = not is_held, is_held  # Visible beforehand: the layout is fixed.
        self._pause.disabled = status.code != "moving" or status.motion_plan_time is None
        self._speed_override.show(round(100.0 * state.drive.speed_override, 1))
        self._speed_override.handle.disabled = bool(state.watched)
        self._way.show(progress_html(state, status, text))
        self._outcome.show("" if moving else outcome_html(state, status, text))
        self._plan.visible, self._to_target.visible = not is_program, is_program
        is_off = moving or bool(state.watched)
        self._plan.disabled = self._to_target.disabled = is_off or not is_connected(status)
        is_held = status.is_pressed and not capabilities_of(state.model).stop_is_error
        self._buttons["recover"].disabled = is_off or status.phase != "fault" or is_held
        if "power_on" in self._buttons:
            self._buttons["power_on"].disabled = is_off or status.powered is not False or status.is_pressed
            self._buttons["power_off"].disabled = is_off or status.powered is not True
        self._faults.show(faults_html(status, text, state.world.status))


def _drive(what: Any):  # type: ignore[no-untyped-def]
    return lambda page: RobotCommand(page=page, what=what)


def faults_html(status: SupervisorStatus, text: Text, world: WorldStatus | None) -> str:
    """Returns every fault that is set, with its cause and remedy; nothing without a fault."""
    was_stop = world is not None and isinstance(world.reason, Remark) and world.reason.code in ("estop", "gstop")
    if (
        status.is_pressed or was_stop or status.code == "fault.released"
    ):  # A safety stop sets one of several bits, whose usual texts would mislead.
        names = esc_names(name_faults(status.faults))
        sentence = (
            f'<div class="rl-facts">{esc(text("fault.by_stop" if status.is_pressed else "fault.was_stop"))}</div>'
        )
        return names and f'<div class="rl-card rl-bad"><div class="rl-line"><b>{names}</b></div>{sentence}</div>'
    return "".join(
        f'<div class="rl-card rl-bad"><div class="rl-line"><b>{esc_names(fault.manual_name)}</b></div>'
        f'<div class="rl-facts">{esc(text(f"fault.{fault.key}"))}</div>'
        f'<div class="rl-source">{esc(describe_remedy(fault, text))}</div></div>'
        for fault in status.faults
    )
