"""Closed-form inverse of 6 axes, of which 2, 3 and 4 are parallel, such as the ECO65: up to 8 branches.

Axis 1 is vertical. The origin W of frame 5 follows from the pose. Its distance from the plane of the arm is that of row
4, which gives two angles of joint 1; the angle between the flange's z axis and the parallel axes n gives two of joint
5. With either, the x axis of frame 4 and joint 6 are known, and what remains is a planar arm with two elbows.

If axis 6 is parallel to n, only the sum of joints 2, 3, 4 and 6 is determined: joint 6 is that of `near`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.errors import ModelError
from rcilab.model.kinematics.solvers.closed_form import ClosedForm
from rcilab.model.kinematics.solvers.solver import Envelope
from rcilab.robots.description import DhRow, RobotDescription

_EXACT = 1e-12  # [rad] and [m] Tolerance of the table's shape.
_IN_LINE = 1e-9  # Sine of the angle between axis 6 and the parallel axes below which joint 6 may have any angle.
_FOLDED = 1e-9  # [m] Distance of W from axis 1 below which joint 1 may have any angle.
_SLACK = 1e-9  # How far a cosine or a sine may be out of its range by rounding.
_SIGNS = np.array([(a, b, c) for a in (1.0, -1.0) for b in (1.0, -1.0) for c in (1.0, -1.0)])[:, :, None]
"""Sides of axis 1, of joint 5 and of the elbow, shape (8, 3, 1)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParallelSixGeometry:
    """Lengths of the arm, [m]."""

    shoulder: float
    """Height of the shoulder above the base."""
    ahead: float
    """Of the shoulder from axis 1, in the plane of the arm."""
    upper: float
    """Axis 2 to 3."""
    fore: float
    """Axis 3 to 4."""
    aside: float
    """Of axis 5 from the plane of the arm, along the parallel axes."""
    wrist: float
    """Along axis 5, from axis 4 to axis 6."""
    hand: float
    """Along axis 6, to the flange."""
    turns: tuple[float, float, float]
    """Sines of the turns of rows 1, 4 and 5: +1 or -1."""
    offsets: tuple[float, ...]
    """Theta offsets of the table, [rad]."""


class ParallelSix(ClosedForm):
    """The solver of arms with the geometry of `build_parallel_six`."""

    def __init__(self, description: RobotDescription, geometry: ParallelSixGeometry) -> None:
        envelope = Envelope(
            shoulder=geometry.shoulder,
            upper=geometry.upper + abs(geometry.ahead),
            fore=geometry.fore + abs(geometry.wrist) + abs(geometry.aside),
            hand=geometry.hand,
        )
        super().__init__(description, envelope, partial(solve_poses, geometry))


def build_parallel_six(description: RobotDescription) -> ParallelSixGeometry:
    """Returns the geometry that this inverse needs.

    Raises:
        ModelError: The table does not have the required shape.
    """
    dh = description.dh
    if len(dh) != 6 or not _has_shape(dh):
        raise ModelError(
            f"{description.name}: no closed-form inverse for this Denavit-Hartenberg table; it needs a 6-axis arm with "
            "parallel axes 2, 3 and 4"
        )
    return ParallelSixGeometry(
        shoulder=dh[0].d,
        ahead=dh[0].a,
        upper=dh[1].a,
        fore=dh[2].a,
        aside=dh[3].d,
        wrist=dh[4].d,
        hand=dh[5].d,
        turns=(float(round(sin(dh[0].alpha))), float(round(sin(dh[3].alpha))), float(round(sin(dh[4].alpha)))),
        offsets=tuple(row.theta_offset for row in dh),
    )


def solve_poses(
    arm: ParallelSixGeometry, rotations: Array, positions: Array, near: Sequence[float] | None = None
) -> tuple[NDArray[np.intp], Array]:
    """Returns solutions at many poses, also outside the joint limits; see `closed_form.SolvePoses`."""
    first_near, last_near = (0.0, 0.0) if near is None else (near[0] + arm.offsets[0], near[5] + arm.offsets[5])
    side, fold, elbow = (_SIGNS[:, i] for i in range(3))
    s1, s4, s5 = arm.turns
    X, Y, Z = (rotations[:, :, i] for i in range(3))
    W = positions - arm.hand * Z
    # Joint 1: n, the direction of the parallel axes, is -s1 (-sin, cos, 0), and n W = aside.
    flat = np.hypot(W[:, 0], W[:, 1])
    sine = -s1 * arm.aside / np.maximum(flat, _FOLDED)
    aside = np.arcsin(np.clip(sine, -1.0, 1.0))
    bearing = np.where(flat > _FOLDED, np.arctan2(W[:, 1], W[:, 0]), first_near)
    first = bearing - np.where(side > 0.0, aside, np.pi - aside)
    ahead = np.stack((np.cos(first), np.sin(first), np.zeros_like(first)), axis=-1)
    n = -s1 * np.stack((-np.sin(first), np.cos(first), np.zeros_like(first)), axis=-1)
    # Joint 5: Z = -s4 s5 cos n + s5 sin x4.
    along = (n * Z).sum(axis=-1)
    across = Z - along[..., None] * n
    size = np.linalg.norm(across, axis=-1)
    is_free = size < _IN_LINE
    fifth = np.arctan2(fold * size, -s4 * s5 * along)
    x5_free = np.cos(last_near) * X - np.sin(last_near) * Y
    free = np.sign(np.cos(fifth))[..., None] * x5_free
    x4 = np.where(is_free[..., None], free, s5 * fold[..., None] * across / np.maximum(size, _IN_LINE)[..., None])
    x5 = np.cos(fifth)[..., None] * x4 + s4 * np.sin(fifth)[..., None] * n
    sixth = np.arctan2((X * np.cross(Z, x5)).sum(axis=-1), (X * x5).sum(axis=-1))
    # The planar arm in the axes ahead and n x ahead, from the shoulder to axis 4.
    y = np.cross(n, ahead)
    z4 = -s4 * np.cross(n, x4)
    target = W - arm.wrist * z4
    px = (target * ahead).sum(axis=-1) - arm.ahead
    py = ((target - np.array((0.0, 0.0, arm.shoulder))) * y).sum(axis=-1)
    cosine = (px * px + py * py - arm.upper**2 - arm.fore**2) / (2.0 * arm.upper * arm.fore)
    third = elbow * np.arccos(np.clip(cosine, -1.0, 1.0))
    second = np.arctan2(py, px) - np.arctan2(arm.fore * np.sin(third), arm.upper + arm.fore * np.cos(third))
    plane = np.arctan2((x4 * y).sum(axis=-1), (x4 * ahead).sum(axis=-1))
    fourth = plane - second - third
    q = np.stack((first, second, third, fourth, fifth, sixth), axis=-1) - np.array(arm.offsets)
    exists = (np.abs(sine) <= 1.0 + _SLACK) & (np.abs(cosine) <= 1.0 + _SLACK)
    return np.nonzero(exists)[1], q[exists]


def _has_shape(dh: tuple[DhRow, ...]) -> bool:
    turned = (True, False, False, True, True, False)
    are_turns = all(
        abs(abs(sin(row.alpha)) - is_turned) < _EXACT and (is_turned or cos(row.alpha) > 0.0)
        for row, is_turned in zip(dh, turned, strict=True)
    )
    are_lengths = not any((dh[1].d, dh[2].d, dh[3].a, dh[4].a, dh[5].a))
    return are_turns and are_lengths and dh[1].a > 0.0 and dh[2].a > 0.0
