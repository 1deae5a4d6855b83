"""The state datagram: 1247 bytes from the controller every millisecond.

Encoding joins the memory of the state's arrays, decoding reads the datagram through one array: no loop over fields
runs per cycle.
"""

from __future__ import annotations

from struct import Struct
from typing import Any

import numpy as np

from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.core.message_layout import Field, Layout
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.makers.rokae.faults import FAULT_COUNT, Fault

STATE = Layout(
    "robot state",
    (
        Field("message_id", "u64", order="big"),
        Field("q", "f64", 7, "rad"),
        Field("q_c", "f64", 7, "rad"),
        Field("dq", "f64", 7, "rad/s"),
        Field("dq_c", "f64", 7, "rad/s"),
        Field("ddq_c", "f64", 7, "rad/s^2"),
        Field("T_base_tool", "f64", 16, "row-major, m"),
        Field("T_base_tool_c", "f64", 16, "row-major, m"),
        Field("tool_velocity_c", "f64", 6, "m/s, rad/s"),
        Field("tool_acceleration_c", "f64", 6, "m/s^2, rad/s^2"),
        Field("psi", "f64", 1, "rad"),
        Field("psi_c", "f64", 1, "rad"),
        Field("dpsi_c", "f64", 1, "rad/s"),
        Field("ddpsi_c", "f64", 1, "rad/s^2"),
        Field("tau", "f64", 7, "N m"),
        Field("tau_filtered", "f64", 7, "N m"),
        Field("tau_c", "f64", 7, "N m"),
        Field("dtau_c", "f64", 7, "N m/s"),
        Field("tau_ext_in_base", "f64", 6, "N, N m"),
        Field("tau_ext_in_stiff", "f64", 6, "N, N m"),
        Field("theta", "f64", 7, "rad"),
        Field("dtheta", "f64", 7, "rad/s"),
        Field("motor_tau", "f64", 7, "N m"),
        Field("motor_tau_filtered", "f64", 7, "N m"),
        Field("errors", "u8", FAULT_COUNT),
        Field("success_rate", "f64"),
        Field("motion_generator_mode", "u8"),
        Field("controller_mode", "u8"),
        Field("robot_mode", "u8"),
    ),
)
STATE_SIZE = STATE.size
"""Length of a state datagram, in bytes."""


def _place(name: str) -> int:
    """Returns the index of the double at which a field starts."""
    return (STATE.offset(name) - _DOUBLES_OFFSET) // 8


_ID = Struct(">Q")
_DOUBLES_OFFSET = STATE.offset("q")
_ERRORS_OFFSET = STATE.offset("errors")
_DOUBLES_COUNT = (_ERRORS_OFFSET - _DOUBLES_OFFSET) // 8
_PSI = Struct("<4d")
_PSI_OFFSET = STATE.offset("psi")
_TAIL = Struct("<20sd3B")
_NO_FAULTS = bytes(FAULT_COUNT)
_UNUSED_ELEMENT = bytes(8)
_FAULTS = tuple(Fault)
_MOTION_MODES = {int(mode): mode for mode in MotionGeneratorMode}
_CONTROLLER_MODES = {int(mode): mode for mode in ControllerMode}
_ROBOT_MODES = {int(mode): mode for mode in RobotMode}

_Q, _Q_C, _DQ, _DQ_C, _DDQ_C = (_place(name) for name in ("q", "q_c", "dq", "dq_c", "ddq_c"))
_POSE, _POSE_C = _place("T_base_tool"), _place("T_base_tool_c")
_VELOCITY, _ACCELERATION = _place("tool_velocity_c"), _place("tool_acceleration_c")
_TAU, _TAU_FILTERED, _TAU_C, _DTAU_C = (_place(name) for name in ("tau", "tau_filtered", "tau_c", "dtau_c"))
_EXT_BASE, _EXT_STIFF = _place("tau_ext_in_base"), _place("tau_ext_in_stiff")
_THETA, _DTHETA = _place("theta"), _place("dtheta")
_MOTOR_TAU, _MOTOR_TAU_FILTERED = _place("motor_tau"), _place("motor_tau_filtered")


def encode_state(state: RobotState) -> bytes:
    """Returns the datagram of a state; the seventh elements of a 6-axis arm are sent as zeros.

    Raises:
        InvalidValueError: An array of the state has the wrong length or is not float64.
    """
    pad = b"" if state.q.shape[0] == 7 else _UNUSED_ELEMENT
    faults = _NO_FAULTS
    if state.faults:
        bits = bytearray(FAULT_COUNT)
        for fault in state.faults:
            bits[fault] = 1
        faults = bytes(bits)
    datagram = b"".join(
        (
            _ID.pack(state.message_id),
            state.q.tobytes(), pad,
            state.q_c.tobytes(), pad,
            state.dq.tobytes(), pad,
            state.dq_c.tobytes(), pad,
            state.ddq_c.tobytes(), pad,
            state.T_base_tool.tobytes(),
            state.T_base_tool_c.tobytes(),
            state.tool_velocity_c.tobytes(),
            state.tool_acceleration_c.tobytes(),
            _PSI.pack(state.psi, state.psi_c, state.dpsi_c, state.ddpsi_c),
            state.tau.tobytes(), pad,
            state.tau_filtered.tobytes(), pad,
            state.tau_c.tobytes(), pad,
            state.dtau_c.tobytes(), pad,
            state.tau_ext_in_base.tobytes(),
            state.tau_ext_in_stiff.tobytes(),
            state.theta.tobytes(), pad,
            state.dtheta.tobytes(), pad,
            state.motor_tau.tobytes(), pad,
            state.motor_tau_filtered.tobytes(), pad,
            _TAIL.pack(
                faults,
                state.success_rate,
                state.motion_generator_mode,
                state.controller_mode,
                state.robot_mode,
            ),
        )
    )  # fmt: skip
    if len(datagram) != STATE_SIZE:
        raise InvalidValueError(
            "state", f"RobotState of {len(datagram)} bytes", f"needs {STATE_SIZE}: check its arrays"
        )
    return datagram


def renumber_state(datagram: bytes, message_id: int) -> bytes:
    """Returns the datagram of a state with another number."""
    return _ID.pack(message_id) + datagram[_DOUBLES_OFFSET:]


def decode_state(data: bytes, n: int) -> RobotState:
    """Returns the state in a datagram; its arrays are read-only views of the datagram.

    Args:
        data: The datagram. Bytes after the first 1247 are ignored, as the vendor's client ignores them.
        n: Number of joints, 6 or 7: the number of defined elements of a 7-element array.

    Raises:
        DecodeError: Too short, or with an unknown mode.
    """
    return build_state(_decode_values(data, n))


class StateDecoder:
    """Decodes a stream of states: a state that repeats the last one, except for its number, shares its arrays."""

    def __init__(self) -> None:
        self._n = 0
        self._body: bytes = b""
        self._values: tuple[Any, ...] = ()

    def decode(self, data: bytes, n: int) -> RobotState:
        """Returns and raises the same as `decode_state`."""
        body = data[_DOUBLES_OFFSET:STATE_SIZE]
        if n == self._n and body == self._body:
            return build_state((_ID.unpack_from(data)[0], *self._values))
        values = _decode_values(data, n)
        self._n, self._body, self._values = n, body, values[1:]
        return build_state(values)


def _decode_values(data: bytes, n: int) -> tuple[Any, ...]:
    """Returns the values of a state's fields, in their order."""
    if len(data) < STATE_SIZE:
        raise DecodeError(f"robot state of {len(data)} bytes, needs {STATE_SIZE}", len(data))
    data = bytes(data)
    x = np.frombuffer(data, "<f8", _DOUBLES_COUNT, _DOUBLES_OFFSET)
    psi, psi_c, dpsi_c, ddpsi_c = _PSI.unpack_from(data, _PSI_OFFSET)
    bits, success_rate, motion_mode, controller_mode, robot_mode = _TAIL.unpack_from(data, _ERRORS_OFFSET)
    try:
        modes = _MOTION_MODES[motion_mode], _CONTROLLER_MODES[controller_mode], _ROBOT_MODES[robot_mode]
    except KeyError:
        raise _unknown_mode(motion_mode, controller_mode) from None
    return (
        _ID.unpack_from(data)[0],
        x[_Q : _Q + n],
        x[_Q_C : _Q_C + n],
        x[_DQ : _DQ + n],
        x[_DQ_C : _DQ_C + n],
        x[_DDQ_C : _DDQ_C + n],
        ReportedPose(x[_POSE : _POSE + 16]),
        ReportedPose(x[_POSE_C : _POSE_C + 16]),
        x[_VELOCITY : _VELOCITY + 6],
        x[_ACCELERATION : _ACCELERATION + 6],
        psi,
        psi_c,
        dpsi_c,
        ddpsi_c,
        x[_TAU : _TAU + n],
        x[_TAU_FILTERED : _TAU_FILTERED + n],
        x[_TAU_C : _TAU_C + n],
        x[_DTAU_C : _DTAU_C + n],
        x[_EXT_BASE : _EXT_BASE + 6],
        x[_EXT_STIFF : _EXT_STIFF + 6],
        x[_THETA : _THETA + n],
        x[_DTHETA : _DTHETA + n],
        x[_MOTOR_TAU : _MOTOR_TAU + n],
        x[_MOTOR_TAU_FILTERED : _MOTOR_TAU_FILTERED + n],
        () if bits == _NO_FAULTS else tuple(f for f, bit in zip(_FAULTS, bits, strict=True) if bit),
        success_rate,
        *modes,
    )


def _unknown_mode(motion_mode: int, controller_mode: int) -> DecodeError:
    if motion_mode not in _MOTION_MODES:
        name = "motion_generator_mode"
    elif controller_mode not in _CONTROLLER_MODES:
        name = "controller_mode"
    else:
        name = "robot_mode"
    return DecodeError(f"robot state: unknown {name}", STATE.offset(name))
