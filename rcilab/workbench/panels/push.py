"""Push: a force on a link as long as a button is held, and hand guiding, in which the arm follows it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.arm_features import explain_missing_feature
from rcilab.app.run.active_force import (
    DIRECTIONS,
    GUIDING_KINDS,
    SPRING,
    STRONGEST,
    TOOL,
    can_grab,
    gives_way,
    is_guided,
    no_push,
)
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.push_actions import HoldPush, SetPush
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.text import Text
from rcilab.i18n.rounding import format_fixed
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_HOLD_RATE = 10.0  # [1/s] Rate of messages of a held button.


class PushPanel:
    """A group of the Run tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        self._has_guiding = explain_missing_feature(state.model, "guiding") is None
        if self._has_guiding:
            with gui.add_folder(self._text("guide.title"), expand_by_default=False):
                self._build_guiding(gui, state)
        with gui.add_folder(self._text("push.title"), expand_by_default=False):
            self._build_push(gui, state)

    def _build_guiding(self, gui: Any, state: UiState) -> None:
        text, ask = self._text, self._ask
        ways = {text(f"guide.{way}"): way for way in GUIDING_KINDS}
        self._ways = {way: label for label, way in ways.items()}
        way = gui.add_dropdown(
            text("guide.way"),
            tuple(ways),
            initial_value=self._ways[state.push.guiding_kind],
            hint=text("guide.way_hint"),
        )
        self._way = BoundControl(way, ask, lambda v, p: SetPush(page=p, guiding_kind=ways.get(v)))
        self._guide = gui.add_button(text("drive.guide"), icon="hand-move", color="blue", hint=text("guide.hint"))
        on_press(self._guide, ask, lambda page: RobotCommand(page=page, what="guide"))
        self._unguide = gui.add_button(text("drive.unguide"), icon="hand-stop", color="gray")
        on_press(self._unguide, ask, lambda page: RobotCommand(page=page, what="unguide"))

    def _build_push(self, gui: Any, state: UiState) -> None:
        text, ask, push = self._text, self._ask, state.push
        self._note = Html(gui)
        places = {text("push.tool"): TOOL}
        places |= {text("push.link", number=number): number for number in range(1, state.model.n + 1)}
        self._places = {link: label for label, link in places.items()}
        link = gui.add_dropdown(text("push.where"), tuple(places), initial_value=self._places[push.link])
        self._link = BoundControl(link, ask, lambda v, p: SetPush(page=p, link=places.get(v)))
        direction = gui.add_dropdown(
            text("push.direction"), tuple(DIRECTIONS), initial_value=push.direction, hint=text("push.direction_hint")
        )
        self._direction = BoundControl(direction, ask, lambda v, p: SetPush(page=p, direction=v))
        force = gui.add_slider(text("push.force"), 0.0, STRONGEST, 1.0, push.newtons)
        self._force = BoundControl(force, ask, lambda v, p: SetPush(page=p, newtons=v))
        self._button = gui.add_button(text("push.hold"), icon="hand-finger", color="grape", hint=text("push.hold_hint"))

        @self._button.on_hold(callback_hz=_HOLD_RATE)
        async def _(event: Any) -> None:
            ask(HoldPush(page=event.client_id))

        grab = gui.add_checkbox(text("push.grab"), push.grab, hint=text("push.grab_hint", stiffness=f"{SPRING:.0f}"))
        self._grab = BoundControl(grab, ask, lambda v, p: SetPush(page=p, grab=v))
        self._felt = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows state and robot."""
        text, push = self._text, state.push
        self._link.show(self._places[push.link])
        self._direction.show(push.direction)
        self._force.show(push.newtons)
        self._grab.show(push.grab)
        unsimulated = explain_missing_feature(state.model, "simulation") if state.target == "virtual" else None
        reason = unsimulated or no_push(status)
        self._button.disabled = reason is not None
        soft = gives_way(status)
        if reason is None and state.plant == "ideal" and not soft:
            sentence = text("push.ideal")
        elif reason is None and not soft:
            sentence = text("push.stiff")
        else:
            sentence = text("push.free") if reason is None else text.render(reason)
        if can_grab(state, status):
            sentence += " " + text("push.drag")
        self._note.show(f'<p class="rl-note">{esc(sentence)}</p>')
        self._felt.show(felt_html(status, text))
        if self._has_guiding:
            self._way.show(self._ways[push.guiding_kind])
            is_ready = status.phase == "idle" and bool(status.powered)
            self._guide.disabled = is_moving(status) or not is_ready
            self._unguide.disabled = not is_guided(status)


def felt_html(status: SupervisorStatus, text: Text) -> str:
    """Returns the external force that the controller estimates."""
    if status.tau_ext is None:
        return ""
    force = " / ".join(format_fixed(float(number), 0) for number in status.tau_ext[:3])
    moment = " / ".join(format_fixed(float(number), 1) for number in status.tau_ext[3:])
    return (
        f'<table class="rl-table rl-facts-table"><tr><th>{esc(text("push.felt"))}</th>'
        f"<td>{force} N<br>{moment} N·m</td></tr></table>"
    )
