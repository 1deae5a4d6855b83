"""Controls that are heard while a cell runs: Stop must not wait for the end of the motion that it is to stop.

The kernel hears them in a thread beside the one that runs cells, a subshell. JupyterLab 4.4 and later has one made and
says so with every press; for who does not, VS Code among them, one is made here. ipykernel 7.4 asks a comm where its
messages go. Before, the kernel hears a press when the cell has ended; interrupting it (■) works everywhere.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

_ROUTE = "_reply_subshell_for"
"""ipykernel 7.4 asks it where a message goes: to the last sender, the very cell that is busy. Others lack it."""


def hear_at_once(*widgets: Any) -> None:
    """Has the messages of widgets go where the notebook sends them, or to our ear: what they do runs beside a cell."""
    for widget in widgets:
        if hasattr(widget.comm, _ROUTE):
            setattr(widget.comm, _ROUTE, partial(_route, widget.comm.kernel))


def _route(kernel: Any, data: object, subshell: str | None) -> str | None:
    """In the thread that hands messages on."""
    return _make_ear(kernel) if subshell is None else subshell


@cache
def _make_ear(kernel: Any) -> str | None:
    """Returns the name of a subshell of our own; None, the thread of the cells, where none can be made."""
    try:
        return kernel.shell_channel_thread.manager._create_subshell()
    except (AttributeError, AssertionError):  # Another ipykernel: heard late is better than not heard.
        return None
