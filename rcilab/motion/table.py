"""Tables in text files, with errors that name the line; only the numbers are kept in memory."""

from __future__ import annotations

import csv
import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import require_rows

_LONGEST_LINE = 65_536  # Characters. Tuning value: a line of ours has some hundreds.


@dataclass(frozen=True, slots=True)
class Table:
    """Cells in rows and columns, and their lines."""

    name: str
    """What to call it in an error."""
    header: list[str] | None
    """Names of the columns, when the first line names them."""
    header_line: int
    """Its line, from 1; 0 without one."""
    values: Array
    """Shape (N, columns), at least one row; NaN where a cell holds no number."""
    lines: list[int]
    """Line of each row, from 1."""
    text: str
    """Where all of it was read from."""

    @property
    def columns(self) -> int:
        """Number of columns."""
        return self.values.shape[1]

    def column(self, index: int) -> Array:
        """Returns the numbers in a column, counted from 0, shape (N,).

        Raises:
            InvalidValueError: A cell holds no finite number; the message names its line.
        """
        numbers = self.values[:, index]
        wrong = np.flatnonzero(~np.isfinite(numbers))
        if wrong.size:
            line = self.lines[int(wrong[0])]
            cell = next(_cells(text, _mark_of(self.text)) for number, text in _lines(self.text) if number == line)[
                index
            ]
            problem = f"in column {index + 1} is no finite number; decimals need a point"
            raise InvalidValueError(f"{self.name}, line {line}", cell, problem).coded("table_cell", column=index + 1)
        return numbers


def read_table(content: bytes, name: str, max_rows: int) -> Table:
    """Returns the table in a text: columns parted by semicolons, commas, tabs or blanks, whichever the first line has.

    Empty lines and lines that begin with # are passed over. The first line is a header if no cell of it is a number.

    Args:
        content: The text, UTF-8.
        name: What to call it in an error.
        max_rows: How many rows it may have.

    Raises:
        InvalidValueError: It is no text, has no rows or too many, or a line has not as many columns as the first.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = "is no text in UTF-8; save it as CSV"
        raise InvalidValueError(f"{name}, line {line}", content[error.start : error.end], problem).coded(
            "table_no_text", file=name, line=line
        ) from error
    rows = text.count("\n") + 1
    if rows > max_rows + 1000:  # Comments and a header; what counts is counted below.
        require_rows(rows, max_rows, "samples", name)
    mark = _mark_of(text)
    header, header_line, columns = None, 0, 0
    values, lines = array("d"), array("q")
    for number, line in _lines(text):
        if len(line) > _LONGEST_LINE:
            raise InvalidValueError(
                f"{name}, line {number}", len(line), f"characters are more than a line has, {_LONGEST_LINE}"
            ).coded("table_line", count=len(line), most=_LONGEST_LINE)
        cells = _cells(line, mark)
        numbers = [_number(cell) for cell in cells]
        if columns == 0:
            columns = len(cells)
            if all(math.isnan(value) and not _says_nan(cell) for cell, value in zip(cells, numbers, strict=True)):
                header, header_line = cells, number
                continue
        if len(cells) != columns:
            raise InvalidValueError(
                f"{name}, line {number}",
                len(cells),
                f"{'column' if len(cells) == 1 else 'columns'}; the first line has {columns}",
            ).coded("table_columns", count=columns)
        values.extend(numbers)
        lines.append(number)
    if not lines:
        below = " below its header" if header is not None else ""
        raise InvalidValueError("samples", name, f"holds no rows{below}").coded("table_empty", file=name)
    require_rows(len(lines), max_rows, "samples", name)
    return Table(name, header, header_line, np.array(values).reshape(-1, columns), lines.tolist(), text)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Yields the lines that count and their numbers, from 1."""
    for number, line in enumerate(StringIO(text, newline=None), 1):
        if (line := line.strip("\r\n")).strip() and not line.lstrip().startswith("#"):
            yield number, line


def _mark_of(text: str) -> str | None:
    """Returns what parts the columns; None: blanks."""
    first = next(_lines(text), (0, ""))[1]
    return next((mark for mark in ";,\t" if mark in first), None)


def _cells(line: str, mark: str | None) -> list[str]:
    cells = line.split() if mark is None else next(csv.reader([line], delimiter=mark, skipinitialspace=True))
    return [cell.strip().strip('"').strip() for cell in cells]


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _says_nan(cell: str) -> bool:
    return cell.lower().lstrip("+-") == "nan"
