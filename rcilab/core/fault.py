"""The base of every maker's fault enumeration: a fault has a number, a name, a cause and a remedy."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum


class FaultCode(IntEnum):
    """A fault that a controller reports; the value is its number. Every maker derives its own enumeration."""

    @property
    def maker(self) -> str:
        """Name of the maker: its folder in `rcilab/makers`."""
        raise NotImplementedError

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
        """What to do about it, one sentence; empty if the maker gives no advice."""
        return ""


def name_faults(faults: Iterable[object]) -> str:
    """Returns the makers' names of faults, separated by commas."""
    return ", ".join(fault.manual_name for fault in faults if isinstance(fault, FaultCode))
