"""A packed message as a table of fields, and its encoder and decoder.

A table follows the description of a wire: one row per field, its offset given by the rows above it. Byte order is given
per field, because some wires mix them in one datagram.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from struct import Struct
from typing import Literal, TypeAlias

from rcilab.core.errors import DecodeError

FieldType: TypeAlias = Literal["u8", "flag", "u16", "u32", "i32", "u64", "f64"]
ByteOrder: TypeAlias = Literal["little", "big"]
Scalar: TypeAlias = int | float

_STRUCT_CODES = {"u8": "B", "flag": "?", "u16": "H", "u32": "I", "i32": "i", "u64": "Q", "f64": "d"}
_SIZES = {"u8": 1, "flag": 1, "u16": 2, "u32": 4, "i32": 4, "u64": 8, "f64": 8}
_ORDER_CODES = {"little": "<", "big": ">"}


@dataclass(frozen=True, slots=True)
class Field:
    """One row of a layout table."""

    name: str
    type: FieldType
    count: int = 1
    unit: str = ""
    order: ByteOrder = "little"
    """Byte order; without meaning for single bytes."""

    @property
    def size(self) -> int:
        """Size of the field, in bytes."""
        return _SIZES[self.type] * self.count


class Layout:
    """The compiled form of a table: the offset of each field, and how to pack and unpack a whole message.

    Args:
        name: Name of the message, for errors.
        fields: Its rows, first to last; packed, no padding.
    """

    def __init__(self, name: str, fields: Sequence[Field]) -> None:
        self.name = name
        self.fields = tuple(fields)
        self._offsets: dict[str, int] = {}
        offset = 0
        for field in self.fields:
            self._offsets[field.name] = offset
            offset += field.size
        self.size = offset
        self.structs = tuple(
            Struct(_ORDER_CODES[order] + "".join(f"{f.count}{_STRUCT_CODES[f.type]}" for f in run))
            for order, run in groupby(self.fields, key=lambda field: field.order)
        )
        """One compiled format for each run of fields of one byte order."""

    def offset(self, name: str) -> int:
        """Returns the offset of a field, in bytes from the start of the message."""
        return self._offsets[name]

    def pack(self, values: Sequence[Scalar | Sequence[Scalar]]) -> bytes:
        """Returns the message with one value (or one sequence of `count` values) per field."""
        flat: list[Scalar] = []
        for value in values:
            if isinstance(value, int | float):
                flat.append(value)
            else:
                flat.extend(value)
        parts: list[bytes] = []
        for struct in self.structs:
            count = len(struct.unpack(bytes(struct.size)))
            parts.append(struct.pack(*flat[:count]))
            del flat[:count]
        return b"".join(parts)

    def unpack(self, data: bytes, offset: int = 0) -> list[Scalar | tuple[Scalar, ...]]:
        """Returns one value per field: a number, or a tuple of `count` numbers if count is more than 1.

        Raises:
            DecodeError: The message does not fill `data` from `offset` to its end exactly.
        """
        if len(data) != offset + self.size:
            raise DecodeError(
                f"{self.name}: {len(data) - offset} bytes, needs {self.size}", min(len(data), offset + self.size)
            )
        flat: list[Scalar] = []
        place = offset
        for struct in self.structs:
            flat.extend(struct.unpack_from(data, place))
            place += struct.size
        values: list[Scalar | tuple[Scalar, ...]] = []
        index = 0
        for field in self.fields:
            values.append(flat[index] if field.count == 1 else tuple(flat[index : index + field.count]))
            index += field.count
        return values
