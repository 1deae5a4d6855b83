"""The command datagram: 370 bytes from the client in version 5, 371 in version 10, one for each state."""

from __future__ import annotations

from struct import Struct
from typing import NamedTuple

from rcilab.core.errors import DecodeError
from rcilab.makers.franka.wire.versions import FciVersion

_COMMON = Struct("<Q7d7d16d6d2d??7d")
_WITH_END = Struct("<Q7d7d16d6d2d??7d?")


class CommandPacket(NamedTuple):
    """The content of a command datagram; only the fields of the motion's generator and controller are read."""

    message_id: int
    """Number of the newest state that the client had received."""
    q_c: tuple[float, ...]
    """Joint angles, 7 numbers, [rad]; goals of an asynchronous motion."""
    dq_c: tuple[float, ...]
    """Joint velocities, 7 numbers, [rad/s]."""
    O_T_EE_c: tuple[float, ...]
    """Pose of the end effector in base, 16 numbers, column-major, [m]."""
    O_dP_EE_c: tuple[float, ...]
    """Twist of the end effector in base axes, linear first, 6 numbers, [m/s, rad/s]."""
    elbow_c: tuple[float, ...]
    """Angle of joint 3, [rad], and side of joint 4, +1 or -1."""
    has_elbow: bool
    """Whether `elbow_c` is used."""
    is_finished: bool
    """Whether the motion generator has ended."""
    tau_c: tuple[float, ...]
    """Joint torques without gravity, 7 numbers, [N m]."""
    has_ended_torques: bool
    """Whether the torques have ended; in version 5 `is_finished` indicates it."""


def command_size(version: FciVersion) -> int:
    """Returns the size of a command datagram, in bytes."""
    return (_WITH_END if version.finishes_torques else _COMMON).size


def decode_command(data: bytes, version: FciVersion) -> CommandPacket:
    """Returns the command in a datagram.

    Raises:
        DecodeError: It has another size than one of this version.
    """
    layout = _WITH_END if version.finishes_torques else _COMMON
    if len(data) != layout.size:
        raise DecodeError(f"robot command of {len(data)} bytes, needs {layout.size}", min(len(data), layout.size))
    x = layout.unpack(data)
    has_ended = x[48] if version.finishes_torques else x[40]
    return CommandPacket(x[0], x[1:8], x[8:15], x[15:31], x[31:37], x[37:39], x[39], x[40], x[41:48], has_ended)
