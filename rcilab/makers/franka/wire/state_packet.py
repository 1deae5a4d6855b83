"""The state datagram, every millisecond: 2373 bytes of doubles in version 5, 1377 of floats in version 10."""

from __future__ import annotations

from itertools import accumulate
from struct import Struct
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.versions import FciVersion

FIELDS = (
    ("O_T_EE", 16, "column-major, m"),
    ("O_T_EE_d", 16, "column-major, m"),
    ("F_T_EE", 16, "column-major, m"),
    ("EE_T_K", 16, "column-major, m"),
    ("F_T_NE", 16, "column-major, m"),
    ("NE_T_EE", 16, "column-major, m"),
    ("m_ee", 1, "kg"),
    ("I_ee", 9, "column-major, kg m^2"),
    ("F_x_Cee", 3, "m"),
    ("m_load", 1, "kg"),
    ("I_load", 9, "column-major, kg m^2"),
    ("F_x_Cload", 3, "m"),
    ("elbow", 2, "rad, side"),
    ("elbow_d", 2, "rad, side"),
    ("tau_J", 7, "N m"),
    ("tau_J_d", 7, "N m"),
    ("dtau_J", 7, "N m/s"),
    ("q", 7, "rad"),
    ("q_d", 7, "rad"),
    ("dq", 7, "rad/s"),
    ("dq_d", 7, "rad/s"),
    ("ddq_d", 7, "rad/s^2"),
    ("joint_contact", 7, "0 or 1"),
    ("cartesian_contact", 6, "0 or 1"),
    ("joint_collision", 7, "0 or 1"),
    ("cartesian_collision", 6, "0 or 1"),
    ("tau_ext_hat_filtered", 7, "N m"),
    ("O_F_ext_hat_K", 6, "N, N m"),
    ("K_F_ext_hat_K", 6, "N, N m"),
    ("O_dP_EE_d", 6, "m/s, rad/s"),
    ("O_ddP_O", 3, "m/s^2"),
    ("elbow_c", 2, "rad, side"),
    ("delbow_c", 2, "rad/s, 0"),
    ("ddelbow_c", 2, "rad/s^2, 0"),
    ("O_T_EE_c", 16, "column-major, m"),
    ("O_dP_EE_c", 6, "m/s, rad/s"),
    ("O_ddP_EE_c", 6, "m/s^2, rad/s^2"),
    ("theta", 7, "rad"),
    ("dtheta", 7, "rad/s"),
)
"""The numbers of a state in their order, with their units; `_d` are desired values, `_c` commanded ones."""

SLICES = MappingProxyType(
    {
        name: slice(end - count, end)
        for (name, count, _), end in zip(FIELDS, accumulate(count for _, count, _ in FIELDS), strict=True)
    }
)
"""The slice of each field in `StatePacket.numbers`."""
NUMBERS = sum(count for _, count, _ in FIELDS)
ACCELEROMETERS = 36
"""Readings of the acceleration sensors in version 10: top and bottom, 6 joints, 3 axes each, [m/s^2]."""

_ID = Struct("<Q")
_DOUBLES = Struct("<BB41s41sBd")
_FLOATS = Struct("<BB41s41sBf")
_READINGS = Struct(f"<{ACCELEROMETERS}f")
NO_ERRORS = bytes(len(FrankaError))
NO_READINGS = (0.0,) * ACCELEROMETERS


class StatePacket(NamedTuple):
    """The content of a state datagram."""

    message_id: int
    """Number of the state, which is the client's clock, [ms]."""
    numbers: NDArray[np.float64]
    """See `FIELDS`, shape (284,)."""
    accelerometers: tuple[float, ...]
    """36 numbers, [m/s^2]."""
    motion_generator_mode: int
    """0 without one, 1 joint position, 2 joint velocity, 3 Cartesian position, 4 Cartesian velocity, 5 none."""
    controller_mode: int
    """0 joint impedance, 1 Cartesian impedance, 2 external, 3 without one."""
    errors: bytes
    """A byte for each of the 41 errors."""
    reflex_reason: bytes
    """The errors that ended the last motion."""
    robot_mode: int
    """As `RobotMode` of rcilab."""
    success_rate: float
    """Share of the last 100 commands that arrived in time, 0 to 1; 0 without a motion."""


def encode_state(packet: StatePacket, version: FciVersion) -> bytes:
    """Returns the datagram of a state."""
    if version.has_floats:
        numbers, readings = packet.numbers.astype("<f4").tobytes(), _READINGS.pack(*packet.accelerometers)
        return b"".join((_ID.pack(packet.message_id), numbers, readings, _FLOATS.pack(*packet[3:])))
    return b"".join((_ID.pack(packet.message_id), packet.numbers.tobytes(), _DOUBLES.pack(*packet[3:])))


def renumber_state(datagram: bytes, message_id: int) -> bytes:
    """Returns the datagram of a state that differs in its number only."""
    return _ID.pack(message_id) + datagram[_ID.size :]


def flags_of(errors: tuple[FrankaError, ...]) -> bytes:
    """Returns a byte for each error, 1 for those that are set."""
    flags = bytearray(len(FrankaError))
    for error in errors:
        flags[error] = 1
    return bytes(flags)
