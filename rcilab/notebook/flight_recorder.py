"""The flight recorder: the joints in the last milliseconds before a motion was stopped."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rcilab.core.limits import JointLimits
from rcilab.i18n.translator import Text
from rcilab.notebook.state import LabState
from rcilab.notebook.style import head, soft, table
from rcilab.notebook.svg_plot import Panel, draw
from rcilab.views.plots import Quantity, build_frame, recorded_curves

_RECORDED = 400  # Drawn cycles before the end: 0.4 s.
_LISTED = 8
_QUANTITIES: tuple[Quantity, ...] = ("dq", "ddq", "jerk")
_HEADS = ("cycle", "t", "success", "late", "joint", "velocity")


def record_html(state: LabState, text: Text) -> str:
    """Returns the last cycles of an execution that did not reach its end, as curves and as a table."""
    rows = _last_rows(state)
    if rows is None:
        return head(text("fault.recorder")) + soft(text("fault.no_record"))
    cells = [
        [
            f"{row['message_id']}",
            f"{row['t']:.3f} s",
            f"{100.0 * row['success_rate']:.0f} %",
            f"{1e6 * row['lateness']:.0f} µs",
            f"J{int(np.abs(row['dq']).argmax()) + 1}",
            f"{np.degrees(np.abs(row['dq']).max()):.2f} deg/s",
        ]
        for row in rows[-_LISTED:]
    ]
    model = state.model
    picture = draw(
        _panels(rows, model.limits.joint, text), list(range(model.n)), text("plot.time"), text("legend.limit")
    )
    heading = head(text("fault.recorder")) + soft(text("fault.record_of", cycles=len(rows)))
    return f"{heading}{picture}{table([text(f'fault.head.{name}') for name in _HEADS], cells, right=True)}"


def _last_rows(state: LabState) -> NDArray[Any] | None:
    outcome = state.outcome
    if outcome is None or (outcome.error is None and (outcome.run is None or not outcome.run.stopped)):
        return None
    record = outcome.record
    if record is None or not len(record):
        return None
    rows = record[np.isfinite(record["t"])]
    return rows[-_RECORDED:] if len(rows) > len(_QUANTITIES) else None


def _panels(rows: NDArray[Any], limits: JointLimits, text: Text) -> list[Panel]:
    t = rows["t"] - rows["t"][0]
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
