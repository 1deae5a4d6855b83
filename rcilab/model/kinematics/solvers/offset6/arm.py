"""A 6-axis arm with parallel axes 2 and 3 and an offset between axes 5 and 6, or none: lengths and signs.

Axis 1 is vertical and meets axis 2, or with a spherical wrist may pass it at a distance; axes 4 and 5 meet in the wrist
W, at a right angle. Elbow and wrist move in the vertical plane through axis 1: the upper arm from the shoulder to axis
3, the forearm from there to W. Axis 4 is in that plane, too, but need not point along the forearm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, pi, sin

from rcilab.core.errors import ModelError
from rcilab.model.kinematics.forward import Chain, build_chain
from rcilab.robots.description import DhRow, RobotDescription

_EXACT = 1e-12  # [rad] and [m] Tolerance of the table's shape.
_LENGTHS = ("d", "a", "a", "d", "a", "d")
"""What each row may have besides its turn; all other lengths are zero."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetSixGeometry:
    """Lengths of the arm, [m]."""

    shoulder: float
    """Height of the shoulder above the base."""
    ahead: float
    """Of the shoulder, in the plane, from axis 1; zero with an offset wrist."""
    upper: float
    """Shoulder to axis 3."""
    fore: float
    """Axis 3 to the wrist."""
    wrist: float
    """Distance of axis 6 from the wrist."""
    hand: float
    """Along axis 6, wrist to flange."""
    lean: float
    """Angle from the forearm to axis 4, in the plane, [rad]."""
    rise: float
    """+1 if the table's plane has its y axis upward, else -1."""
    same: float
    """+1 if axes 2 and 3 point the same way, else -1."""
    forward: float
    """+1 if axis 4 is a quarter turn ahead of the x axis of row 3 in the plane, else -1."""
    turns: tuple[float, float]
    """Sines of the turns between axes 4 and 5, and between axes 5 and 6: +1 or -1."""
    offsets: tuple[float, ...]
    """Theta offsets of the table, [rad]."""
    chain: Chain
    """From `build_chain`."""


def build_offset_six(description: RobotDescription) -> OffsetSixGeometry:
    """Returns the geometry that this inverse needs.

    Raises:
        ModelError: The table does not have the required shape.
    """
    dh = description.dh
    if len(dh) != 6 or not _has_shape(dh):
        raise ModelError(
            f"{description.name}: no closed-form inverse for this Denavit-Hartenberg table; it needs a 6-axis arm with "
            "parallel axes 2 and 3 and crossing axes 4 and 5"
        )
    same = float(round(cos(dh[1].alpha)))
    forward = -same * round(sin(dh[2].alpha))
    return OffsetSixGeometry(
        shoulder=dh[0].d,
        ahead=dh[0].a,
        upper=dh[1].a,
        fore=hypot(dh[2].a, dh[3].d),
        wrist=dh[4].a,
        hand=dh[5].d,
        lean=forward * pi / 2.0 - atan2(forward * dh[3].d, dh[2].a),
        rise=float(round(sin(dh[0].alpha))),
        same=same,
        forward=forward,
        turns=(float(round(sin(dh[3].alpha))), float(round(sin(dh[4].alpha)))),
        offsets=tuple(row.theta_offset for row in dh),
        chain=build_chain(dh),
    )


def _has_shape(dh: tuple[DhRow, ...]) -> bool:
    are_turns = all(abs(abs(sin(row.alpha)) - (i not in (1, 5))) < _EXACT for i, row in enumerate(dh))
    are_lengths = all(
        not (row.a if length == "d" else row.d) and (length == "a" or row.d > 0.0)
        for row, length in zip((replace(dh[0], a=0.0), *dh[1:]), _LENGTHS, strict=True)
    )
    return are_turns and not (dh[0].a and dh[4].a) and are_lengths and dh[1].a > 0.0 and abs(dh[5].alpha) < _EXACT
