"""The maker's standard gripper at the tool's serial bus: registers, and a jaw that moves with its speed.

Its requests are frames of Modbus RTU without their checksum, which the controller adds.
"""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.ufactory.wire.modbus import ModbusError, ModbusException, answer_modbus

GRIPPER_ID = 8
OPEN = 850  # Position of the open jaw; 0 is closed.
_DEFAULT_SPEED = 5000  # [pulses/s] As after `set_gripper_speed(5000)` in the maker's examples.
_PULSES_PER_POSITION = 18.28
"""Speed register to positions, so that the highest speed of the manual, 5000, opens the jaw in about 3 s; tuned."""
_STATUS, _CURRENT_SPEED, _ERROR = 0x0000, 0x0001, 0x000F
_ENABLE, _MODE, _RESET_ERROR, _SPEED = 0x0100, 0x0101, 0x0109, 0x0303
_TARGET, _POSITION, _VERSION, _ZERO = 0x0700, 0x0702, 0x0801, 0x0817
_FIRMWARE = (3, 4, 3)  # The first with a status register.
_MOVING, _STOPPED = 1, 0
_WRITABLE = {_ENABLE, _MODE, _RESET_ERROR, _SPEED, _TARGET, _TARGET + 1, _ZERO}


class Gripper:
    """The gripper. Owned by the controller; a `ModbusMemory` of its registers.

    Attributes:
        position: Of the jaw, 0 closed to 850 open.
    """

    def __init__(self) -> None:
        self.position = float(OPEN)
        self._target = float(OPEN)
        self._registers = dict.fromkeys(_WRITABLE, 0) | {_SPEED: _DEFAULT_SPEED}

    @property
    def is_moving(self) -> bool:
        """Whether the jaw moves."""
        return self.position != self._target

    def step(self) -> None:
        """Advances by one cycle."""
        if self.position != self._target and self._registers[_ENABLE]:
            step = self._registers[_SPEED] / _PULSES_PER_POSITION * CYCLE_TIME
            off = self._target - self.position
            self.position = self._target if abs(off) <= step else self.position + (step if off > 0.0 else -step)

    def answer(self, request: bytes) -> bytes:
        """Returns the answer to a frame: its address, function and data."""
        return request[:1] + answer_modbus(request[1:], self)

    def read_holding(self, address: int, count: int) -> list[int]:
        """Returns registers."""
        return [self._read(address + k) for k in range(count)]

    def write_holding(self, address: int, registers: Sequence[int]) -> None:
        """Writes registers; a target is signed, 32 bits."""
        for k, value in enumerate(registers):
            if address + k not in _WRITABLE:
                raise ModbusError(ModbusException.ADDRESS)
            self._registers[address + k] = value
        if address == _TARGET and len(registers) == 2:
            number = (registers[0] << 16 | registers[1]) - (registers[0] >> 15 << 32)
            self._target = float(min(max(number, -10), OPEN))

    def read_coils(self, address: int, count: int) -> list[bool]:
        """Raises ModbusError: it has none."""
        raise ModbusError(ModbusException.ADDRESS)

    read_inputs = read_coils

    def read_registers(self, address: int, count: int) -> list[int]:
        """Returns the same registers as `read_holding`."""
        return self.read_holding(address, count)

    def write_coils(self, address: int, bits: object) -> None:
        """Raises ModbusError: it has none."""
        raise ModbusError(ModbusException.ADDRESS)

    def _read(self, address: int) -> int:
        if address in _WRITABLE:
            return self._registers[address]
        if address == _STATUS:
            return _MOVING if self.is_moving else _STOPPED
        if address in (_CURRENT_SPEED, _ERROR):
            return 0
        if address in (_POSITION, _POSITION + 1):
            number = round(self.position) & 0xFFFFFFFF
            return number >> 16 if address == _POSITION else number & 0xFFFF
        if _VERSION <= address < _VERSION + len(_FIRMWARE):
            return _FIRMWARE[address - _VERSION]
        raise ModbusError(ModbusException.ADDRESS)
