"""Whether sixteen numbers are the pose of a tool."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from rcilab.core.spatial import find_rotation_error


def find_frame_error(numbers: Sequence[float]) -> str | None:
    """Returns why 16 numbers, row-major, are no pose of a tool, or None when they are one."""
    a, b, c, x, d, e, f, y, g, h, i, z, *last_row = numbers
    if not isfinite(a + b + c + d + e + f + g + h + i + x + y + z):
        return "commanded pose is not all finite numbers"
    if last_row != [0.0, 0.0, 0.0, 1.0]:
        return f"commanded pose has {last_row} as its last row; needs 0 0 0 1"
    error = find_rotation_error((a, b, c, d, e, f, g, h, i))
    return None if error is None else f"commanded pose {error}"
