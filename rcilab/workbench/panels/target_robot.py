"""The destination of motions: none (preview), the virtual controller (ideal arm or MuJoCo), or an address."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.arm_features import is_only_planned
from rcilab.app.request import Request
from rcilab.app.run.drive_state import DESTINATIONS, destination
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.readiness import connection_note
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.run.target_robot_actions import ChooseDestination
from rcilab.app.status_text import phase_code
from rcilab.app.text import Text
from rcilab.makers.driver import parse_address
from rcilab.workbench.widgets import Ask, BoundControl, Html, PageText, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_TONES = {
    "idle": "good",
    "moving": "good",
    "stopping": "warn",
    "starting": "warn",
    "connecting": "warn",
    "closed": "warn",
}


class TargetRobotPanel:
    """A group of the Run tab. An address has to be confirmed before anything is sent there."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._picked: str | None = None  # "an address", before it is known.
        self._asked = ""  # The address in the question.

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("run.where"), order=0.0):  # First of its tab, in any order of building.
            self._where = Html(gui)
            names = {text(f"destination.{name}"): name for name in DESTINATIONS}
            self._names = {name: label for label, name in names.items()}
            first = state.plant if state.target == "virtual" else "address"
            choice = gui.add_dropdown(
                text("destination.title"), tuple(names), initial_value=self._names[first], hint=text("destination.hint")
            )
            self._choice = BoundControl(choice, ask, lambda v, p: self._pick(names.get(v, ""), p))
            box = gui.add_text(text("run.address"), _address_of(state), hint=text("run.address_hint"))
            self._address = PageText(box)
            self._connect = gui.add_button(text("run.connect"), icon="plug-connected", color="gray")
            on_press(self._connect, ask, lambda page: _choose(page, "address", self._address.of(page)))

            @box.on_update
            async def _(event: Any) -> None:
                if self._asked and event.target.value.strip() != self._asked:
                    ask(_choose(event.client_id, "address", answer="no"))

            self._question = Html(gui)
            self._yes = gui.add_button(text("destination.yes"), icon="plug-connected", color="red", visible=False)
            on_press(self._yes, ask, lambda page: _choose(page, "address", self._address.of(page), "yes"))
            self._no = gui.add_button(text("destination.no"), color="gray", visible=False)
            on_press(self._no, ask, lambda page: _choose(page, "address", answer="no"))
            self._again = gui.add_button(text("destination.again"), icon="refresh", color="gray", visible=False)
            on_press(self._again, ask, lambda page: ChooseRobot(page=page, target="virtual"))
            self._leave = gui.add_button(text("destination.leave"), icon="plug-connected-x", color="gray")
            on_press(self._leave, ask, lambda page: _choose(page, "preview"))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the connection."""
        text, where = self._text, destination(state, status)
        is_fixed = is_moving(status) or bool(state.watched)
        if where != "preview" or self._picked != "address":
            self._picked = self._picked if self._picked == "address" else None
        self._choice.show(self._names[self._picked or where])
        is_planned = is_only_planned(state.model)
        self._choice.handle.disabled = self._connect.disabled = is_fixed or is_planned
        self._address.handle.disabled = bool(state.watched)
        is_address = (self._picked or where) == "address"
        if self._address.show(state.control_lock, _address_of(state)) and state.typed_address:
            self._ask(_choose(None, "address", answer="no"))  # The page that asked has lost the controls.
        self._address.handle.visible = self._connect.visible = is_address
        asked = self._asked = state.typed_address
        sentence = "" if not asked else esc(text("destination.ask", address=asked, model=state.model.name))
        self._question.show(sentence and f'<p class="rl-verdict rl-warn" role="alert">{sentence}</p>')
        self._yes.visible = self._no.visible = bool(asked)
        self._again.visible = where in ("ideal", "mujoco") and status.phase in ("lost", "crashed")
        self._leave.disabled = is_fixed or where == "preview"
        tone = "warn" if status.code == "lost.rebooted" or status.is_pressed else _TONES.get(status.phase, "bad")
        name = text("destination.preview") if where == "preview" else text(f"where.{where}")
        name = state.target if where == "address" else name
        is_named = status.address in (None, "", name)
        address = "" if is_named else str(parse_address(status.address or "", state.model))
        below = f'<br><span class="rl-dim">{esc(address)}</span>' if address else ""
        note = connection_note(state, status)
        self._where.show(
            f'<p class="rl-verdict rl-{tone}"><b>{esc(name)}</b> {esc(text(phase_code(status)))}{below}</p>'
            + ("" if note is None else f'<p class="rl-note">{esc(text.render(note))}</p>')
        )

    def _pick(self, name: str, page: int | None) -> Request | None:
        self._picked = "address" if name == "address" else None
        return None if name in ("", "address") else _choose(page, name)


def _address_of(state: UiState) -> str:
    return state.target if state.target != "virtual" else ""


def _choose(page: int | None, where: str, address: str = "", answer: Any = "") -> Request:
    return ChooseDestination(page=page, where=where, address=address, answer=answer)
