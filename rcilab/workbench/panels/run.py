"""Run: where to, power, Execute, Recover, and what the controller says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.workbench import requests
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.run.pushing import PLANTS
from rcilab.workbench.run.readiness import describe_move, is_moving, obstacle
from rcilab.workbench.telling import phase_code, tell_status
from rcilab.workbench.text import Text
from rcilab.workbench.widgets import Ask, Html, Linked, esc, on_press

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState


_BUTTONS: tuple[tuple[Any, Any, Any], ...] = (
    ("recover", "first-aid-kit", "orange"),
    ("power_on", "power", "blue"),
    ("power_off", "plug-connected-x", "gray"),
)


class RunPanel:
    """Execute can be pressed only when a fresh certificate says so; otherwise the reason stands beside it."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._planned = Html(gui)
        self._execute = gui.add_button(text("run.execute"), color=(23, 128, 68), icon="player-play", disabled=True)
        on_press(self._execute, ask, lambda page: requests.Drive(page=page, what="execute"))
        self._question = Html(gui)
        self._agree = gui.add_button(text("run.confirm"), color="red", icon="player-play", visible=False)
        on_press(self._agree, ask, _drive("confirm"))
        self._cancel = gui.add_button(text("run.cancel"), color="gray", visible=False)
        on_press(self._cancel, ask, _drive("cancel"))
        self._reason = Html(gui)
        self._buttons: dict[str, Any] = {}
        with gui.add_folder(text("run.robot")):
            gui.add_html('<i class="rl-buttons"></i>')
            self._plan = gui.add_button(text("run.plan"), icon="route", color="gray", hint=text("target.plan_hint"))
            on_press(self._plan, ask, lambda page: requests.Plan(page=page))
            for what, icon, color in _BUTTONS:
                button = gui.add_button(text(f"run.{what}"), icon=icon, color=color, hint=text(f"run.{what}_hint"))
                on_press(button, ask, _drive(what))
                self._buttons[what] = button
            self._faults = Html(gui)
        with gui.add_folder(text("run.where")):
            self._where = Html(gui)
            typed = state.target if state.target != "virtual" else ""
            self._address = gui.add_text(text("run.address"), typed, hint=text("run.address_hint"))
            connect = gui.add_button(text("run.connect"), icon="plug-connected", color="gray")
            on_press(connect, ask, lambda page: requests.ChooseRobot(page=page, target=self._address.value))
            virtual = gui.add_button(
                text("run.virtual"), icon="device-desktop", color="gray", hint=text("run.virtual_hint")
            )
            on_press(virtual, ask, lambda page: requests.ChooseRobot(page=page, target="virtual"))
            plants = {text(f"plant.{plant}"): plant for plant in PLANTS}
            self._plants = {plant: label for label, plant in plants.items()}
            chosen = self._plants[state.plant]
            plant = gui.add_dropdown(text("plant.title"), tuple(plants), initial_value=chosen, hint=text("plant.hint"))
            self._plant = Linked(plant, ask, lambda v, p: requests.ChooseRobot(page=p, plant=plants.get(v)))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the robot."""
        text, reason, moving = self._text, obstacle(state, status), is_moving(status)
        self._planned.show(planned_html(state, text))
        self._execute.disabled = reason is not None
        question = None if reason is not None else describe_move(state)
        said = "" if question is None else esc(text.say(question))
        self._question.show(said and f'<p class="rl-verdict rl-warn" role="alert">{said}</p>')
        self._execute.visible = question is None
        self._agree.visible = self._cancel.visible = question is not None
        self._reason.show("" if reason is None else f'<p class="rl-note rl-why">{esc(text.say(reason))}</p>')
        self._plan.disabled = moving
        self._buttons["recover"].disabled = status.phase not in ("fault", "crashed", "lost")
        self._buttons["power_on"].disabled = moving or status.powered is not False
        self._buttons["power_off"].disabled = moving or status.powered is not True
        tone = {"idle": "good", "moving": "good", "stopping": "warn", "starting": "warn", "connecting": "warn"}.get(
            status.phase, "bad"
        )
        self._plant.show(self._plants[state.plant])
        self._plant.handle.disabled = moving or state.target != "virtual"
        where = text(f"where.{state.plant}") if state.target == "virtual" else state.target
        address = f'<br><span class="rl-dim">{esc(status.address)}</span>' if status.address else ""
        self._where.show(
            f'<p class="rl-verdict rl-{tone}"><b>{esc(where)}</b> {esc(text(phase_code(status)))}{address}</p>'
            + (f'<p class="rl-note">{esc(text.say(tell_status(status)))}</p>' if tone == "bad" else "")
        )
        self._faults.show(faults_html(status, text))


def _drive(what: Any):  # type: ignore[no-untyped-def]
    return lambda page: requests.Drive(page=page, what=what)


def faults_html(status: SupervisorStatus, text: Text) -> str:
    """Returns every fault that is set, with its cause and what to do about it."""
    if not status.faults:
        return f'<p class="rl-verdict rl-good"><b>{esc(text("run.no_faults"))}</b></p>'
    return "".join(
        f'<div class="rl-card rl-bad"><div class="rl-line"><b>{esc(fault.manual_name)}</b></div>'
        f'<div class="rl-facts">{esc(text(f"fault.{fault.name}"))}</div>'
        f'<div class="rl-source">{esc(text("run.remedy"))} {esc(_remedy(fault, text))}</div></div>'
        for fault in status.faults
    )


def _remedy(fault: Any, text: Text) -> str:
    key = f"remedy.{fault.name}"
    return text(key) if text.has(key) else text("remedy.smoothness")
