"""Tables of numbers in text files, with errors that name the line."""

from __future__ import annotations

import csv
import math
import re
from array import array
from codecs import BOM_UTF8
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import require_bytes, require_rows

_LONGEST_LINE = 65_536  # [bytes] Tuning value: a line written by rcilab has some hundreds.
_MAX_COLUMNS = 1024  # Tuning value: the table of a run with the complete state has 200.
_LINE = re.compile(rb"([^\r\n]{0,%d})(?:\r\n|\r|\n|\Z|(?=[^\r\n]))" % (_LONGEST_LINE + 1))


@dataclass(frozen=True, slots=True)
class Table:
    """The numbers of a table, and the line of each row."""

    name: str
    """Name of the file, for errors."""
    header: list[str] | None
    """Names of the columns; None without a header line."""
    header_line: int
    """Line of the header, from 1; 0 without one."""
    values: Array
    """Shape (N, columns), at least one row; NaN for a cell that is not a number."""
    lines: list[int]
    """Line of each row, from 1."""
    content: bytes
    """The whole text, UTF-8."""

    @property
    def columns(self) -> int:
        """Number of columns."""
        return self.values.shape[1]

    def column(self, index: int) -> Array:
        """Returns the numbers in a column, counted from 0, shape (N,).

        Raises:
            InvalidValueError: A cell is not a finite number; the message names its line.
        """
        numbers = self.values[:, index]
        invalid = np.flatnonzero(~np.isfinite(numbers))
        if invalid.size:
            line = self.lines[int(invalid[0])]
            separator = _separator_of(self.content, self.name)
            lines = _data_lines(self.content, self.name)
            cell = next(_cells(text, separator) for number, text in lines if number == line)[index]
            problem = f"in column {index + 1} is not a finite number; use a point for decimals"
            raise InvalidValueError(f"{self.name}, line {line}", cell, problem).coded("table_cell", column=index + 1)
        return numbers


def read_table(content: bytes, name: str, max_rows: int) -> Table:
    """Returns the table in a text; columns are separated by semicolons, commas, tabs or spaces, as in the first line.

    Empty lines and lines that begin with # are skipped. The first line is a header if none of its cells is a number.

    Args:
        content: The text, UTF-8.
        name: Name of the file, for errors.
        max_rows: Largest number of rows.

    Raises:
        InvalidValueError: The content is not text, has no rows or too many, or lines differ in their number of columns.
    """
    rows = max(content.count(b"\n"), content.count(b"\r")) + 1
    if rows > max_rows + 1000:  # With room for comments and a header; the rows are counted below.
        require_rows(rows, max_rows, "samples", name)
    separator = _separator_of(content, name)
    header, header_line, columns = None, 0, 0
    values, lines = array("d"), array("q")
    for number, line in _data_lines(content, name):
        cells = _cells(line, separator)
        numbers = [_number(cell) for cell in cells]
        if columns == 0:
            columns = len(cells)
            if columns > _MAX_COLUMNS:
                raise InvalidValueError(f"{name}, line {number}", columns, f"columns are more than {_MAX_COLUMNS}")
            require_bytes(rows * columns * values.itemsize, max_rows, "samples", name)
            if all(math.isnan(value) and not _is_nan_text(cell) for cell, value in zip(cells, numbers, strict=True)):
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
        detail = " below the header" if header is not None else ""
        raise InvalidValueError("samples", name, f"has no rows{detail}").coded("table_empty", file=name)
    require_rows(len(lines), max_rows, "samples", name)
    return Table(name, header, header_line, np.frombuffer(values).reshape(-1, columns), lines.tolist(), content)


def _data_lines(content: bytes, name: str) -> Iterator[tuple[int, str]]:
    """Yields the number, from 1, and the text of each line that is neither empty nor a comment.

    Raises:
        InvalidValueError: A line is not text, or too long.
    """
    start = len(BOM_UTF8) if content.startswith(BOM_UTF8) else 0
    for number, match in enumerate(_LINE.finditer(content, start), 1):
        if match.end(1) - match.start(1) > _LONGEST_LINE:
            ends = (content.find(end, match.end(1)) for end in (b"\r", b"\n"))
            size = min((end for end in ends if end >= 0), default=len(content)) - match.start(1)
            raise InvalidValueError(
                f"{name}, line {number}", size, f"characters are more than the {_LONGEST_LINE} allowed in a line"
            ).coded("table_line", count=size, most=_LONGEST_LINE)
        try:
            line = match[1].decode()
        except UnicodeDecodeError as error:
            problem = "is not UTF-8 text; save the file as CSV"
            raise InvalidValueError(f"{name}, line {number}", match[1][error.start : error.end], problem).coded(
                "table_no_text", file=name, line=number
            ) from error
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def _separator_of(content: bytes, name: str) -> str | None:
    """Returns the column separator; None is white space."""
    first = next(_data_lines(content, name), (0, ""))[1]
    return next((separator for separator in ";,\t" if separator in first), None)


def _cells(line: str, separator: str | None) -> list[str]:
    cells = line.split() if separator is None else next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return [cell.strip().strip('"').strip() for cell in cells]


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _is_nan_text(cell: str) -> bool:
    return cell.lower().lstrip("+-") == "nan"
