"""The base of every maker's fault enumeration: a fault has a number, a name, a cause and a remedy."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum

from rcilab.core.errors import InvalidValueError


class FaultCode(IntEnum):
    """A fault that a controller reports; the value is its number. Every maker derives its own enumeration."""

    @property
    def maker(self) -> str:
        """Name of the maker: its folder in `rcilab/makers`."""
        raise NotImplementedError

    @property
    def key(self) -> str:
        """Key in the catalogues: `fault.KEY` for the cause, `remedy.KEY` for the remedy."""
        return f"{self.maker}.{self.name}"

    @property
    def manual_name(self) -> str:
        """Name in the maker's manual or client library."""
        return self.name.lower()

    @property
    def cause(self) -> str:
        """Short description of what the robot detected."""
        raise NotImplementedError

    @property
    def remedy(self) -> str:
        """How to clear it, one sentence; empty if the maker gives no advice."""
        return ""


def find_fault(faults: type[FaultCode], name: FaultCode | str) -> FaultCode:
    """Returns a fault by its name, as the manual prints it or as the member is called, in any case.

    Raises:
        InvalidValueError: It does not exist; the message lists the maker's faults.
    """
    requested = (name.name if isinstance(name, FaultCode) else name).replace("_", "").lower()
    for fault in faults:
        if requested in (fault.manual_name.replace("_", "").lower(), fault.name.replace("_", "").lower()):
            return fault
    known = ", ".join(fault.manual_name for fault in faults)
    raise InvalidValueError("fault", str(name), f"does not exist; known: {known}")


def name_faults(faults: Iterable[object]) -> str:
    """Returns the makers' names of faults, separated by commas."""
    return ", ".join(fault.manual_name for fault in faults if isinstance(fault, FaultCode))
