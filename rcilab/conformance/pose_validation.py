"""Validation of commanded poses."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from rcilab.core.spatial import find_rotation_error


def find_frame_error(numbers: Sequence[float]) -> str | None:
    """Returns why 16 numbers, row-major, are not a valid pose, or None if they are."""
    a, b, c, x, d, e, f, y, g, h, i, z, *last_row = numbers
    if not isfinite(a + b + c + d + e + f + g + h + i + x + y + z):
        return "commanded pose is not all finite numbers"
    if last_row != [0.0, 0.0, 0.0, 1.0]:
        return f"commanded pose has the last row {last_row}; must be 0 0 0 1"
    error = find_rotation_error((a, b, c, d, e, f, g, h, i))
    return None if error is None else f"commanded pose {error}"
