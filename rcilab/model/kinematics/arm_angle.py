"""The arm angle psi of a 7-axis arm: the angle of the elbow on its circle around the shoulder-wrist line.

With S the shoulder, E the elbow, W the wrist centre and u = unit(W - S), psi is the right-hand angle about u from the
component of base +z perpendicular to u to the component of (E - S) perpendicular to u. At psi = 0 the elbow is in the
vertical plane on the upper side; at +-pi on the lower side. The vendor's controller uses the same definition.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, sin, sqrt
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.core.errors import SingularError

Vec: TypeAlias = tuple[float, float, float]

_VERTICAL = 1e-9  # sin of the angle of SW to the vertical below which psi has no reference.
_NO_REFERENCE = "arm angle: shoulder and wrist are above each other, so no direction around that line is the upper one"
_STRETCHED = 1e-12  # Elbow distance from SW, relative to the arm's length, below which psi is undefined.


def arm_angle(upper: float, fore: float, q: Sequence[float]) -> float:
    """Returns the arm angle of a joint configuration, [rad] in (-pi, pi].

    Args:
        upper: d3, shoulder to elbow, [m].
        fore: d5, elbow to wrist, [m].
        q: Joint angles of a 7-axis arm as plain floats, [rad]; only the first four matter.

    Raises:
        SingularError: The shoulder-wrist line is vertical, or the arm is stretched.
    """
    c1, s1, c2, s2 = cos(q[0]), sin(q[0]), cos(q[1]), sin(q[1])
    c3, s3, c4, s4 = cos(q[2]), sin(q[2]), cos(q[3]), sin(q[3])
    # Elbow from shoulder, and wrist from elbow first in the frame of link 2, then in base.
    ex, ey, ez = upper * c1 * s2, upper * s1 * s2, upper * c2
    fx, fy, fz = fore * c3 * s4, fore * s3 * s4, fore * c4
    wx = ex + c1 * (c2 * fx + s2 * fz) - s1 * fy
    wy = ey + s1 * (c2 * fx + s2 * fz) + c1 * fy
    wz = ez - s2 * fx + c2 * fz
    length = sqrt(wx * wx + wy * wy + wz * wz)
    if length == 0.0:
        error = SingularError("arm angle: the wrist is on the shoulder, so there is no shoulder-wrist line")
        raise error.coded("no_arm_angle")
    # The elbow in the directions of `reference_frame`, written out for speed.
    horizontal = hypot(wx, wy)
    if horizontal < _VERTICAL * length:
        raise SingularError(_NO_REFERENCE).coded("no_arm_angle")
    cx, cy = wx / horizontal, wy / horizontal
    along, side = (horizontal * ez - wz * (cx * ex + cy * ey)) / length, cy * ex - cx * ey
    if hypot(along, side) < _STRETCHED * (upper + fore):
        error = SingularError("arm angle: the arm is stretched (q4 = 0), the elbow is on the shoulder-wrist line")
        raise error.coded("stretched")
    return atan2(side, along)


def arm_angle_path(upper: float, fore: float, q: JointPath) -> Array:
    """Returns the arm angle of many configurations, shape (N,), [rad]; arbitrary where it has no meaning.

    Args:
        upper: d3, shoulder to elbow, [m].
        fore: d5, elbow to wrist, [m].
        q: Joint angles, shape (N, 7), [rad]; only the first four matter.
    """
    (c1, s1), (c2, s2), (c3, s3), (c4, s4) = ((np.cos(q[:, i]), np.sin(q[:, i])) for i in range(4))
    ex, ey, ez = upper * c1 * s2, upper * s1 * s2, upper * c2
    fx, fy, fz = fore * c3 * s4, fore * s3 * s4, fore * c4
    ahead = c2 * fx + s2 * fz
    wx, wy, wz = ex + c1 * ahead - s1 * fy, ey + s1 * ahead + c1 * fy, ez - s2 * fx + c2 * fz
    horizontal = np.sqrt(wx * wx + wy * wy)
    length = np.sqrt(horizontal * horizontal + wz * wz)
    safe = np.where(horizontal > 0.0, horizontal, 1.0)
    cx, cy = wx / safe, wy / safe
    along = (horizontal * ez - wz * (cx * ex + cy * ey)) / np.where(length > 0.0, length, 1.0)
    return np.arctan2(cy * ex - cx * ey, along)


def reference_frame(u: Vec) -> tuple[Vec, Vec]:
    """Returns the directions of psi = 0 and psi = +90 degrees, perpendicular to the unit vector u.

    Raises:
        SingularError: u is vertical, so no side of the line is the upper one.
    """
    horizontal = hypot(u[0], u[1])
    if horizontal < _VERTICAL:
        raise SingularError(_NO_REFERENCE).coded("no_arm_angle")
    cx, cy = u[0] / horizontal, u[1] / horizontal
    return (-u[2] * cx, -u[2] * cy, horizontal), (cy, -cx, 0.0)
