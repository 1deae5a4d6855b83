"""The closed-form inverse for many poses at once: the branches of `spherical.inverse`, in numpy.

The same mathematics with one array element per pose; sines and cosines are those of normalised vectors instead of
angles. The few poses at a singularity, where angles are not determined, use the scalar form, so that both agree there
too.
"""

from __future__ import annotations

from math import pi, tau

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solution_batch import Columns, cross, dot
from rcilab.model.kinematics.solvers.solver import REACH_TOLERANCE
from rcilab.model.kinematics.solvers.spherical.inverse import ArmGeometry, inverse_seven, inverse_six

_BLOCK = 2048  # Poses computed together, so that intermediate arrays fit into the cache.
_OPEN = 1e-7  # Sine of an angle, or length in [m], below which the scalar form is used.


def inverse_batch(arm: ArmGeometry, T_base_flange: Array, psi: ArrayLike = 0.0) -> Array:
    """Returns the 8 branches of the inverse at many poses, also outside the joint limits.

    Args:
        arm: From `build_geometry`.
        T_base_flange: Poses of the flange in base, shape (N, 4, 4).
        psi: Arm angle of a 7-axis arm, [rad], one number or shape (N,); not used for 6 axes.

    Returns:
        Shape (N, 8, n), [rad]; NaN if the wrist centre is out of reach.
    """
    count = len(T_base_flange)
    angles = np.broadcast_to(np.asarray(psi, dtype=np.float64), (count,))
    found = np.empty((arm.n, 8, count))  # One row per angle, so that every write below is contiguous.
    for start in range(0, count, _BLOCK):
        part = slice(start, min(start + _BLOCK, count))
        with np.errstate(invalid="ignore", divide="ignore"):
            if arm.n == 7:
                is_open, beyond = _seven(arm, T_base_flange[part], angles[part], found[:, :, part])
            else:
                is_open, beyond = _six(arm, T_base_flange[part], found[:, :, part])
        found[:, :, part][:, :, beyond] = np.nan
        for row in (start + np.flatnonzero(is_open & ~beyond)).tolist():
            pose = Pose.from_matrix(T_base_flange[row])
            branches = (
                inverse_seven(arm, pose, float(angles[row]), None) if arm.n == 7 else inverse_six(arm, pose, None)
            )
            found[:, :, row] = np.array(branches).T
    return found.transpose(2, 1, 0)


def _seven(arm: ArmGeometry, T: Array, psi: Array, found: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Writes the branches of a block; returns which poses are singular, and which are out of reach."""
    ahead, (x, y, z), length, c4, beyond = _wrist_centre(arm, T)
    upper, fore = arm.upper, arm.fore
    horizontal = np.sqrt(x * x + y * y)
    cx, cy = x / horizontal, y / horizontal
    uz, level = z / length, horizontal / length
    along = upper * (upper + fore * c4) / length
    aside = upper * fore * np.sqrt(1.0 - c4 * c4) / length
    cp, sp = aside * np.cos(psi), aside * np.sin(psi)
    # Shoulder to elbow: along the line, and around it from the upper side (see `arm_angle.reference_frame`).
    radial = along * level - cp * uz
    ex, ey, ez = radial * cx + sp * cy, radial * cy - sp * cx, along * uz + cp * level
    fx, fy, fz = x - ex, y - ey, z - ez

    across = np.sqrt(ex * ex + ey * ey)
    c1, s1, c2, s2 = ex / across, ey / across, ez / upper, across / upper
    forward = c1 * fx + s1 * fy
    vx, vy, vz = c2 * forward - s2 * fz, c1 * fy - s1 * fx, s2 * forward + c2 * fz
    side = np.sqrt(vx * vx + vy * vy)
    c3, s3, c4, s4 = vx / side, vy / side, vz / fore, side / fore
    # Axes of the frame after joint 4: the upper arm's, turned by joint 3, then by joint 4.
    x3 = c3 * c2 * c1 - s3 * s1, c3 * c2 * s1 + s3 * c1, -c3 * s2
    y4 = -s3 * c2 * c1 - c3 * s1, -s3 * c2 * s1 + c3 * c1, s3 * s2
    z2 = s2 * c1, s2 * s1, c2
    x4 = tuple(c4 * a - s4 * b for a, b in zip(x3, z2, strict=True))
    z4 = tuple(s4 * a + c4 * b for a, b in zip(x3, z2, strict=True))
    q5, q6, q7, turn = _wrist((x4[0], x4[1], x4[2]), y4, (z4[0], z4[1], z4[2]), T, ahead)

    q1, q2, q3, q4 = np.arctan2(ey, ex), np.arctan2(across, ez), np.arctan2(vy, vx), np.arctan2(side, vz)
    values = [(q, _half_turn(q)) for q in (q1, q3, q5, q7)]
    (one, three, five, seven), (two, four, six) = values, ((q2, -q2), (q4, -q4), (q6, -q6))
    for branch in range(8):
        flip_2, flip_4, flip_6 = branch >> 2, (branch >> 1) & 1, branch & 1
        row = found[:, branch]
        row[0], row[1], row[2] = one[flip_2], two[flip_2], three[flip_2 ^ flip_4]
        row[3], row[4], row[5], row[6] = four[flip_4], five[flip_4 ^ flip_6], six[flip_6], seven[flip_6]
    _shift(found, arm)
    is_open = (across < _OPEN) | (side < _OPEN) | (turn < _OPEN) | (horizontal < _OPEN) | (length < _OPEN)
    return is_open, beyond


def _six(arm: ArmGeometry, T: Array, found: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Writes the branches of a block; returns which poses are singular, and which are out of reach."""
    ahead, (x, y, z), length, c3, beyond = _wrist_centre(arm, T)
    s3 = np.sqrt(1.0 - c3 * c3)
    horizontal = np.sqrt(x * x + y * y)
    c1, s1 = x / horizontal, y / horizontal
    q1, q3 = np.arctan2(y, x), np.arctan2(s3, c3)
    elevation, bend = np.arctan2(horizontal, z), np.arctan2(arm.fore * s3, arm.upper + arm.fore * c3)
    y4 = -s1, c1, np.zeros(len(T))
    is_open = (horizontal < _OPEN) | (length < _OPEN)
    turned = _half_turn(q1)
    for number, elbow in enumerate((1.0, -1.0)):
        q2 = elevation - elbow * bend
        c23, s23 = np.cos(q2 + elbow * q3), np.sin(q2 + elbow * q3)
        q4, q5, q6, turn = _wrist((c1 * c23, s1 * c23, -s23), y4, (c1 * s23, s1 * s23, c23), T, ahead)
        is_open |= turn < _OPEN
        twin_4, twin_6 = _half_turn(q4), _half_turn(q6)
        q2 = _wrapped(q2)
        # Turned about axis 1 by half a turn, the arm reaches over its back: every sign of joints 2 and 3 changes.
        front, back = 2 * number, 6 - 2 * number
        for row, head, forth, fifth, sixth in (
            (front, (q1, q2, elbow * q3), q4, q5, q6),
            (front + 1, (q1, q2, elbow * q3), twin_4, -q5, twin_6),
            (back, (turned, -q2, -elbow * q3), twin_4, q5, q6),
            (back + 1, (turned, -q2, -elbow * q3), q4, -q5, twin_6),
        ):
            for joint, value in enumerate((*head, forth, fifth, sixth)):
                found[joint, row] = value
    _shift(found, arm)
    return is_open, beyond


def _wrist_centre(arm: ArmGeometry, T: Array) -> tuple[Columns, Columns, Array, Array, NDArray[np.bool_]]:
    """Returns the flange's z axis, wrist from shoulder, its distance, the elbow's cosine, and what is out of reach."""
    ahead = T[:, 0, 2].copy(), T[:, 1, 2].copy(), T[:, 2, 2].copy()
    x = T[:, 0, 3] - arm.hand * ahead[0]
    y = T[:, 1, 3] - arm.hand * ahead[1]
    z = T[:, 2, 3] - arm.hand * ahead[2] - arm.shoulder
    square = x * x + y * y + z * z
    length = np.sqrt(square)
    longest, shortest = arm.upper + arm.fore, abs(arm.upper - arm.fore)
    beyond = (length > longest + REACH_TOLERANCE) | (length < shortest - REACH_TOLERANCE)
    cosine = (square - arm.upper**2 - arm.fore**2) / (2.0 * arm.upper * arm.fore)
    return ahead, (x, y, z), length, np.clip(cosine, -1.0, 1.0), beyond


def _wrist(x4: Columns, y4: Columns, z4: Columns, T: Array, ahead: Columns) -> tuple[Array, Array, Array, Array]:
    """Returns the angles of Rz Ry Rz from the axes in front of the wrist to the flange, and the middle one's sine."""
    cosine, sine = dot(x4, ahead), dot(y4, ahead)
    side = np.sqrt(cosine * cosine + sine * sine)
    # The axis of the middle turn, z4 x z_flange, in the axes of the flange.
    middle = cross(z4, ahead)
    x7, y7 = ((T[:, 0, i], T[:, 1, i], T[:, 2, i]) for i in range(2))
    third = np.arctan2(dot(middle, x7), dot(middle, y7))
    return np.arctan2(sine, cosine), np.arctan2(side, dot(z4, ahead)), third, side


def _half_turn(q: Array) -> Array:
    """Returns angles in [-pi, pi] turned by pi, in the same range."""
    return np.where(q > 0.0, q - pi, q + pi)


def _wrapped(q: Array) -> Array:
    return q - tau * np.ceil((q - pi) / tau)


def _shift(found: Array, arm: ArmGeometry) -> None:
    for joint, (offset, sign) in enumerate(zip(arm.offsets, arm.signs, strict=True)):
        if offset or sign < 0.0:
            found[joint] = _wrapped(sign * found[joint] + offset)
