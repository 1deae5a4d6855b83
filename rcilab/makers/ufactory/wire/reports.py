"""The reports of the ports 30000 to 30003: tables of fields, in the order of the bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from struct import Struct
from typing import NamedTuple, TypeAlias

ReportValue: TypeAlias = float | bytes | Sequence[float]


class Field(NamedTuple):
    """A field of a report."""

    name: str
    code: str
    """Type: as in `struct`. Floats are little-endian, integers big-endian."""
    length: int = 1
    """Number of elements."""


_BASIC = (
    Field("size", "I"),
    Field("state_and_mode", "B"),  # State in the lower four bits.
    Field("queued", "H"),
    Field("q", "f", 7),  # [rad]
    Field("pose", "f", 6),  # x, y, z, roll, pitch, yaw, [mm, rad]
    Field("torque", "f", 7),  # [N m], or currents, [A]
)
_FORCES = (Field("external_force", "f", 6), Field("raw_force", "f", 6))
_NORMAL = (
    *_BASIC,
    Field("brakes", "B"),  # Released brakes, a bit per joint.
    Field("enabled", "B"),
    Field("error", "B"),
    Field("warning", "B"),
    Field("tcp_offset", "f", 6),  # [mm, rad]
    Field("load", "f", 4),  # Mass, centre x, y, z, [kg, mm]
    Field("collision_sensitivity", "B"),
    Field("teach_sensitivity", "B"),
    Field("gravity", "f", 3),
)
_RICH = (
    *_NORMAL,
    Field("type", "B"),
    Field("axes", "B"),
    Field("bus_ids", "B", 4),  # Master, slave, motor transmit, motor receive.
    Field("version", "s", 30),
    Field("tcp_limits", "f", 5),  # Jerk, least and largest acceleration, least and largest speed, [mm]
    Field("joint_limits", "f", 5),  # The same, [rad]
    Field("rotation_limits", "f", 2),  # Jerk, largest acceleration, [rad]
    Field("servo_codes", "B", 14),  # Status and error, per joint.
    Field("tool_codes", "B", 2),
    Field("temperatures", "b", 7),  # [deg C]
    Field("tcp_speed", "f"),  # [mm/s]
    Field("joint_speeds", "f", 7),  # [rad/s]
    Field("counter", "I"),
    Field("world_offset", "f", 6),  # [mm, rad]
    Field("io_reset", "B", 2),  # Controller, tool: whether a stop resets the outputs.
    Field("is_simulation", "B"),
    Field("self_collision", "B"),
    Field("tool_model", "B"),
    Field("tool_parameters", "f", 6),
    Field("voltages", "H", 7),  # [0.01 V]
    Field("currents", "f", 7),  # [A]
    Field("io_state", "B", 2),  # State and error of the controller's board.
    Field("io_digital", "H", 4),  # Inputs by function, by configuration; the same of outputs.
    Field("io_analog", "H", 4),  # Two inputs, two outputs, 4095 at 10 V.
    Field("io_functions", "B", 32),  # Of inputs 0-7, outputs 0-7, inputs 8-15, outputs 8-15.
    *_FORCES,
    Field("identification", "B"),  # [percent]
    Field("rotation_vector", "f", 3),  # Of the tool, [rad]
    Field("configuration", "B"),  # Bits: reduced mode, fence, currents reported, approximation, continuity.
    Field("reduced", "B"),
    Field("boundary", "h", 6),  # x, y, z: largest, least, [mm]
    Field("reduced_speeds", "f", 2),  # Tool, joints, [mm/s, rad/s]
    Field("reduced_ranges", "f", 14),  # Least and largest angle per joint, [rad]
    Field("fence", "B"),
    Field("rebound", "B"),
    Field("io_alarm", "I"),
    Field("switches", "B"),
    Field("device", "B", 2),  # External device: type, state.
    Field("device_values", "h", 3),  # Position, speed, current.
)
_HIGH_RATE = (
    Field("size", "I"),
    Field("microseconds", "Q"),
    Field("state_and_mode", "B"),
    Field("queued", "H"),
    Field("reserved", "B", 17),
    Field("target_q", "f", 7),  # [rad]
    Field("target_dq", "f", 7),
    Field("target_ddq", "f", 7),
    Field("q", "f", 7),
    Field("dq", "f", 7),
    Field("ddq", "f", 7),
    Field("currents", "f", 7),  # [A]
    Field("joint_torque", "f", 7),  # [N m]
    Field("joint_reserved", "f", 42),
    Field("target_pose_aa", "f", 6),  # x, y, z and rotation vector, [mm, rad]
    Field("target_twist", "f", 6),  # [mm/s, rad/s]
    Field("pose_aa", "f", 6),
    Field("twist", "f", 6),
    Field("tcp_wrench", "f", 6),  # [N, N m]
    Field("target_tcp_acceleration", "f", 6),
    Field("tcp_acceleration", "f", 6),
    Field("tcp_reserved", "f", 24),
    Field("raw_force", "f", 6),
    Field("external_force", "f", 6),
    Field("device", "B", 2),
    Field("device_values", "h", 3),
    Field("device_reserved", "B", 40),
    Field("inputs", "H"),
    Field("outputs", "H"),
    Field("analog_inputs", "h", 2),  # [mV]
    Field("analog_outputs", "h", 2),
    Field("tool_inputs", "H"),
    Field("tool_outputs", "H"),
    Field("tool_analog_inputs", "h", 2),
)


class ReportLayout:
    """A report: its fields, its port and its period.

    Attributes:
        port: TCP port.
        period: Cycles of 1 ms between two reports.
        fields: The fields, in the order of the bytes.
        size: Size of a report, [bytes].
        offsets: Offset of each field, [bytes].

    Args:
        port: As the attribute.
        period: As the attribute.
        fields: As the attribute.
    """

    def __init__(self, port: int, period: int, fields: tuple[Field, ...]) -> None:
        self.port, self.period, self.fields = port, period, fields
        self.offsets: dict[str, int] = {}
        self.size = 0
        for field in fields:
            self.offsets[field.name] = self.size
            self.size += Struct(f">{field.length}{field.code}").size
        self._runs: list[tuple[Struct, tuple[Field, ...]]] = []
        for is_float, run in groupby(fields, key=lambda field: field.code == "f"):
            found = tuple(run)
            text = "".join(f"{field.length}{field.code}" for field in found)
            self._runs.append((Struct(("<" if is_float else ">") + text), found))

    def encode(self, values: Mapping[str, ReportValue]) -> bytes:
        """Returns a report; fields without a value are zero.

        Args:
            values: By the name of the field: a number, or as many as the field has.
        """
        parts: list[bytes] = []
        for run, fields in self._runs:
            numbers: list[float | bytes] = []
            for name, code, length in fields:
                value = self.size if name == "size" else values.get(name)
                if value is None:
                    numbers += [b""] if code == "s" else [0] * length
                elif isinstance(value, (int, float, bytes)):
                    numbers.append(value)
                else:
                    numbers += value
            parts.append(run.pack(*numbers))
        return b"".join(parts)


# Rates of the maker's documents; that of port 30000: firmware/report in its public repository ufactory_docs.
NORMAL = ReportLayout(30001, 200, _NORMAL)
RICH = ReportLayout(30002, 200, _RICH)
REAL = ReportLayout(30003, 10, (*_BASIC, *_FORCES))
HIGH_RATE = ReportLayout(30000, 5, _HIGH_RATE)
REPORTS = (RICH, NORMAL, REAL, HIGH_RATE)
