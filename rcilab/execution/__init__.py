"""Our end of the wire: connect to a controller, read its states, run motions and callbacks at 1 kHz."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.execution.session import RobotSession as RobotSession
    from rcilab.execution.session import connect as connect
    from rcilab.recording.run import Run as Run

_HOME = {
    "connect": "rcilab.execution.session",
    "RobotSession": "rcilab.execution.session",
    "Run": "rcilab.recording.run",
}

__all__ = ["RobotSession", "Run", "connect"]


def __getattr__(name: str) -> object:
    """Imports a public name when it is first asked for: the control process must not pay for what it does not use."""
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
