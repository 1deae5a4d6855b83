"""Health: what the controller is doing and how well the cycles are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.workbench.text import Text
from rcilab.workbench.widgets import Ask, Html, esc

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState


class HealthPanel:
    """A group of the Run tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text = text

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the table."""
        with gui.add_folder(self._text("run.health")):
            self._health = Html(gui)
        gui.add_html(f'<p class="rl-note">{esc(self._text("stop.note"))}</p>')

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the robot."""
        self._health.show(health_html(status, self._text))


def health_html(status: SupervisorStatus, text: Text) -> str:
    """Returns how well the cycles are kept, as a table."""
    late = status.lateness
    mode = "—" if status.robot_mode is None else text(f"robot_mode.{status.robot_mode.name}")
    power = {None: "—", True: text("run.on"), False: text("run.off")}[status.powered]
    rows = [
        ("mode", mode),
        ("control", "—" if status.controller_mode is None else text(f"controller_mode.{status.controller_mode.name}")),
        ("power", power),
        ("success", f"{100.0 * status.success_rate:.1f} %"),
        ("rate", f"{status.rate_hz:.0f} Hz"),
        ("late", text("run.late_value", late=status.late_cycles, lost=status.lost_cycles, cycles=late.cycles)),
        ("lateness", f"{late.p50:.0f} / {late.p99:.0f} / {late.p999:.0f} / {late.max:.0f} µs"),
        ("scheduling", text(f"scheduling.{status.scheduling}")),
    ]
    body = "".join(f"<tr><th>{esc(text(f'health.{name}'))}</th><td>{esc(value)}</td></tr>" for name, value in rows)
    return f'<table class="rl-table rl-facts-table">{body}</table>'
