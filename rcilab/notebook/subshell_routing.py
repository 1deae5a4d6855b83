"""Controls that work while a cell runs: Stop must not wait for the end of the motion that it is to stop.

The kernel handles them in a subshell, a thread next to the one that runs cells. JupyterLab 4.4 and later creates it and
names it in every message; for other front ends, such as VS Code, one is created here. From ipykernel 7.4 on, a comm
chooses the subshell of its messages. With an earlier one, a click is handled at the end of the cell; interrupting the
kernel (■) always works.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

_ROUTE = "_reply_subshell_for"
"""ipykernel 7.4 calls it for the subshell of a message; by default that of the last sender, the busy cell.
Other versions lack it."""


def handle_during_cells(*widgets: Any) -> None:
    """Routes the messages of widgets to the subshell that they name, else to ours, also while a cell runs."""
    for widget in widgets:
        if hasattr(widget.comm, _ROUTE):
            setattr(widget.comm, _ROUTE, partial(_route, widget.comm.kernel))


def _route(kernel: Any, data: object, subshell: str | None) -> str | None:
    """Called in the thread that dispatches messages."""
    return _create_subshell(kernel) if subshell is None else subshell


@cache
def _create_subshell(kernel: Any) -> str | None:
    """Returns the id of our own subshell; None, the thread of the cells, if none can be created."""
    try:
        return kernel.shell_channel_thread.manager._create_subshell()
    except (AttributeError, AssertionError):  # Another ipykernel: messages are then handled at the end of the cell.
        return None
