"""Requests about signals and the serial bus of the tool."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from struct import unpack
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.makers.ufactory.controller.gripper import GRIPPER_ID
from rcilab.makers.ufactory.controller.settings import MILLIMETRE
from rcilab.makers.ufactory.controller.signals import BOX_SIGNALS, TOOL_SIGNALS
from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.ufactory.wire.functions import Function, encode_values
from rcilab.makers.ufactory.wire.modbus import ModbusError

TOOL_HOST = 9
_BAUD, _BAUD_TO_WRITE, _INPUT_3, _INPUTS, _OUTPUTS_TO_SET, _ANALOG, _OUTPUTS = (
    0x0A0B, 0x1A0B, 0x0A12, 0x0A14, 0x0A15, (0x0A16, 0x0A17), 0x0A18,
)  # fmt: skip
"""Registers of the tool's board."""
_VERSION = (0x0801, 0x0802, 0x0803)
_BAUD_2M = 10  # Index of 2 Mbit/s in the client library, the rate of the maker's gripper.
_FIFTH = 4  # The tool's third signal: the fifth bit of its registers.


class Act(NamedTuple):
    """Something done at once, or when its turn in the queue comes."""

    run: Callable[[], None]
    is_queued: bool = False


IoReply: TypeAlias = bytes | Act


class _Delayed(NamedTuple):
    cycle: int
    run: Callable[[], None]


class _AtPosition(NamedTuple):
    position: np.ndarray
    """In the user frame, [mm]."""
    radius: float
    """[mm]."""
    run: Callable[[], None]


class IoRequests:
    """Carries out requests about signals. Owned by the server.

    Args:
        controller: The controller.
    """

    def __init__(self, controller: XArmController) -> None:
        self.controller = controller
        self._baud = _BAUD_2M
        self._delayed: list[_Delayed] = []
        self._at_positions: list[_AtPosition] = []

    def step(self) -> None:
        """Does what is due in this cycle."""
        if self._delayed:
            now = self.controller.cycle_number
            due = [item for item in self._delayed if item.cycle <= now]
            self._delayed = [item for item in self._delayed if item.cycle > now]
            for item in due:
                item.run()
        if self._at_positions:
            user = self.controller.settings.T_base_user.inverse()
            position = (user @ self.controller.arm.tool_c.pose).position / MILLIMETRE
            waiting: list[_AtPosition] = []
            for item in self._at_positions:
                if float(np.linalg.norm(position - item.position)) <= item.radius:
                    item.run()
                else:
                    waiting.append(item)
            self._at_positions = waiting

    def set_bits(self, words: tuple[int, ...], first: int, sync: bool) -> Act:
        """Sets outputs: a word of eight has the outputs that change in its upper byte, their levels in the lower."""
        signals = self.controller.signals

        def run() -> None:
            for k, word in enumerate(words):
                for bit in range(8):
                    if word >> (8 + bit) & 1:
                        signals.set_output(first + 8 * k + bit, bool(word >> bit & 1))

        return Act(run, sync)

    def set_outputs(self, payload: bytes) -> Act:
        """Sets outputs of the control box: a word, or two, and whether they wait for the motions before them."""
        words = unpack(f">{len(payload) // 2}H", payload[: len(payload) // 2 * 2])
        if not 1 <= len(words) <= 2:
            raise InvalidValueError("outputs", payload.hex(" "), "must be one or two words")
        return self.set_bits(words, 0, bool(payload[-1]) if len(payload) % 2 else True)

    def set_analog(self, signal: int, code: int, sync: bool) -> Act:
        """Sets an analog output."""
        return Act(lambda: self.controller.signals.set_analog(signal, code), sync)

    def delay(self, signal: int, level: bool, seconds: float) -> Act:
        """Sets an output later."""
        if not 0.0 <= seconds < 1e6:
            raise InvalidValueError("delay", seconds, "must be 0 or more [s]")
        cycle = self.controller.cycle_number + round(seconds / CYCLE_TIME)
        run = self._setter(signal, level)
        return Act(lambda: self._delayed.append(_Delayed(cycle, run)))

    def at_position(self, run: Callable[[], None], numbers: tuple[float, ...]) -> Act:
        """Sets an output where the tool comes near a position."""
        *position, radius = numbers
        item = _AtPosition(np.array(position), radius, run)
        return Act(lambda: self._at_positions.append(item))

    def setter_at(self, signal: int, level: bool, numbers: tuple[float, ...]) -> Act:
        """Sets a digital output near a position."""
        return self.at_position(self._setter(signal, level), numbers)

    def _setter(self, signal: int, level: bool) -> Callable[[], None]:
        if not 0 <= signal < BOX_SIGNALS + TOOL_SIGNALS:
            raise InvalidValueError("output", signal, "does not exist")
        return lambda: self.controller.signals.set_output(signal, level)

    def write_tool(self, host: int, address: int, value: float, sync: bool) -> IoReply:
        """Writes a register of the tool's board, or of the gripper behind it."""
        number = _whole(value, 16)
        if host == GRIPPER_ID:
            self._write_gripper(address, [number])
        elif address == _OUTPUTS_TO_SET:
            return self.set_bits((number,), BOX_SIGNALS, sync)
        elif address in (_BAUD, _BAUD_TO_WRITE):
            self._baud = number
        return b""

    def write_tool_32(self, host: int, address: int, value: float) -> bytes:
        """Writes a target of the gripper."""
        number = _whole(value, 32)
        if host == GRIPPER_ID:
            self._write_gripper(address, [number >> 16, number & 0xFFFF])
        return b""

    def read_tool(self, host: int, address: int, registers: int = 1) -> bytes:
        """Returns a register of the tool's board, or of the gripper behind it, as 32 bits."""
        signals = self.controller.signals
        if host == GRIPPER_ID:
            with _known_register(address):
                found = self.controller.gripper.read_holding(address, registers)
            return encode_values("H", *([0] * (2 - registers) + found))
        values = {
            _BAUD: self._baud,
            _INPUTS: signals.tool_inputs & 0x0F,
            _INPUT_3: signals.tool_inputs >> _FIFTH & 1,
            _OUTPUTS: signals.tool_outputs,
            **dict.fromkeys(_VERSION, 1),
        }
        return encode_values("i", values.get(address, 0))

    def _write_gripper(self, address: int, registers: list[int]) -> None:
        with _known_register(address):
            self.controller.gripper.write_holding(address, registers)

    def pass_on(self, payload: bytes) -> bytes:
        """Returns the answer of a device on the serial bus: its host, and its frame; b"" if none answers."""
        if payload[:1] == bytes([TOOL_HOST]) and payload[1:2] == bytes([GRIPPER_ID]):
            return payload[:1] + self.controller.gripper.answer(payload[1:])
        return b""

    def state(self) -> bytes:
        """Returns the state of the control box's signals."""
        signals = self.controller.signals
        words = (0, signals.box_inputs, 0, signals.box_outputs, *signals.analog_inputs, *signals.analog_outputs)
        ins, outs = signals.input_functions, signals.output_functions
        return bytes(2) + encode_values("H", *words) + bytes([*ins[:8], *outs[:8], *ins[8:], *outs[8:]])

    def set_function(self, functions: list[int], signal: int, function: int) -> bytes:
        """Sets the function of an input or output."""
        if not 0 <= signal < BOX_SIGNALS:
            raise InvalidValueError("signal", signal, f"does not exist; known: 0 to {BOX_SIGNALS - 1}")
        functions[signal] = function
        return b""


def _whole(value: float, bits: int) -> int:
    """Returns a number that the client sends as a float as the bits of a register, of either sign."""
    least, most = -(1 << bits - 1), (1 << bits) - 1
    if not least <= value <= most:
        raise InvalidValueError("register value", value, f"must be {least} to {most}")
    return round(value) & most


@contextmanager
def _known_register(address: int) -> Iterator[None]:
    """Raises InvalidValueError where the gripper has no such register."""
    try:
        yield
    except ModbusError:
        raise InvalidValueError("register", f"0x{address:04x}", "does not exist in the gripper") from None


def _sync(values: tuple[Any, ...], at: int) -> bool:
    """Returns whether an output waits for the motions before it; without the byte, it does."""
    return bool(values[at]) if len(values) > at else True


def _tool(signal: int) -> int:
    """Returns the number among all signals of a tool's one in delayed requests."""
    return BOX_SIGNALS + signal


_Handler: TypeAlias = Callable[[IoRequests, tuple[Any, ...]], IoReply]
IO_HANDLERS: dict[Function, _Handler] = {
    Function.SET_TOOL_MODBUS_TIMEOUT: lambda io, v: b"",
    Function.GET_TOOL_ERROR: lambda io, v: bytes(2),
    Function.RS485: lambda io, v: io.pass_on(v[0]),
    Function.TOOL_WRITE_16: lambda io, v: io.write_tool(v[0], v[1], v[2], _sync(v, 3)),
    Function.TOOL_READ_16: lambda io, v: io.read_tool(*v),
    Function.TOOL_WRITE_32: lambda io, v: io.write_tool_32(*v),
    Function.TOOL_READ_32: lambda io, v: io.read_tool(*v, registers=2),
    Function.GET_INPUTS: lambda io, v: encode_values("H", io.controller.signals.box_inputs),
    Function.GET_ANALOG_1: lambda io, v: encode_values("H", io.controller.signals.analog_inputs[0]),
    Function.GET_ANALOG_2: lambda io, v: encode_values("H", io.controller.signals.analog_inputs[1]),
    Function.SET_OUTPUTS: lambda io, v: io.set_outputs(v[0]),
    Function.SET_ANALOG_1: lambda io, v: io.set_analog(0, v[0], _sync(v, 1)),
    Function.SET_ANALOG_2: lambda io, v: io.set_analog(1, v[0], _sync(v, 1)),
    Function.SET_INPUT_FUNCTION: lambda io, v: io.set_function(io.controller.signals.input_functions, *v),
    Function.SET_OUTPUT_FUNCTION: lambda io, v: io.set_function(io.controller.signals.output_functions, *v),
    Function.GET_IO_STATE: lambda io, v: io.state(),
    Function.DELAYED_OUTPUT: lambda io, v: io.delay(v[0], bool(v[1]), v[2]),
    Function.DELAYED_TOOL_OUTPUT: lambda io, v: io.delay(_tool(v[0]), bool(v[1]), v[2]),
    Function.OUTPUT_AT_POSITION: lambda io, v: io.setter_at(v[0], bool(v[1]), v[2:]),
    Function.TOOL_OUTPUT_AT_POSITION: lambda io, v: io.setter_at(_tool(v[0]), bool(v[1]), v[2:]),
    Function.ANALOG_AT_POSITION: lambda io, v: io.at_position(io.set_analog(v[0] & 1, v[1], False).run, v[2:]),
}
"""What each function does."""
