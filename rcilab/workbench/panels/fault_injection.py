"""Lab: external influences on our own controller: its safety buttons, and a network that can be disturbed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.run.drive_state import is_ours
from rcilab.app.run.world_actions import PressSafety, SetNetwork
from rcilab.app.run.world_state import NETWORK_LAB
from rcilab.app.status_text import describe_success
from rcilab.app.text import Text
from rcilab.core.fault import name_faults
from rcilab.i18n.error_messages import describe_note
from rcilab.makers.maker import capabilities_of
from rcilab.sim.api import DIRECTIONS
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_SCALE = {"%": 100.0, "ms": 1000.0}
_BUTTONS: tuple[tuple[Any, str, str], ...] = (
    ("estop", "hand-stop", "red"),
    ("gstop", "door", "orange"),
    ("none", "lock-open", "blue"),
)


class FaultInjectionPanel:
    """Two groups of the Run tab; for a controller that is not ours they explain why they have no effect."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._buttons: dict[str, Any] = {}
        with gui.add_folder(text("safety.title"), expand_by_default=False):
            gui.add_html('<i class="rl-buttons"></i>')
            has_gate = capabilities_of(state.model).has_gate
            for name, icon, color in _BUTTONS:
                if name == "gstop" and not has_gate:
                    continue
                button = gui.add_button(
                    text(f"safety.{name}"), icon=icon, color=color, hint=text(f"safety.{name}_hint")
                )
                on_press(button, ask, lambda page, name=name: PressSafety(page=page, button=name))
                self._buttons[name] = button
            self._button = Html(gui)
        with gui.add_folder(text("network.title"), expand_by_default=False):
            self._note = Html(gui)
            self._sliders: dict[str, BoundControl] = {}
            for name, (largest, unit) in NETWORK_LAB.items():
                scale = _SCALE[unit]
                slider = gui.add_slider(text(f"network.{name}"), 0.0, largest * scale, 0.5, 0.0)
                self._sliders[name] = BoundControl(slider, ask, _set(name, scale))
            names = {text(f"network.{way}"): way for way in DIRECTIONS}
            self._ways = {way: label for label, way in names.items()}
            way = gui.add_dropdown(text("network.way"), tuple(names), hint=text("network.way_hint"))
            self._way = BoundControl(way, ask, lambda v, p: SetNetwork(page=p, direction=names.get(v)))
            self._pull = gui.add_button(text("network.pull"), icon="plug-connected-x", color="red")
            on_press(self._pull, ask, lambda page: SetNetwork(page=page, pulled=True))
            self._plug = gui.add_button(text("network.plug"), icon="plug-connected", color="blue")
            on_press(self._plug, ask, lambda page: SetNetwork(page=page, pulled=False))
            clear = gui.add_button(text("network.clear"), icon="restore", color="gray")
            on_press(clear, ask, lambda page: SetNetwork(page=page, clear=True))
            self._noticed = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows our own controller."""
        text, world, ours = self._text, state.world, is_ours(status)
        pressed = "none" if world.status is None else world.status.button
        for name, button in self._buttons.items():
            button.disabled = not ours or name == pressed
        missing = (
            text("world.disconnected") if status.phase == "closed" else text("world.not_ours", address=status.target)
        )
        sentence = text(f"safety.{pressed}_is") if ours else missing
        tone = "good" if ours and pressed == "none" else "warn"
        self._button.show(f'<p class="rl-verdict rl-{tone}">{esc(sentence)}</p>')
        for name, slider in self._sliders.items():
            slider.show(round(getattr(world.network, name) * _SCALE[NETWORK_LAB[name][1]], 3))
            slider.handle.disabled = not ours or world.pulled
        self._way.show(self._ways[world.direction])
        self._way.handle.disabled = not ours or world.pulled
        self._pull.visible, self._plug.visible = not world.pulled, world.pulled
        self._pull.disabled = self._plug.disabled = not ours
        note = text("network.note") if ours else missing
        self._note.show(f'<p class="rl-note">{esc(note)}</p>')
        self._noticed.show(noticed_html(state, status, text) if ours else "")


def noticed_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns what client and controller report of the network."""
    world = state.world.status
    faults = name_faults(status.faults) or text("bar.none")
    rows = [
        ("client_rate", f"{status.rate_hz:.0f} Hz"),
        ("client_lost", f"{status.lost_cycles}"),
        ("client_success", text.render(describe_success(status))),
        ("controller_lost", "—" if world is None else f"{world.lost}"),
        ("controller_ignored", "—" if world is None else f"{world.ignored}"),
        ("controller_faults", faults),
    ]
    if world is not None and world.reason and status.faults:
        rows.append(("controller_reason", text.render(describe_note(world.reason))))
    return f'<table class="rl-table rl-facts-table">{"".join(_row(*row, text) for row in rows)}</table>'


def _row(name: str, value: str, text: Text) -> str:
    cells = f"<th>{esc(text(f'network.{name}'))}</th><td>{esc(value)}</td>"
    return f'<tr title="{esc(text(f"network.{name}_help"))}">{cells}</tr>'


def _set(name: str, scale: float):  # type: ignore[no-untyped-def]
    return lambda value, page: SetNetwork(page=page, name=name, value=float(value) / scale)
