"""The command datagram: 290 bytes from the client, one for each state."""

from __future__ import annotations

from typing import NamedTuple

from rcilab.core.arrays import JointVector
from rcilab.core.command import CartesianPosition, Command, JointPosition
from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.core.message_layout import Field, Layout
from rcilab.core.state import RobotState

COMMAND = Layout(
    "robot command",
    (
        Field("message_id", "u64", order="big"),
        Field("q_c", "f64", 7, "rad"),
        Field("T_base_tool_c", "f64", 16, "row-major, m"),
        Field("psi_valid", "flag"),
        Field("psi_c", "f64", 1, "rad"),
        Field("finished", "flag"),
        Field("dynamic_wall", "f64", 4, "always zero"),
        Field("tau_c", "f64", 7, "N m"),
    ),
)
COMMAND_SIZE = COMMAND.size
"""Length of a command datagram, in bytes."""

_ID, _BODY = COMMAND.structs
_NO_JOINTS = (0.0,) * 7
_NO_POSE = (0.0,) * 16
_NO_WALL = (0.0,) * 4


class CommandPacket(NamedTuple):
    """The content of a command datagram, in plain floats."""

    message_id: int
    """Number of the state that this command answers."""
    q_c: tuple[float, ...] = _NO_JOINTS
    """Joint angles, n numbers, [rad]."""
    T_base_tool_c: tuple[float, ...] = _NO_POSE
    """Tool pose in base, 16 numbers, row-major, [m]."""
    psi_valid: bool = False
    """Whether `psi_c` is used."""
    psi_c: float = 0.0
    """Arm angle, [rad]."""
    finished: bool = False
    """Never seen true from the vendor's client, which announces the end over TCP alone."""
    tau_c: tuple[float, ...] = _NO_JOINTS
    """Joint torques, n numbers, [N m]."""


def build_command(message_id: int, command: Command, state: RobotState) -> CommandPacket:
    """Returns the packet of a callback's command; unused fields have the values of the vendor's client.

    `finished` is one of them: the vendor's client announces the end of a motion over TCP alone.

    Args:
        message_id: Number of the answered state.
        command: The command.
        state: The answered state; its measured joints and pose fill the unused fields.
    """
    if isinstance(command, JointPosition):
        pose = state.T_base_tool.as_row_major()
        return CommandPacket(message_id, _seven(command.q), pose)
    if isinstance(command, CartesianPosition):
        pose = tuple(command.T_base_tool.ravel().tolist())
        has_psi = command.psi is not None
        psi = command.psi if command.psi is not None else 0.0
        return CommandPacket(message_id, _seven(state.q), pose, has_psi, psi)
    return CommandPacket(message_id, tau_c=_seven(command.tau))


def encode_command(packet: CommandPacket) -> bytes:
    """Returns the datagram of a command; 6-element arrays are padded with a zero.

    Raises:
        InvalidValueError: An array has the wrong number of elements.
    """
    message_id, q_c, pose, psi_valid, psi_c, finished, tau_c = packet
    if len(q_c) == 6:
        q_c = (*q_c, 0.0)
    if len(tau_c) == 6:
        tau_c = (*tau_c, 0.0)
    if len(q_c) != 7 or len(pose) != 16 or len(tau_c) != 7:
        raise InvalidValueError("command", packet, "needs 6 or 7 joint values and 16 pose values")
    return _ID.pack(message_id) + _BODY.pack(*q_c, *pose, psi_valid, psi_c, finished, *_NO_WALL, *tau_c)


def decode_command(data: bytes, n: int) -> CommandPacket:
    """Returns the command in a datagram.

    Args:
        data: The datagram.
        n: Number of joints, 6 or 7; the seventh element of a 6-axis arm is undefined and is dropped.

    Raises:
        DecodeError: Not exactly 290 bytes.
    """
    if len(data) != COMMAND_SIZE:
        raise DecodeError(f"robot command of {len(data)} bytes, needs {COMMAND_SIZE}", min(len(data), COMMAND_SIZE))
    x = _BODY.unpack_from(data, _ID.size)
    return CommandPacket(_ID.unpack_from(data)[0], x[:n], x[7:23], x[23], x[24], x[25], x[30 : 30 + n])


def _seven(values: JointVector) -> tuple[float, ...]:
    numbers = values.tolist()
    return tuple(numbers) if len(numbers) == 7 else (*numbers, 0.0)
