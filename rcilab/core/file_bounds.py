"""Bounds for the content of a file, checked from its headers before allocation: a small file can unpack to gigabytes.

A single number bounds everything; the caller raises it for a trusted file: `max_rows` in Python, `--max-rows` in a
shell.
"""

from __future__ import annotations

from rcilab.core.errors import InvalidValueError

DEFAULT_MAX_ROWS = 1_000_000
"""Cycles of 1 ms in a motion or a run: 17 minutes. Checking a row takes 1.1 KB, so this many rows take 1.1 GB."""
ROW_BYTES = 1024
"""Largest size of a row in a file, unpacked. A cycle of a run takes 816 bytes; the rest is margin."""


def require_max_rows(max_rows: object) -> int:
    """Returns a valid bound.

    Raises:
        InvalidValueError: It is not a whole number above 0.
    """
    if isinstance(max_rows, bool) or not isinstance(max_rows, int) or max_rows < 1:
        raise InvalidValueError("max_rows", max_rows, "must be a whole number of 1 ms cycles above 0")
    return max_rows


def require_rows(rows: int, max_rows: int, what: str, name: str) -> None:
    """Rejects a file with too many rows.

    Args:
        rows: Number of rows according to its header.
        max_rows: Largest allowed number of rows.
        what: Kind of file, for the error.
        name: Name of the file in the error.

    Raises:
        InvalidValueError: There are too many; the message names the option that allows them.
    """
    if rows > max_rows:
        raise InvalidValueError(
            f"{what} {name!r}",
            rows,
            f"rows of 1 ms are more than {max_rows}; to allow them, pass max_rows={rows} (in a shell: --max-rows "
            f"{rows})",
        ).coded("file_rows", file=name, count=rows, most=max_rows)


def require_bytes(size: int, max_rows: int, what: str, name: str) -> None:
    """Rejects a file whose unpacked `size`, [bytes], is too large; the other arguments as for `require_rows`.

    Raises:
        InvalidValueError: It is too large; the message names the option that allows it.
    """
    most = max_rows * ROW_BYTES
    if size > most:
        rows = -(-size // ROW_BYTES)
        raise InvalidValueError(
            f"{what} {name!r}",
            round(size / 1e6, 1),
            f"MB, unpacked, are more than {most / 1e6:.1f}; to allow them, pass max_rows={rows} (in a shell: "
            f"--max-rows {rows})",
        ).coded("file_large", file=name, size=f"{size / 1e6:.1f}", most=f"{most / 1e6:.1f}")
