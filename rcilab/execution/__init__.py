"""The client of a controller: connects, reads states, and runs motions and callbacks at 1 kHz."""

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
    """Imports a public name on first use, so that the control process loads only what it needs."""
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
