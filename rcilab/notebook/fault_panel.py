"""Faults: every one of the manual's with its cause and remedy, and the flight recorder of the last stop."""

from __future__ import annotations

from typing import Any

import ipywidgets
import numpy as np
from numpy.typing import NDArray

from rcilab.faults import Fault
from rcilab.notebook.look import block, esc, head, soft, table, verdict, write
from rcilab.notebook.part import Part
from rcilab.notebook.svg_plot import Panel, draw
from rcilab.views.plots import Quantity, build_frame, recorded_curves

_RECORDED = 400  # Cycles before the end that are drawn; a choice: 0.4 s.
_LISTED = 8
_QUANTITIES: tuple[Quantity, ...] = ("dq", "ddq", "jerk")


class FaultPanel(Part):
    """The twenty faults, which of them are set now, and the last milliseconds before a stop.

    Args:
        subject: A model, a session, or another part to look at the same arm as.
        language: "en" or "zh".
    """

    def __init__(self, subject: object, *, language: str = "en") -> None:
        super().__init__(subject, language)
        text = self.text
        self._now, self._told, self._record = block(), block(), block()
        self._set: tuple[Fault, ...] | None = None
        self.fault: Any = ipywidgets.Dropdown(
            description=text("fault.which"), options=[(fault.manual_name, fault) for fault in Fault],
            layout=ipywidgets.Layout(width="100%", max_width="40em"),
        )  # fmt: skip
        self.fault.observe(lambda _: self._tell(), names="value")
        self.build([self._now, self.fault, self._told, self._record], min_width="360px")
        self._tell()
        self.hear("robot", self._show)
        self.hear("run", self._show_record)

    def _show(self) -> None:
        status, text = self.state.status, self.text
        faults = () if status is None else status.faults
        if faults == self._set:
            return
        self._set = faults
        if not faults:
            write(self._now, verdict("good", "●", text("run.no_faults")))
            return
        names = ", ".join(fault.manual_name for fault in faults)
        write(self._now, verdict("bad", "◆", text("fault.now", faults=names)))
        self.fault.value = faults[0]

    def _tell(self) -> None:
        fault, text = self.fault.value, self.text
        remedy = f"remedy.{fault.name}"
        write(
            self._told,
            f'<div class="rl-card rl-none"><b>{esc(fault.manual_name)}</b> '
            f'<span class="rl-soft">{esc(text("fault.bit", bit=int(fault)))}</span>'
            f"<p>{esc(text(f'fault.{fault.name}'))}</p>"
            f'<p class="rl-soft">{esc(text("run.remedy"))} '
            f"{esc(text(remedy) if text.has(remedy) else text('remedy.smoothness'))}</p></div>",
        )

    def _show_record(self) -> None:
        rows = self._last_rows()
        if rows is None:
            write(self._record, head(self.text("fault.recorder")) + soft(self.text("fault.no_record")))
            return
        text, last = self.text, rows[-_LISTED:]
        heads = [text(f"fault.head.{name}") for name in ("cycle", "t", "success", "late", "joint", "velocity")]
        cells = [
            [
                f"{row['message_id']}",
                f"{row['t']:.3f} s",
                f"{100.0 * row['success_rate']:.0f} %",
                f"{1e6 * row['lateness']:.0f} µs",
                f"J{int(np.abs(row['dq']).argmax()) + 1}",
                f"{np.degrees(np.abs(row['dq']).max()):.2f} deg/s",
            ]
            for row in last
        ]
        picture = draw(self._panels(rows), list(range(self.model.n)), text("plot.time"), text("legend.limit"))
        told = head(text("fault.recorder")) + soft(text("fault.record_of", cycles=len(rows)))
        write(self._record, f"{told}{picture}{table(heads, cells, right=True)}")

    def _last_rows(self) -> NDArray[Any] | None:
        """Returns the last cycles of an execution that was not allowed to end; None where none was."""
        error, run = self.state.error, self.state.run
        record = getattr(error, "record", None)
        if record is None and error is not None and run is not None:
            record = run.cycles
        if record is None or not len(record):
            return None
        rows = record[np.isfinite(record["t"])]
        return rows[-_RECORDED:] if len(rows) > len(_QUANTITIES) else None

    def _panels(self, rows: NDArray[Any]) -> list[Panel]:
        t = rows["t"] - rows["t"][0]
        text, limits = self.text, self.model.limits.joint
        return [
            Panel(
                title=text(f"plot.{quantity}"),
                unit=text("plot.percent"),
                frame=build_frame(
                    None, recorded_curves(t, rows["q"], rows["q_c"], rows["dq"], quantity), limits, quantity, 0
                ),
            )
            for quantity in _QUANTITIES
        ]
