"""An arm with offsets at elbow and wrist, such as Panda or xArm7: all joint angles for a pose, as functions of joint 7.

Axes 1 to 3 meet in the shoulder S, axes 5 and 6 in the wrist W; axis 7 passes W at a distance, and the elbow is offset
from upper arm and forearm. For a given angle of joint 7 everything else follows in closed form (He and Liu, IEEE
Robotics and Automation Letters 6(4), 2021): W is known, the triangle of shoulder, elbow and wrist gives two angles of
joint 4, the plane of that triangle through axis 5 two of joint 6, and the shoulder two groups of joints 1 to 3.

The arm angle of such an arm is defined by its maker: for the Panda the angle of joint 3. The self-motion of the arm at
a pose is therefore traced by joint 7; `inverse.py` finds the points with joint 3 at a given angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, pi, remainder, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.errors import ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.forward import Chain, build_chain
from rcilab.model.kinematics.solvers.solver import REACH_TOLERANCE, describe_excess, unit_hint
from rcilab.robots.description import DhRow, RobotDescription

ELBOW = 2
"""Index of the joint whose angle is the arm angle."""

_QUARTER = pi / 2
_TURNS = (-_QUARTER, _QUARTER, _QUARTER, -_QUARTER, _QUARTER, _QUARTER, 0.0)
_EXACT = 1e-12  # [rad] and [m] Tolerance of the table's shape.
_TRACE = 360
"""Number of angles of joint 7 on the self-motion. Tuning value: one per degree; smaller loops may be missed."""
_PARTS, _HUNTS = 16, 4  # The end of a branch is searched in 16 parts of a piece, four times.
_DENSE = 6  # Angles added near an end; tuning value.


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetGeometry:
    """The lengths of the arm, [m]."""

    shoulder: float
    """Height of the shoulder above the base."""
    upper: float
    """Along the upper arm, shoulder to elbow."""
    elbow: float
    """Offset of the elbow from the upper arm."""
    bend: float
    """Offset of the elbow from the forearm, to the same side."""
    fore: float
    """Along the forearm, elbow to wrist."""
    wrist: float
    """Distance of axis 7 from the wrist; negative on the other side of the forearm than the Panda's at zero."""
    hand: float
    """Along axis 7, wrist to flange."""
    offsets: tuple[float, ...]
    """Angles of the Panda's table minus joint angles, [rad]: zero, or half turns where axes point the other way."""
    chain: Chain
    """From `build_chain`."""
    middles: tuple[float, ...]
    """Middles of the joints' ranges, [rad]; angles are within half a turn of them."""

    @property
    def flip(self) -> float:
        """Angle of joint 4 of the stretched arm in the Panda's table, [rad], at which the elbow flips."""
        return atan2(self.upper, self.elbow) + atan2(self.fore, self.bend) - pi

    @property
    def reach(self) -> tuple[float, float]:
        """Shortest and longest distance of the wrist from the shoulder, [m]."""
        upper, fore = hypot(self.upper, self.elbow), hypot(self.fore, self.bend)
        return abs(upper - fore), upper + fore


def build_offset_geometry(description: RobotDescription) -> OffsetGeometry:
    """Returns the lengths that this inverse needs.

    Raises:
        ModelError: The table does not have the required shape.
    """
    dh = description.dh
    lengths = {0: "d", 2: "da", 3: "a", 4: "d", 5: "a", 6: "d"}
    good = len(dh) == 7 and all(
        abs(abs(row.alpha) - abs(alpha)) < _EXACT
        and bool(row.d) == ("d" in lengths.get(i, ""))
        and bool(row.a) == ("a" in lengths.get(i, ""))
        for i, (row, alpha) in enumerate(zip(dh, _TURNS, strict=True))
    )
    if not good:
        raise ModelError(
            f"{description.name}: no closed-form inverse for this Denavit-Hartenberg table; it needs a 7-axis arm with "
            "one offset at the elbow, there and back, and one at the wrist"
        )
    offsets, a = _as_panda(dh)
    joint = description.limits.joint
    return OffsetGeometry(
        shoulder=dh[0].d, upper=dh[2].d, elbow=a[2], bend=-a[3], fore=dh[4].d, wrist=a[5], hand=dh[6].d,
        offsets=offsets, chain=build_chain(dh), middles=tuple(((joint.lower + joint.upper) / 2.0).tolist()),
    )  # fmt: skip


def _as_panda(dh: Sequence[DhRow]) -> tuple[tuple[float, ...], list[float]]:
    """Returns offsets of the joint angles and lengths along x of a table with the Panda's turns, for the same arm.

    RotX(alpha) is RotZ(pi) RotX(-alpha) RotZ(-pi): half a turn of a joint and of the next, and the other way along x.
    """
    offsets, a = [row.theta_offset for row in dh], [row.a for row in dh]
    for i, (row, alpha) in enumerate(zip(dh, _TURNS, strict=True)):
        if abs(row.alpha - alpha) > _EXACT:
            offsets[i] += pi
            offsets[i + 1] -= pi
            a[i] *= -1.0
    return tuple(remainder(offset, tau) for offset in offsets), a


class SelfMotion:
    """All joint angles for one pose of the flange.

    Args:
        arm: From `build_offset_geometry`.
        T_base_flange: Pose of the flange in base.

    Raises:
        UnreachableError: The pose is out of reach at every arm angle.
    """

    def __init__(self, arm: OffsetGeometry, T_base_flange: Pose) -> None:
        self._arm = arm
        self._rotation, self._position = T_base_flange.rotation, T_base_flange.position
        angles = np.linspace(-pi, pi, _TRACE, endpoint=False, dtype=np.float64)
        table, beyond = trace(arm, self._rotation, self._position, angles)
        exists = np.isfinite(table[..., 0])
        if not exists.any():
            raise _unreachable(arm, beyond)
        angles = self._with_ends(angles, exists[:, 0])
        table, beyond = trace(arm, self._rotation, self._position, angles)
        exists = np.isfinite(table[..., 0])
        self.starts, self.ends, self.branches = _segments(table, exists, beyond > 0.0)
        """Starts and ends of short pieces of the self-motion, shape (m, 7) each, [rad], and their branches of `trace`,
        plus 4 if joint 2 is negative, -1 between two branches, shape (m,)."""

    def on_branches(self, guesses: Array, branches: NDArray[np.intp]) -> Array:
        """Returns the joint angles at the guesses' angles of joint 7, with their full turns; NaN without a solution.

        Args:
            guesses: Joint angles close to the solutions, shape (m, 7), [rad].
            branches: Branch of each, 0 to 7, shape (m,).
        """
        table = trace(self._arm, self._rotation, self._position, guesses[:, 6])[0].reshape(4, len(guesses), 7)
        found = table[branches % 4, np.arange(len(guesses))]
        is_turned = branches >= 4
        found[is_turned] = _turned(found[is_turned])
        return guesses + wrapped(found - guesses)

    def _with_ends(self, angles: Array, exists: NDArray[np.bool_]) -> Array:
        """Returns the angles of joint 7 with more of them where branches end, denser towards the end.

        Near an end the other joints change with the square root of the distance.
        """
        side, place = np.nonzero(exists != np.roll(exists, -1, axis=1))
        if not len(place):
            return angles
        low, width = angles[place], tau / _TRACE
        is_open = exists[side, place]
        for _ in range(_HUNTS):
            width /= _PARTS
            points = low[:, None] + width * np.arange(1, _PARTS)
            table, _ = trace(self._arm, self._rotation, self._position, points.ravel())
            found = np.isfinite(table[:, 0, :, 0]).reshape(2, *points.shape)[side, np.arange(len(side))]
            low = low + width * (found == is_open[:, None]).cumprod(axis=1).sum(axis=1)
        last = np.where(is_open, low, low + width)
        inward = np.where(is_open, -1.0, 1.0) * (tau / _TRACE)
        more = last[:, None] + inward[:, None] * np.linspace(0.0, 1.0, _DENSE, endpoint=False) ** 2
        return np.unique(np.concatenate((angles, wrapped(more.ravel()))))


def trace(arm: OffsetGeometry, rotation: Array, position: Array, q7: Array) -> tuple[Array, Array]:
    """Returns joint angles in closed form for given angles of joint 7.

    Args:
        arm: From `build_offset_geometry`.
        rotation: Flange in base, shape (3, 3), or (K, 3, 3) for a pose each.
        position: Flange in base, shape (3,) or (K, 3), [m].
        q7: Angles of joint 7, shape (K,), [rad].

    Returns:
        Shape (2, 2, K, 7), [rad], NaN without a solution: joint 4 above the flip or below, cos q5 positive
        or negative, joint 2 positive; and the distance of the wrist out of reach, shape (K,), [m], negative inside.
    """
    theta = q7 + arm.offsets[6]
    c7, s7 = np.cos(theta)[:, None], np.sin(theta)[:, None]
    x7, y7, z7 = rotation[..., 0], rotation[..., 1], rotation[..., 2]
    x6, y6, z6 = c7 * x7 - s7 * y7, -z7, s7 * x7 + c7 * y7
    to_shoulder = np.array((0.0, 0.0, arm.shoulder)) - (position - arm.hand * z7 - arm.wrist * x6)
    shortest, longest = arm.reach
    square = (to_shoulder * to_shoulder).sum(axis=1)
    distance = np.sqrt(square)
    beyond = np.maximum(distance - longest, shortest - distance)
    # Angle at the elbow between shoulder and wrist, by half angles, to avoid cancellation at its ends.
    opening = 2.0 * np.arctan2(
        np.sqrt(np.maximum(square - shortest * shortest, 0.0)), np.sqrt(np.maximum(longest * longest - square, 0.0))
    )
    straight = arm.flip + pi
    q4 = np.stack((straight - opening, straight - tau + opening))[:, None]  # (2, 1, K)
    c4, s4 = np.cos(q4), np.sin(q4)
    # Shoulder from wrist in the plane of the triangle: off the forearm and along it.
    off = arm.bend - arm.elbow * c4 - arm.upper * s4
    along = arm.elbow * s4 - arm.upper * c4 - arm.fore
    vx, vy, vz = ((to_shoulder * axis).sum(axis=1) for axis in (x6, y6, z6))
    rest = vx * vx + vy * vy - along * along
    exists = (rest >= -REACH_TOLERANCE) & (beyond <= REACH_TOLERANCE)
    side = np.sqrt(np.maximum(rest, 0.0)) * np.array((1.0, -1.0))[None, :, None]  # (2, 2, K)
    sign = np.where(off < 0.0, -1.0, 1.0)
    side = side * sign
    q6 = np.arctan2(np.broadcast_to(along, side.shape), side) - np.arctan2(vy, vx)
    q5 = np.arctan2(vz * sign, side * sign)
    c6, s6, c5, s5 = (value[..., None] for value in (np.cos(q6), np.sin(q6), np.cos(q5), np.sin(q5)))
    c4, s4 = c4[..., None], s4[..., None]
    x5, z5 = c6 * x6 - s6 * y6, s6 * x6 + c6 * y6
    xf, y3 = c5 * x5 + s5 * z6, s5 * x5 - c5 * z6
    x3, z3 = c4 * xf - s4 * z5, s4 * xf + c4 * z5
    q1 = np.arctan2(z3[..., 1], z3[..., 0])
    q2 = np.arctan2(np.hypot(z3[..., 0], z3[..., 1]), z3[..., 2])
    c1, s1 = np.cos(q1), np.sin(q1)
    q3 = np.arctan2(c1 * x3[..., 1] - s1 * x3[..., 0], c1 * y3[..., 1] - s1 * y3[..., 0])
    shape = side.shape
    columns = (q1, q2, q3, np.broadcast_to(q4, shape), q5, q6, np.broadcast_to(theta, shape))
    return np.where(exists[..., None], np.stack(columns, axis=-1) - np.array(arm.offsets), np.nan), beyond


def wrapped(angle: Array) -> Array:
    """Returns angles within half a turn of zero, [rad]."""
    return angle - tau * np.round(angle / tau)


def _segments(
    table: Array, exists: NDArray[np.bool_], is_beyond: NDArray[np.bool_]
) -> tuple[Array, Array, NDArray[np.intp]]:
    """Returns starts and ends of short pieces of the self-motion and their branches, see `SelfMotion`.

    Most pieces connect adjacent angles of joint 7. At the end of a branch the self-motion continues on its twin: at the
    limit of reach on the other side of the flip, otherwise with the other sign of cos q5.
    """
    goes_on = exists & np.roll(exists, -1, axis=2)
    pieces = [(table[goes_on], np.roll(table, -1, axis=2)[goes_on])]
    group, sign, _ = np.nonzero(goes_on)
    for step in (-1, 1):
        last = exists & ~np.roll(exists, step, axis=2)
        flips = np.roll(is_beyond, step)[None, None]
        for twin, turns in ((table[::-1], flips), (table[:, ::-1], ~flips)):
            chosen = last & turns & np.isfinite(twin[..., 0])
            pieces.append((table[chosen], twin[chosen]))
    starts, ends = (np.concatenate(side) for side in zip(*pieces, strict=True))
    steps = wrapped(ends - starts)
    other = steps.copy()
    other[:, 1] *= -1.0
    branches = np.full(len(starts), -1)
    branches[: len(group)] = 2 * group + sign
    starts = np.concatenate((starts, _turned(starts)))
    turned = np.where(branches < 0, -1, branches + 4)
    return starts, starts + np.concatenate((steps, other)), np.concatenate((branches, turned))


def _turned(q: Array) -> Array:
    """Returns the twins of joint angles, shape (m, 7), [rad]: joints 1 and 3 turned by pi, joint 2 mirrored."""
    twins = q.copy()
    twins[:, [0, 2]] += pi
    twins[:, 1] *= -1.0
    return twins


def _unreachable(arm: OffsetGeometry, beyond: Array) -> UnreachableError:
    """Returns the error for a pose out of reach, with the distance, or for an impossible orientation of the wrist."""
    excess = float(beyond.min())
    shortest, longest = arm.reach
    if excess <= 0.0:
        return UnreachableError(
            "out of reach: the wrist could be there, but axis 5 cannot pass the elbow so that the tool has this "
            "orientation; turn the tool or move the target"
        )
    return UnreachableError(
        f"out of reach by {describe_excess(excess)}: the wrist has to be {shortest:.3f} to {longest:.3f} m from the "
        f"shoulder, at any angle of joint 7; move the target{unit_hint(excess)}",
        distance=excess,
    )
