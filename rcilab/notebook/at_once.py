"""Controls that are heard while a cell runs: Stop must not wait for the end of the motion that it is to stop.

JupyterLab 4.4 and later sends what is pressed to a thread of the kernel beside the one that runs cells, a subshell, and
ipykernel 7 has such. Elsewhere the kernel hears a press when the cell has ended; interrupting it (■) works everywhere.
"""

from __future__ import annotations

from typing import Any

_ROUTE = "_reply_subshell_for"
"""ipykernel 7.4 asks it where a message goes: to whoever spoke last, the very cell that is busy. Others have none."""


def hear_at_once(*widgets: Any) -> None:
    """Has the messages of widgets go where the notebook sends them. What they do may run beside a cell."""
    for widget in widgets:
        if hasattr(widget.comm, _ROUTE):
            setattr(widget.comm, _ROUTE, _as_sent)


def _as_sent(data: object, subshell: str | None) -> str | None:
    return subshell
