"""Tables in text, with the line of everything that is wrong."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass

import numpy as np

from rcilab.arrays import Array
from rcilab.errors import InvalidValueError


@dataclass(frozen=True, slots=True)
class Table:
    """Cells in rows and columns, and where they stood."""

    name: str
    """What to call it in an error."""
    header: list[str] | None
    """Names of the columns, when the first line names them."""
    header_line: int
    """Its line, from 1; 0 without one."""
    rows: list[list[str]]
    """At least one, all of the same length."""
    lines: list[int]
    """Line of each row, from 1."""

    @property
    def columns(self) -> int:
        """Number of columns."""
        return len(self.rows[0])

    def column(self, index: int) -> Array:
        """Returns the numbers in a column, counted from 0, shape (N,).

        Raises:
            InvalidValueError: A cell holds no finite number; the message names its line.
        """
        numbers = [_number(row[index]) for row in self.rows]
        for line, row, number in zip(self.lines, self.rows, numbers, strict=True):
            if number is None or not math.isfinite(number):
                problem = f"in column {index + 1} is no finite number; decimals need a point"
                raise InvalidValueError(f"{self.name}, line {line}", row[index], problem).coded(
                    "table_cell", column=index + 1
                )
        return np.array(numbers, dtype=np.float64)


def read_table(content: bytes, name: str) -> Table:
    """Returns the table in a text: columns parted by semicolons, commas, tabs or blanks, whichever the first line has.

    Empty lines and lines that begin with # are passed over. The first line is a header if no cell of it is a number.

    Args:
        content: The text, UTF-8.
        name: What to call it in an error.

    Raises:
        InvalidValueError: It is no text, has no rows, or a line has not as many columns as the first.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = "is no text in UTF-8; save it as CSV"
        raise InvalidValueError(f"{name}, line {line}", content[error.start : error.end], problem).coded(
            "table_no_text", file=name, line=line
        ) from error
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    if not lines:
        raise InvalidValueError("samples", name, "holds no rows").coded("table_empty", file=name)
    mark = next((mark for mark in ";,\t" if mark in lines[0][1]), None)
    rows = [(number, _cells(line, mark)) for number, line in lines]
    header_line, header = 0, None
    if all(_number(cell) is None for cell in rows[0][1]):
        header_line, header = rows[0]
        rows = rows[1:]
        if not rows:
            raise InvalidValueError("samples", name, "holds no rows below its header").coded("table_empty", file=name)
    columns = len(header if header is not None else rows[0][1])
    for number, cells in rows:
        if len(cells) != columns:
            raise InvalidValueError(
                f"{name}, line {number}", len(cells), f"columns; the first line has {columns}"
            ).coded("table_columns", count=columns)
    return Table(name, header, header_line, [cells for _, cells in rows], [number for number, _ in rows])


def _cells(line: str, mark: str | None) -> list[str]:
    cells = line.split() if mark is None else next(csv.reader([line], delimiter=mark, skipinitialspace=True))
    return [cell.strip().strip('"').strip() for cell in cells]


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
