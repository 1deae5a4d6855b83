"""The control process and its supervisor: shared memory, requests, process start, monitoring and restart.

`simulate` is not a name of this package, because its module has that name: use `rcilab.simulate`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.control_process.requests import PendingRequest as PendingRequest
    from rcilab.control_process.status import SupervisorStatus as SupervisorStatus
    from rcilab.control_process.supervisor import Supervisor as Supervisor

_HOME = {"Supervisor": "supervisor", "PendingRequest": "requests", "SupervisorStatus": "status"}

__all__ = ["PendingRequest", "Supervisor", "SupervisorStatus"]


def __getattr__(name: str) -> object:
    """Imports a public name on first use, so that the control process loads only what it needs."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
