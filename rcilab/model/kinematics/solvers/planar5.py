"""Closed-form inverse of 5 axes, of which 2, 3 and 4 are parallel, such as the xArm5: up to 4 branches.

Axis 1 is vertical, and every link and the axis of the tool are in one vertical plane through it. The pose gives the
plane, with joint 1 on either side, and joint 5; what remains is a planar arm with two elbows.
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
_FOLDED = 1e-9  # [m] Distance of flange and wrist from axis 1 below which joint 1 may have any angle.
_OUTSIDE = 1e-10  # [m] and sine: by how much a pose may be out of the plane.
_SLACK = 1e-9  # How far a cosine may be out of its range by rounding.
_SIGNS = np.array([(a, b) for a in (1.0, -1.0) for b in (1.0, -1.0)])[:, :, None]
"""Sides of axis 1 and of the elbow, shape (4, 2, 1)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanarFiveGeometry:
    """Lengths of the arm, [m]."""

    shoulder: float
    """Height of the shoulder above the base."""
    ahead: float
    """Of the shoulder from axis 1, in the plane of the arm."""
    upper: float
    """Axis 2 to 3."""
    fore: float
    """Axis 3 to 4."""
    wrist: float
    """Axis 4 to 5."""
    hand: float
    """Along axis 5, to the flange."""
    turns: tuple[float, float]
    """Sines of the turns of rows 1 and 4: +1 or -1."""
    offsets: tuple[float, ...]
    """Theta offsets of the table, [rad]."""


class PlanarFive(ClosedForm):
    """The solver of arms with the geometry of `build_planar_five`."""

    def __init__(self, description: RobotDescription, geometry: PlanarFiveGeometry) -> None:
        envelope = Envelope(
            shoulder=geometry.shoulder,
            upper=geometry.upper + abs(geometry.ahead),
            fore=geometry.fore + abs(geometry.wrist),
            hand=geometry.hand,
        )
        super().__init__(description, envelope, partial(solve_poses, geometry))


def build_planar_five(description: RobotDescription) -> PlanarFiveGeometry:
    """Returns the geometry that this inverse needs.

    Raises:
        ModelError: The table does not have the required shape.
    """
    dh = description.dh
    if len(dh) != 5 or not _has_shape(dh):
        raise ModelError(
            f"{description.name}: no closed-form inverse for this Denavit-Hartenberg table; it needs a 5-axis arm with "
            "parallel axes 2, 3 and 4"
        )
    return PlanarFiveGeometry(
        shoulder=dh[0].d,
        ahead=dh[0].a,
        upper=dh[1].a,
        fore=dh[2].a,
        wrist=dh[3].a,
        hand=dh[4].d,
        turns=(float(round(sin(dh[0].alpha))), float(round(sin(dh[3].alpha)))),
        offsets=tuple(row.theta_offset for row in dh),
    )


def solve_poses(
    arm: PlanarFiveGeometry, rotations: Array, positions: Array, near: Sequence[float] | None = None
) -> tuple[NDArray[np.intp], Array]:
    """Returns solutions at many poses, also outside the joint limits; see `closed_form.SolvePoses`."""
    first_near = 0.0 if near is None else near[0] + arm.offsets[0]
    side, elbow = (_SIGNS[:, i] for i in range(2))
    s1, s4 = arm.turns
    X, Z = rotations[:, :, 0], rotations[:, :, 2]
    W = positions - arm.hand * Z
    # Joint 1: flange and wrist are in the plane, whose normal n has the direction of the parallel axes.
    far = np.where((np.hypot(W[:, 0], W[:, 1]) > np.hypot(positions[:, 0], positions[:, 1]))[:, None], W, positions)
    bearing = np.where(np.hypot(far[:, 0], far[:, 1]) > _FOLDED, np.arctan2(far[:, 1], far[:, 0]), first_near)
    first = bearing + np.where(side > 0.0, 0.0, np.pi)
    zero = np.zeros_like(first)
    ahead = np.stack((np.cos(first), np.sin(first), zero), axis=-1)
    n = -s1 * np.stack((-np.sin(first), np.cos(first), zero), axis=-1)
    out = np.maximum(np.abs((n * Z).sum(axis=-1)), np.abs((n * positions).sum(axis=-1)))
    # Joint 5: from the x axis of frame 4 to that of the flange, about Z.
    x4 = s4 * np.cross(n, Z)
    fifth = np.arctan2((X * np.cross(Z, x4)).sum(axis=-1), (X * x4).sum(axis=-1))
    # The planar arm in the axes ahead and n x ahead, from the shoulder to axis 4.
    y = np.cross(n, ahead)
    target = W - arm.wrist * x4
    px = (target * ahead).sum(axis=-1) - arm.ahead
    py = ((target - np.array((0.0, 0.0, arm.shoulder))) * y).sum(axis=-1)
    cosine = (px * px + py * py - arm.upper**2 - arm.fore**2) / (2.0 * arm.upper * arm.fore)
    third = elbow * np.arccos(np.clip(cosine, -1.0, 1.0))
    second = np.arctan2(py, px) - np.arctan2(arm.fore * np.sin(third), arm.upper + arm.fore * np.cos(third))
    fourth = np.arctan2((x4 * y).sum(axis=-1), (x4 * ahead).sum(axis=-1)) - second - third
    q = np.stack((first, second, third, fourth, fifth), axis=-1) - np.array(arm.offsets)
    exists = (out <= _OUTSIDE) & (np.abs(cosine) <= 1.0 + _SLACK)
    return np.nonzero(exists)[1], q[exists]


def _has_shape(dh: tuple[DhRow, ...]) -> bool:
    turned = (True, False, False, True, False)
    are_turns = all(
        abs(abs(sin(row.alpha)) - is_turned) < _EXACT and (is_turned or cos(row.alpha) > 0.0)
        for row, is_turned in zip(dh, turned, strict=True)
    )
    are_lengths = not any((dh[1].d, dh[2].d, dh[3].d, dh[4].a))
    return are_turns and are_lengths and dh[1].a > 0.0 and dh[2].a > 0.0
