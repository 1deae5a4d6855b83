"""The bits and registers that standard Modbus reads and writes: the table of the maker's Modbus manual.

What is reserved there, or does not exist on this arm, reads 0. A write that nothing would keep is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees

from rcilab.makers.ufactory.controller.modes import SET_PAUSED, SET_READY, SET_STOPPED, State
from rcilab.makers.ufactory.controller.reporter import padded, tool_speed_mm, user_pose
from rcilab.makers.ufactory.controller.settings import MILLIMETRE
from rcilab.makers.ufactory.controller.signals import BOX_SIGNALS, BOX_VOLTAGE, HIGHEST_CODE
from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.ufactory.wire.modbus import ModbusError, ModbusException
from rcilab.makers.ufactory.wire.poses import pose_as_mm_rpy, rotation_vector

_BOX_BITS, _RESERVED_BITS = 32, 128  # Addresses of the box, then of the tool; from 128 on the state.
_BRAKES, _ENABLES, _REDUCED, _FENCE, _PAUSED, _STOPPED, _MODES, _FREE = 128, 135, 142, 143, 144, 145, 146, 256
_END = 512
_MODE, _STATE = 32, 33
_ANALOG = 3
_JOINTS, _MODE_BITS = 7, 14  # Bits of brakes and of motors, and of modes.
_TOOL_BITS, _TOOL_OUTPUTS = 8, 2
_ANY = 0xFFFF
_LARGEST = {
    0: _ANY,
    1: 0,
    2: 0b11,
    _ANALOG: _ANY,
    _ANALOG + 1: _ANY,
    **dict.fromkeys(range(5, 11), 0),
    _MODE: _ANY,
    _STATE: _ANY,
}
"""Largest value of a holding register below `_FREE` that can be written: an output that does not exist stays 0."""


class ModbusRegisters:
    """A `ModbusMemory` of a controller. Owned by the server.

    Args:
        controller: The controller.
    """

    def __init__(self, controller: XArmController) -> None:
        self._controller = controller
        self._free_bits = [False] * (_END - _FREE)
        self._free_registers = [0] * (_END - _FREE)

    def read_coils(self, address: int, count: int) -> list[bool]:
        """Returns outputs, brakes, motors, reduced mode, fence, states and modes, and free bits."""
        controller = self._controller
        bits = _signal_bits(controller.signals.box_outputs, controller.signals.tool_outputs)
        enabled = [bool(controller.enabled >> k & 1) for k in range(_JOINTS)]
        state = controller.shown_state
        bits += [*enabled, *enabled, controller.settings.reduced, controller.settings.fence]
        bits += [state is State.PAUSED, state is State.STOPPED]
        bits += [mode == controller.mode for mode in range(_MODE_BITS)]
        bits += [False] * (_FREE - len(bits))
        return _part([*bits, *self._free_bits], address, count)

    def read_inputs(self, address: int, count: int) -> list[bool]:
        """Returns the digital inputs."""
        return _part(
            _signal_bits(self._controller.signals.box_inputs, self._controller.signals.tool_inputs), address, count
        )

    def read_holding(self, address: int, count: int) -> list[int]:
        """Returns outputs, mode and state, and free registers."""
        signals = self._controller.signals
        values = [signals.box_outputs, 0, signals.tool_outputs & 0xFF, *_millivolts(signals.analog_outputs)]
        values += [0] * (_MODE - len(values)) + [self._controller.mode, self._controller.shown_state]
        values += [0] * (_FREE - len(values))
        return _part([*values, *self._free_registers], address, count)

    def read_registers(self, address: int, count: int) -> list[int]:
        """Returns inputs, error and warning, counter, poses, load, offsets, and the joints."""
        controller, signals = self._controller, self._controller.signals
        settings = controller.settings
        measured = controller.arm.measured_state.measured
        pose, load = user_pose(controller), settings.load
        values = [signals.box_inputs, 0, signals.tool_inputs & 0xFF, *_millivolts(signals.analog_inputs)]
        values += [0] * (_MODE - len(values))
        values += [controller.error or 0, controller.warning or 0, controller.counter >> 16, controller.counter]
        values += [0] * (64 - len(values))
        values += [*_tenths(pose_as_mm_rpy(pose)), *(round(10.0 * degrees(x)) for x in rotation_vector(pose))]
        values += [round(1e3 * load.mass), *(round(10.0 * x / MILLIMETRE) for x in load.center_of_mass.tolist())]
        values += [*_tenths(pose_as_mm_rpy(settings.T_flange_tool)), *_tenths(pose_as_mm_rpy(settings.T_base_user))]
        values += [round(10.0 * degrees(x)) for x in padded(measured.q.tolist())]
        values += [30] * controller.model.n + [0] * (7 - controller.model.n)
        values += [round(10.0 * degrees(x)) for x in padded(measured.dq.tolist())]
        values += [round(10.0 * tool_speed_mm(controller))]
        values += [0] * (128 - len(values))
        return [value & 0xFFFF for value in _part(values, address, count)]

    def write_coils(self, address: int, bits: Sequence[bool]) -> None:
        """Writes outputs, brakes and motors, reduced mode, fence, pause, stop, the mode, and free bits; all or none."""
        if not all(self._keeps_coil(number, bit) for number, bit in enumerate(bits, address)):
            raise ModbusError(ModbusException.ADDRESS)
        for number, bit in enumerate(bits, address):
            self._write_coil(number, bit)

    def write_holding(self, address: int, registers: Sequence[int]) -> None:
        """Writes outputs, mode, state, and free registers; all or none."""
        for number, value in enumerate(registers, address):
            if not (value <= _LARGEST.get(number, -1) or _FREE <= number < _END):
                raise ModbusError(ModbusException.ADDRESS)
        signals = self._controller.signals
        for number, value in enumerate(registers, address):
            if number == 0:
                for signal in range(BOX_SIGNALS):
                    signals.set_output(signal, bool(value >> signal & 1))
            elif number == 2:
                for signal in range(_TOOL_OUTPUTS):
                    signals.set_output(BOX_SIGNALS + signal, bool(value >> signal & 1))
            elif number in (_ANALOG, _ANALOG + 1):
                signals.set_analog(number - _ANALOG, round(1e-3 * value / BOX_VOLTAGE * HIGHEST_CODE))
            elif number == _MODE:
                _require(self._controller.set_mode(value))
            elif number == _STATE:
                _require(self._controller.set_state(value))
            elif number >= _FREE:
                self._free_registers[number - _FREE] = value

    def _keeps_coil(self, number: int, bit: bool) -> bool:
        """Returns whether a bit can be written; that of an output or a joint that does not exist stays 0."""
        if number < _BOX_BITS + _TOOL_BITS:
            return not bit or number < BOX_SIGNALS or _BOX_BITS <= number < _BOX_BITS + _TOOL_OUTPUTS
        if _BRAKES <= number < _REDUCED:
            return not bit or (number - _BRAKES) % _JOINTS < self._controller.model.n
        return _REDUCED <= number < _MODES + _MODE_BITS or _FREE <= number < _END

    def _write_coil(self, number: int, bit: bool) -> None:
        controller = self._controller
        if number < BOX_SIGNALS:
            controller.signals.set_output(number, bit)
        elif _BOX_BITS <= number < _BOX_BITS + _TOOL_OUTPUTS:
            controller.signals.set_output(BOX_SIGNALS + number - _BOX_BITS, bit)
        elif _BRAKES <= number < _REDUCED:  # A brake is released while its motor is on.
            controller.enable((number - _BRAKES) % _JOINTS + 1, bit)
        elif number in (_REDUCED, _FENCE):
            name = "reduced" if number == _REDUCED else "fence"
            controller.configure(replace(controller.settings, **{name: bit}))
        elif number == _PAUSED:
            controller.set_state(SET_PAUSED if bit else SET_READY)
        elif number == _STOPPED:
            controller.set_state(SET_STOPPED if bit else SET_READY)
        elif _MODES <= number < _MODES + _MODE_BITS and bit:
            _require(controller.set_mode(number - _MODES))
        elif number >= _FREE:
            self._free_bits[number - _FREE] = bit


def _signal_bits(box: int, tool: int) -> list[bool]:
    bits = box | (tool & 0xFF) << _BOX_BITS
    return [bool(bits >> k & 1) for k in range(_RESERVED_BITS)]


def _part(values: Sequence, address: int, count: int) -> list:
    if address + count > len(values):
        raise ModbusError(ModbusException.ADDRESS)
    return list(values[address : address + count])


def _require(is_valid: bool) -> None:
    if not is_valid:
        raise ModbusError(ModbusException.DATA)


def _millivolts(codes: Sequence[int]) -> list[int]:
    return [round(1e3 * BOX_VOLTAGE * code / HIGHEST_CODE) for code in codes]


def _tenths(pose: Sequence[float]) -> list[int]:
    return [round(10.0 * x) for x in pose[:3]] + [round(10.0 * degrees(x)) for x in pose[3:]]
