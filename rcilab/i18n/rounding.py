"""Formatting of numbers."""

from __future__ import annotations


def format_fixed(value: float, digits: int) -> str:
    """Returns a number with `digits` decimals; a number that rounds to zero has no minus sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def format_pair(value: float, bound: float, min_digits: int = 4) -> tuple[str, str]:
    """Returns value and bound with the fewest digits, `min_digits` or more, that show whether they differ."""
    for digits in range(min_digits, 17):
        texts = f"{value:.{digits}g}", f"{bound:.{digits}g}"
        if texts[0] != texts[1] or value == bound:
            return texts
    return repr(value), repr(bound)
