"""Standard Modbus: requests of its functions answered from a memory of bits and registers.

Functions 1, 2, 3, 4, 5, 6, 15, 16, 22 and 23. What a memory does with a written value is its own affair.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntEnum
from struct import Struct, error, unpack
from typing import Protocol

_MOST_BITS, _MOST_REGISTERS = 2000, 125  # Of one request, as in the standard.
_ON, _OFF = 0xFF00, 0x0000


class ModbusException(IntEnum):
    """Why a request is refused."""

    FUNCTION = 1
    ADDRESS = 2
    DATA = 3
    DEVICE = 4


class ModbusError(Exception):
    """A request is refused.

    Attributes:
        code: Why.
    """

    def __init__(self, code: ModbusException) -> None:
        super().__init__(code.name)
        self.code = code


class ModbusMemory(Protocol):
    """What Modbus reads and writes. Every method raises `ModbusError` for addresses that it has not."""

    def read_coils(self, address: int, count: int) -> Sequence[bool]:
        """Returns bits that can be written."""
        ...

    def read_inputs(self, address: int, count: int) -> Sequence[bool]:
        """Returns bits that can only be read."""
        ...

    def read_holding(self, address: int, count: int) -> Sequence[int]:
        """Returns registers that can be written, 0 to 65535."""
        ...

    def read_registers(self, address: int, count: int) -> Sequence[int]:
        """Returns registers that can only be read, 0 to 65535."""
        ...

    def write_coils(self, address: int, bits: Sequence[bool]) -> None:
        """Writes bits."""
        ...

    def write_holding(self, address: int, registers: Sequence[int]) -> None:
        """Writes registers."""
        ...


def answer_modbus(pdu: bytes, memory: ModbusMemory) -> bytes:
    """Returns the response to a request; any bytes have one.

    Args:
        pdu: Function code and data.
        memory: Where the values are.
    """
    function = pdu[0] if pdu else 0
    handler = _HANDLERS.get(function)
    try:
        if handler is None:
            raise ModbusError(ModbusException.FUNCTION)
        return bytes([function]) + handler(pdu[1:], memory)
    except error:  # Too short for its function.
        return refuse_modbus(pdu, ModbusException.DATA)
    except ModbusError as refusal:
        return refuse_modbus(pdu, refusal.code)


def refuse_modbus(pdu: bytes, code: ModbusException) -> bytes:
    """Returns the response to a request that is refused."""
    return bytes([(pdu[0] if pdu else 0) | 0x80, code])


def _counted(data: bytes, most: int) -> tuple[int, int]:
    address, count = unpack(">HH", data)
    if not 1 <= count <= most:
        raise ModbusError(ModbusException.DATA)
    return address, count


def _bits(read: Callable[[ModbusMemory, int, int], Sequence[bool]]) -> Callable[[bytes, ModbusMemory], bytes]:
    def answer(data: bytes, memory: ModbusMemory) -> bytes:
        address, count = _counted(data, _MOST_BITS)
        number = sum(bool(bit) << k for k, bit in enumerate(read(memory, address, count)))
        content = number.to_bytes((count + 7) // 8, "little")
        return bytes([len(content)]) + content

    return answer


def _registers(read: Callable[[ModbusMemory, int, int], Sequence[int]]) -> Callable[[bytes, ModbusMemory], bytes]:
    def answer(data: bytes, memory: ModbusMemory) -> bytes:
        return _encode_registers(read(memory, *_counted(data, _MOST_REGISTERS)))

    return answer


def _encode_registers(values: Sequence[int]) -> bytes:
    return bytes([2 * len(values)]) + Struct(f">{len(values)}H").pack(*values)


def _write_coil(data: bytes, memory: ModbusMemory) -> bytes:
    address, value = unpack(">HH", data)
    if value not in (_ON, _OFF):
        raise ModbusError(ModbusException.DATA)
    memory.write_coils(address, [value == _ON])
    return data


def _write_register(data: bytes, memory: ModbusMemory) -> bytes:
    address, value = unpack(">HH", data)
    memory.write_holding(address, [value])
    return data


def _write_coils(data: bytes, memory: ModbusMemory) -> bytes:
    address, count = _counted(data[:4], _MOST_BITS)
    content = data[5:]
    if len(data) < 5 or data[4] != len(content) or len(content) != (count + 7) // 8:
        raise ModbusError(ModbusException.DATA)
    number = int.from_bytes(content, "little")
    memory.write_coils(address, [bool(number >> k & 1) for k in range(count)])
    return data[:4]


def _write_registers(data: bytes, memory: ModbusMemory) -> bytes:
    address, count = _counted(data[:4], _MOST_REGISTERS)
    memory.write_holding(address, _decode_registers(data[4:], count))
    return data[:4]


def _decode_registers(data: bytes, count: int) -> tuple[int, ...]:
    if not data or data[0] != 2 * count or len(data) != 1 + 2 * count:
        raise ModbusError(ModbusException.DATA)
    return unpack(f">{count}H", data[1:])


def _mask_register(data: bytes, memory: ModbusMemory) -> bytes:
    address, keep, put = unpack(">HHH", data)
    (value,) = memory.read_holding(address, 1)
    # As in the standard; the maker's document has the second mask instead of the value.
    memory.write_holding(address, [(value & keep) | (put & ~keep & 0xFFFF)])
    return data


def _write_and_read(data: bytes, memory: ModbusMemory) -> bytes:
    address, count = _counted(data[:4], _MOST_REGISTERS)
    target, written = _counted(data[4:8], _MOST_REGISTERS)
    memory.write_holding(target, _decode_registers(data[8:], written))
    return _encode_registers(memory.read_holding(address, count))


_HANDLERS: dict[int, Callable[[bytes, ModbusMemory], bytes]] = {
    1: _bits(lambda memory, address, count: memory.read_coils(address, count)),
    2: _bits(lambda memory, address, count: memory.read_inputs(address, count)),
    3: _registers(lambda memory, address, count: memory.read_holding(address, count)),
    4: _registers(lambda memory, address, count: memory.read_registers(address, count)),
    5: _write_coil,
    6: _write_register,
    15: _write_coils,
    16: _write_registers,
    22: _mask_register,
    23: _write_and_read,
}
