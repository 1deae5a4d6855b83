"""The closed-form inverse along a whole path, on one branch and without jumps.

The same mathematics as `inverse.py`, with arrays over all rows. The joint angles at the start of the path select the
branch. A turn about z before a turn about y is known up to half a turn (Rz(a) Ry(-b) = Rz(a + pi) Ry(b) Rz(pi)); here
each is continuous with the previous row, and the tilt has the matching sign. So a path exactly through a singularity,
such as those in the vertical plane of the arm, continues smoothly and is distinguished from one that passes close by.
"""

from __future__ import annotations

from math import pi, tau
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError, SingularError
from rcilab.model.kinematics.solvers.solver import REACH_TOLERANCE, BranchEnd
from rcilab.model.kinematics.solvers.spherical.inverse import ArmGeometry, reach_error

Column: TypeAlias = Array
"""Shape (N,): one number for every row of the path."""
Vec: TypeAlias = tuple[Column, Column, Column]

_AXIS_LOST = 1e-12  # As in `inverse.py`: below it the azimuth is undefined, and the previous one is used.
_VERTICAL = 1e-6  # sin of the angle to the vertical below which the arm angle's reference turns too fast to follow.
_BESIDE = (
    1e-5  # sin of the distance from the axis up to which a path passes through it: ten times the error of `_miss`.
)


def follow_branch(
    arm: ArmGeometry, rotations: Array, positions: Array, psi: Column | None, start: JointVector
) -> tuple[JointPath, BranchEnd | None]:
    """Returns the joint angles along a path of the flange, on one branch; limits are not checked.

    Args:
        arm: From `build_geometry`.
        rotations: Flange in base, shape (N, 3, 3).
        positions: Flange in base, shape (N, 3), [m].
        psi: Arm angles, shape (N,), [rad]; None for 6 axes.
        start: Joint angles at row 0, shape (n,), [rad]; they select the branch.

    Returns:
        Joint angles, shape (N, n), [rad], and the first row without a solution, or None. From that row on the angles
        have no meaning.
    """
    tracker = _Tracker()
    offsets, signs = np.array(arm.offsets), np.array(arm.signs)
    guess = (signs * (start - offsets)).tolist()
    # Contiguous columns, because every step below uses them.
    r = [[np.ascontiguousarray(rotations[:, i, j]) for j in range(3)] for i in range(3)]
    x, y, z = (positions[:, i] - arm.hand * r[i][2] for i in range(3))
    z -= arm.shoulder
    length = np.sqrt(x * x + y * y + z * z)
    upper, fore = arm.upper, arm.fore
    unreachable = (length > upper + fore + REACH_TOLERANCE) | (length < abs(upper - fore) - REACH_TOLERANCE)
    if unreachable.any():
        row = int(unreachable.argmax())
        tracker.lose(row, reach_error(arm, float(length[row])))
    # cos of the elbow angle from the haversine form, to avoid cancellation at the stretched arm.
    half = np.clip((length - (upper - fore)) * (length + (upper - fore)) / (4.0 * upper * fore), 0.0, 1.0)
    elbow = 2.0 * np.arctan2(np.sqrt(1.0 - half), np.sqrt(half))
    if psi is None:
        (head, forearm), last = _six(arm, tracker, (x, y, z), elbow, guess), 3
    else:
        (head, forearm), last = _seven(arm, tracker, (x, y, z), length, elbow, psi, guess), 4
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = forearm
    zx = ax * r[0][2] + ay * r[1][2] + az * r[2][2]
    zy = bx * r[0][2] + by * r[1][2] + bz * r[2][2]
    zz = cx * r[0][2] + cy * r[1][2] + cz * r[2][2]
    axes = "joints 5 and 7" if last == 4 else "joints 4 and 6"
    first, tilt, c, s = tracker.azimuth(zx, zy, guess[last], axes)
    # Second row of Rz(-first) A^T B is (sin third, cos third, 0).
    mx, my, mz = c * bx - s * ax, c * by - s * ay, c * bz - s * az
    sine, cosine = (mx * r[0][j] + my * r[1][j] + mz * r[2][j] for j in (0, 1))
    third = _continued(np.arctan2(sine, cosine), guess[-1])
    # Each joint contiguous in memory, because later computations run along the path.
    upright = np.stack((*head, first, np.arctan2(tilt, zz), third))
    return (signs[:, np.newaxis] * upright + offsets[:, np.newaxis]).T, tracker.loss


def _seven(
    arm: ArmGeometry, tracker: _Tracker, wrist: Vec, length: Column, elbow: Column,
    psi: Column, guess: list[float],
) -> tuple[tuple[Column, ...], tuple[Vec, Vec, Vec]]:  # fmt: skip
    """Returns joints 1 to 4, and the axes x, y and z of the forearm in base."""
    x, y, z = wrist
    safe = np.maximum(length, REACH_TOLERANCE)
    ux, uy, uz = x / safe, y / safe, z / safe
    along = arm.upper * (arm.upper + arm.fore * np.cos(elbow)) / safe
    aside = arm.upper * arm.fore * np.sin(elbow) / safe
    horizontal = _hypot(ux, uy)
    vertical = horizontal < _VERTICAL
    if vertical.any():
        reason = (
            "the wrist is straight above or below the shoulder, where the arm angle has no reference; move the tool "
            "around it, or use a joint motion"
        )
        tracker.lose(int(vertical.argmax()), SingularError(reason).coded("vertical"))
    cx, cy = ux / np.maximum(horizontal, _VERTICAL), uy / np.maximum(horizontal, _VERTICAL)
    cp, sp = aside * np.cos(psi), aside * np.sin(psi)
    # Direction from shoulder to elbow; sines and cosines of the joints follow without angles.
    ex = (along * ux - cp * uz * cx + sp * cy) / arm.upper
    ey = (along * uy - cp * uz * cy - sp * cx) / arm.upper
    c2 = (along * uz + cp * horizontal) / arm.upper
    q1, s2, c1, s1 = tracker.azimuth(ex, ey, guess[0], "joints 1 and 3")
    # Elbow to wrist as a direction, in base and in the frame of link 2, Rz(q1) Ry(q2).
    fx, fy, fz = ((w - arm.upper * e) / arm.fore for w, e in ((x, ex), (y, ey), (z, c2)))
    out = c1 * fx + s1 * fy
    vx, vy, c4 = c2 * out - s2 * fz, c1 * fy - s1 * fx, s2 * out + c2 * fz
    q3, s4, c3, s3 = tracker.azimuth(vx, vy, guess[2], "joints 3 and 5")
    ahead, across, up = _turned_zy(c1, s1, c2, s2)
    ahead, across = _mixed(ahead, across, c3, s3), _mixed(ahead, across, -s3, c3)
    forearm = _mixed(ahead, up, c4, -s4), across, _mixed(ahead, up, s4, c4)
    return (q1, np.arctan2(s2, c2), q3, np.arctan2(s4, c4)), forearm


def _six(
    arm: ArmGeometry, tracker: _Tracker, wrist: Vec, elbow: Column, guess: list[float]
) -> tuple[tuple[Column, ...], tuple[Vec, Vec, Vec]]:
    """Returns joints 1 to 3, and the axes x, y and z of the forearm in base."""
    x, y, z = wrist
    reach = arm.upper + arm.fore
    q1, radius, c1, s1 = tracker.azimuth(x / reach, y / reach, guess[0], "joint 1")
    q3 = np.copysign(elbow, guess[2])
    fore_x, fore_z = arm.fore * np.sin(q3), arm.upper + arm.fore * np.cos(q3)
    # Planar two-link arm in the (radius, height) plane, angles counted from the vertical.
    q2 = _continued(np.arctan2(reach * radius, z) - np.arctan2(fore_x, fore_z), guess[1])
    return (q1, q2, q3), _turned_zy(c1, s1, np.cos(q2 + q3), np.sin(q2 + q3))


class _Tracker:
    """Makes azimuths continuous along the rows and stores the first row at which one is undefined."""

    def __init__(self) -> None:
        self.loss: BranchEnd | None = None

    def lose(self, row: int, reason: KinematicsError) -> None:
        if self.loss is None or row < self.loss.row:
            self.loss = BranchEnd(row, reason)

    def azimuth(self, x: Column, y: Column, guess: float, axes: str) -> tuple[Column, Column, Column, Column]:
        """Returns the continuous angle about z, the tilt with the matching sign, and the angle's cosine and sine.

        Args:
            x: Component of a direction.
            y: Component of the same direction; the root of the sum of squares is the sine of its tilt.
            guess: Angle before the first row, [rad].
            axes: The joints that are undefined without a tilt, for the message.
        """
        tilt = _hypot(x, y)
        known = tilt > _AXIS_LOST
        raw = _filled(np.arctan2(y, x), known, guess)
        halves = _turns(raw, guess, pi)
        angle = raw + pi * halves
        odd = halves - 2.0 * np.floor(0.5 * halves)
        swaps = np.flatnonzero(odd[1:] != odd[:-1])
        if swaps.size:
            beside = swaps[_miss(angle, tilt, swaps) > _BESIDE]
            if beside.size:
                reason = SingularError(
                    f"{axes} would have to jump by half a turn, because a singularity is in the way; "
                    "move the tool around it, or use a joint motion"
                ).coded("half_turn")
                self.lose(int(beside[0]) + 1, reason)
        tilt *= 1.0 - 2.0 * odd
        if known.all():
            return angle, tilt, x / tilt, y / tilt
        return angle, tilt, np.cos(angle), np.sin(angle)


def _miss(angle: Column, tilt: Column, swaps: np.ndarray) -> Column:
    """Returns the distance from the axis, as a sine, at which a path passes where its tilt changes sign.

    On a path through the axis the azimuth is smooth. One that passes at a distance e between rows with tilts a and b
    turns by e / a + e / b more there than in the steps before and after.
    """
    steps = np.diff(angle)
    around = (steps[np.maximum(swaps - 1, 0)] + steps[np.minimum(swaps + 1, len(steps) - 1)]) / 2.0
    a, b = tilt[swaps], tilt[swaps + 1]
    return np.abs(steps[swaps] - around) * a * b / np.maximum(a + b, _AXIS_LOST)


def _filled(values: Column, known: np.ndarray, first: float) -> Column:
    """Returns the values, with unknown ones replaced by the last known one."""
    if known.all():
        return values
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], first)


def _continued(angles: Column, guess: float) -> Column:
    """Returns the angles plus full turns, without jumps and with the first closest to the guess."""
    return angles + tau * _turns(angles, guess, tau)


def _turns(angles: Column, guess: float, period: float) -> Column:
    """Returns the number of periods to add to each angle so that it is closest to the previous one, or the guess."""
    steps = np.empty_like(angles)
    steps[0] = angles[0] - guess
    np.subtract(angles[1:], angles[:-1], out=steps[1:])
    return -np.cumsum(np.round(steps / period))


def _hypot(x: Column, y: Column) -> Column:
    """Returns the root of the sum of squares.

    `np.hypot`, which is safe for very large and small values, takes five times as long.
    """
    return np.sqrt(x * x + y * y)


def _turned_zy(c1: Column, s1: Column, c2: Column, s2: Column) -> tuple[Vec, Vec, Vec]:
    """Returns the axes x, y and z of Rz Ry, given the cosines and sines of both angles."""
    return (c1 * c2, s1 * c2, -s2), (-s1, c1, np.zeros_like(c1)), (c1 * s2, s1 * s2, c2)


def _mixed(a: Vec, b: Vec, of_a: Column, of_b: Column) -> Vec:
    x, y, z = (of_a * p + of_b * q for p, q in zip(a, b, strict=True))
    return x, y, z
