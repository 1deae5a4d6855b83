"""Numbers as people read them."""

from __future__ import annotations


def fixed(value: float, digits: int) -> str:
    """Returns a number with so many digits behind the point; what is rounded to zero has no minus."""
    return f"{round(value, digits) + 0.0:.{digits}f}"
