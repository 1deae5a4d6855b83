"""Health: the controller's status and the timing of the cycles."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from rcilab.app.status_text import health_values
from rcilab.app.text import Text
from rcilab.core.clock import CYCLE_TIME
from rcilab.workbench.widgets import Ask, Html, esc

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.control_process.status import Lateness

_ROWS = (
    "mode", "control", "power", "success", "in_row", "rate", "late", "lateness", "round_trip", "answer", "scheduling"
)  # fmt: skip
_OF_OURS = ("scheduling",)  # Of our own control process, which a page that watches has not.
_PERIOD = 0.3  # [s] Between two updates: as fast as one can read.
_LATE = 1000.0  # [us] From here on a cycle counts as late.


class HealthPanel:
    """A group of the Run tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text = text
        self._shown = 0.0

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the table."""
        with gui.add_folder(self._text("run.health"), expand_by_default=False):
            self._health = Html(gui)
            self._histogram = Html(gui)
        gui.add_html(f'<p class="rl-note">{esc(self._text("watch.stop" if state.watched else "stop.note"))}</p>')

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the robot."""
        if time.monotonic() - self._shown < _PERIOD:
            return
        self._shown = time.monotonic()
        self._health.show(health_html(state, status, self._text))
        self._histogram.show(histogram_html(status.lateness, self._text, is_watched=bool(state.watched)))


def health_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns the timing of the cycles, as a table."""
    world = state.world.status
    values = health_values(status, text) | {
        "in_row": "—" if world is None else f"{world.lost_in_row}",
        "round_trip": "—" if status.round_trip is None else f"{1000.0 * status.round_trip:.0f} ms",
        "answer": "—" if status.answer_time is None else f"{1e6 * status.answer_time:.0f} µs",
    }
    names = _ROWS
    if state.watched:
        cycles = 0 if status.motion_time is None else round(status.motion_time / CYCLE_TIME) + 1
        values["late"] = text("health.late_counts", lost=status.lost_cycles, late=status.late_cycles, cycles=cycles)
        names = tuple(name for name in _ROWS if name not in _OF_OURS)
    rows = "".join(_row(name, values[name], text, is_watched=bool(state.watched)) for name in names)
    return f'<table class="rl-table rl-facts-table">{rows}</table>'


def _row(name: str, value: str, text: Text, *, is_watched: bool) -> str:
    """Returns a row: its meaning is shown under the mouse, its good value below the number.

    Where a foreign client drives, timing is that of the client: such a row has texts of its own.
    """
    good = f"health.{name}_good"
    name = f"{name}_watched" if is_watched and text.has(f"health.{name}_watched") else name
    below = f'<br><span class="rl-dim">{esc(text(good))}</span>' if text.has(good) else ""
    name_cell = f"<th>{esc(text(f'health.{name}'))}</th>"
    return f'<tr title="{esc(text(f"health.{name}_help"))}">{name_cell}<td>{esc(value)}{below}</td></tr>'


def histogram_html(late: Lateness, text: Text, *, is_watched: bool = False) -> str:
    """Returns a histogram of lateness, as bars of logarithmic length, with a text next to late cycles."""
    if not late.cycles:
        return ""
    most = math.log10(1.0 + float(late.histogram.max()))
    rows: list[str] = []
    for low, high, count in zip(late.edges[:-1], late.edges[1:], late.histogram, strict=True):
        if count == 0 and (low >= late.max or high <= late.p50 / 4.0):
            continue
        share = 100.0 * math.log10(1.0 + float(count)) / most
        upper = "∞" if math.isinf(high) else f"{high:g}"
        word = f" {esc(text('health.too_late'))}" if low >= _LATE and count else ""
        tone = "rl-bad" if word else "rl-good"
        bar = f'<div class="rl-meter"><i style="width:{share:.0f}%"></i></div>'
        rows.append(
            f'<tr><th style="width:26%">{low:g}–{upper}</th><td class="{tone}" style="width:48%">{bar}</td>'
            f"<td>{count}{word}</td></tr>"
        )
    return (
        f'<p class="rl-note">{esc(text("health.histogram_watched" if is_watched else "health.histogram"))}</p>'
        f'<table class="rl-table rl-facts-table rl-histogram">{"".join(rows)}</table>'
    )
