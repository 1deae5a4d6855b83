"""How a controller names itself: kind of arm, serial numbers, firmware."""

from __future__ import annotations

from typing import NamedTuple

FIRMWARE = "v2.7.103"
"""Firmware whose protocol this is: the client chooses its requests by it."""


class Identity(NamedTuple):
    """An arm as its client sees it."""

    axes: int
    type: int
    """Number of the kind of arm."""

    @property
    def robot_serial(self) -> str:
        """Serial number of the arm: 14 characters; the four digits are its hardware generation."""
        return f"XI1304000000{self.axes:02d}"

    @property
    def box_serial(self) -> str:
        """Serial number of the control box."""
        return "AC1304"

    def encode_version(self) -> bytes:
        """Returns the answer to a request for the version. Without its zero byte clients lose the last character."""
        text = f"{self.axes},{self.type},{self.robot_serial},{self.box_serial},{FIRMWARE}"
        return text.encode() + b"\0"

    def encode_serials(self) -> bytes:
        """Returns the answer to a request for the serial numbers."""
        return f"{self.robot_serial}\0{self.box_serial}\0".encode()


IDENTITIES = {
    "xArm5": Identity(5, 5),
    "xArm6": Identity(6, 6),
    "xArm7": Identity(7, 7),
    "Lite6": Identity(6, 9),
    "850": Identity(6, 12),
}
"""By the name of the arm; the numbers are those of the maker's client library."""
