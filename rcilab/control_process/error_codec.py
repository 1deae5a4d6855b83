"""An error on its way from the control process to whoever asked: its kind, its sentence, its facts."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from rcilab.core import errors
from rcilab.core.errors import CommandRejectedError, ControlError, RcilabError
from rcilab.core.faults import Fault
from rcilab.makers.rokae import wire as rci


def pack_failure(error: Exception) -> dict[str, Any]:
    """Returns an error as a letter."""
    kind = next((kind.__name__ for kind in type(error).__mro__ if hasattr(errors, kind.__name__)), "RcilabError")
    failure: dict[str, Any] = {"kind": kind, "message": str(error)}
    if isinstance(error, RcilabError) and error.code:
        failure |= {"code": error.code, "facts": {name: _pack_fact(fact) for name, fact in error.facts.items()}}
    if not isinstance(error, RcilabError):
        failure["message"] = f"the control process failed with {type(error).__name__}: {error}; this is a defect"
    if isinstance(error, ControlError):
        failure["faults"] = [int(fault) for fault in error.faults if isinstance(fault, Fault)]
    if isinstance(error, CommandRejectedError) and isinstance(error.status, IntEnum):
        failure["command"], failure["status"] = error.command, [type(error.status).__name__, int(error.status)]
    return failure


def unpack_failure(failure: dict[str, Any]) -> RcilabError:
    """Returns the error in a letter, of the same class where it is one of ours."""
    kind = getattr(errors, str(failure.get("kind")), RcilabError)
    if not (isinstance(kind, type) and issubclass(kind, RcilabError)):
        kind = RcilabError
    error: RcilabError = kind.__new__(kind)  # Its constructor would build a sentence from facts; here is the sentence.
    error.args = (str(failure.get("message")),)
    if "code" in failure:
        facts = {name: unpack_failure(f) if isinstance(f, dict) else f for name, f in failure["facts"].items()}
        error.coded(str(failure["code"]), **facts)
    if isinstance(error, ControlError):
        error.faults = tuple(Fault(number) for number in failure.get("faults", ()))
        error.record = None
    if isinstance(error, CommandRejectedError):
        kind_of_status, number = failure.get("status") or ("", 0)
        status: Any = getattr(rci, kind_of_status, None)
        error.command, error.status = str(failure.get("command")), None if status is None else status(number)
    return error


def _pack_fact(fact: object) -> object:
    return pack_failure(fact) if isinstance(fact, RcilabError) else fact if isinstance(fact, int) else str(fact)
