"""Whether sixteen numbers are the pose of a tool."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

FRAME_TOLERANCE = 1e-5  # How far rows may be from unit length and perpendicular; the vendor's client uses the same.


def find_frame_error(numbers: Sequence[float]) -> str | None:
    """Returns why 16 numbers, row-major, are no pose of a tool, or None when they are one."""
    a, b, c, x, d, e, f, y, g, h, i, z, *last_row = numbers
    if not isfinite(a + b + c + d + e + f + g + h + i + x + y + z):
        return "commanded pose is not all finite numbers"
    if last_row != [0.0, 0.0, 0.0, 1.0]:
        return f"commanded pose has {last_row} as its last row; needs 0 0 0 1"
    off = max(
        abs(a * a + b * b + c * c - 1.0),
        abs(d * d + e * e + f * f - 1.0),
        abs(g * g + h * h + i * i - 1.0),
        abs(a * d + b * e + c * f),
        abs(a * g + b * h + c * i),
        abs(d * g + e * h + f * i),
    )
    if off > FRAME_TOLERANCE:
        return f"commanded pose holds no rotation: its rows are off by {off:.3g}, {FRAME_TOLERANCE:g} is allowed"
    if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0:
        return "commanded pose holds a reflection, not a rotation"
    return None
