"""Numbers as people read them."""

from __future__ import annotations


def fixed(value: float, digits: int) -> str:
    """Returns a number with so many digits behind the point; what is rounded to zero has no minus."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def amount(value: float, bound: float, least: int = 4) -> tuple[str, str]:
    """Returns value and bound with as few digits, from `least` on, as show that they differ."""
    for digits in range(least, 17):
        texts = f"{value:.{digits}g}", f"{bound:.{digits}g}"
        if texts[0] != texts[1] or value == bound:
            return texts
    return repr(value), repr(bound)
