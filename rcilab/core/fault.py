"""What a fault is, for every maker: a numbered member with one name, a cause and a remedy."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum


class FaultCode(IntEnum):
    """One fault that a controller reports; the value is its number there. Every maker derives its own enumeration."""

    @property
    def maker(self) -> str:
        """Name of the maker: its folder in `rcilab/makers`."""
        raise NotImplementedError

    @property
    def manual_name(self) -> str:
        """The name as the maker's manual or client library prints it."""
        return self.name.lower()

    @property
    def cause(self) -> str:
        """What the robot detected, in a few words."""
        raise NotImplementedError

    @property
    def remedy(self) -> str:
        """What to do about it, in one sentence; empty where the maker gives no advice."""
        return ""


def name_faults(faults: Iterable[object]) -> str:
    """Returns the names of faults as their maker prints them, with commas between."""
    return ", ".join(fault.manual_name for fault in faults if isinstance(fault, FaultCode))
