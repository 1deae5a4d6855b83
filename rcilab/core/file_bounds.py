"""How much a file may hold, known from its headers before room is made for it: a few kilobytes can unpack to anything.

One number bounds everything, and whoever trusts a file raises it: `max_rows` in Python, `--max-rows` in a shell.
"""

from __future__ import annotations

from rcilab.core.errors import InvalidValueError

MOST_ROWS = 1_000_000
"""Cycles of 1 ms in a motion or a run: 17 minutes. Tuning value: to judge a row takes 1.1 KB, so all of them 1.1 GB."""
ROW_BYTES = 1024
"""What a row may take in a file, unpacked. Tuning value: a cycle of a run takes 816 bytes."""


def require_max_rows(max_rows: object) -> int:
    """Returns a bound that can be one.

    Raises:
        InvalidValueError: It is no whole number above 0.
    """
    if isinstance(max_rows, bool) or not isinstance(max_rows, int) or max_rows < 1:
        raise InvalidValueError("max_rows", max_rows, "must be a whole number above 0: cycles of 1 ms")
    return max_rows


def require_rows(rows: int, max_rows: int, what: str, name: str) -> None:
    """Refuses a file of too many rows.

    Args:
        rows: How many it says that it holds.
        max_rows: How many it may hold.
        what: What it is, for the error.
        name: What to call it in the error.

    Raises:
        InvalidValueError: They are too many; the message says how to take it nevertheless.
    """
    if rows > max_rows:
        raise InvalidValueError(
            f"{what} {name!r}",
            rows,
            f"rows of 1 ms are more than {max_rows}; if that is meant, pass max_rows={rows} (in a shell --max-rows "
            f"{rows})",
        ).coded("file_rows", file=name, count=rows, most=max_rows)


def require_bytes(size: int, max_rows: int, what: str, name: str) -> None:
    """Refuses a file that takes too much room, unpacked; `size` in bytes, the rest as of `require_rows`.

    Raises:
        InvalidValueError: It is too large; the message says how to take it nevertheless.
    """
    most = max_rows * ROW_BYTES
    if size > most:
        rows = -(-size // ROW_BYTES)
        raise InvalidValueError(
            f"{what} {name!r}",
            round(size / 1e6, 1),
            f"MB, unpacked, are more than {most / 1e6:.1f}; if that is meant, pass max_rows={rows} (in a shell "
            f"--max-rows {rows})",
        ).coded("file_large", file=name, size=f"{size / 1e6:.1f}", most=f"{most / 1e6:.1f}")
