"""The control process and its supervisor: shared memory, requests, start, watch, stop, restart.

`simulate` lives in the module of the same name and is for that reason not a name of this package: `rcilab.simulate`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.control_process.pending_request import PendingRequest as PendingRequest
    from rcilab.control_process.status import SupervisorStatus as SupervisorStatus
    from rcilab.control_process.supervisor import Supervisor as Supervisor

_HOME = {"Supervisor": "supervisor", "PendingRequest": "pending_request", "SupervisorStatus": "status"}

__all__ = ["PendingRequest", "Supervisor", "SupervisorStatus"]


def __getattr__(name: str) -> object:
    """Imports a public name when it is first asked for: the control process must not pay for its parent's imports."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
