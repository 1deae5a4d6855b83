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
"""ipykernel 7.4 asks it for the subshell of a message: by default the last sender, the busy cell. Others lack it."""


def hear_at_once(*widgets: Any) -> None:
    """Routes widget messages where the notebook sends them, or to our subshell: they are handled while a cell runs."""
    for widget in widgets:
        if hasattr(widget.comm, _ROUTE):
            setattr(widget.comm, _ROUTE, partial(_route, widget.comm.kernel))


def _route(kernel: Any, data: object, subshell: str | None) -> str | None:
    """In the thread that dispatches messages."""
    return _make_ear(kernel) if subshell is None else subshell


@cache
def _make_ear(kernel: Any) -> str | None:
    """Returns the id of our own subshell; None, the thread of the cells, if none can be created."""
    try:
        return kernel.shell_channel_thread.manager._create_subshell()
    except (AttributeError, AssertionError):  # Another ipykernel: a late answer is better than none.
        return None
