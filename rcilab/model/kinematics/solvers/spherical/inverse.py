"""Closed-form inverse kinematics: every branch of the two geometries.

Both arms, when upright, are chains of turns about z and y: Rz Ry Rz Ry Rz Ry Rz for 7 axes, Rz Ry Ry Rz Ry Rz for 6.
Because Rz(a) Ry(-b) Rz(c) = Rz(a + pi) Ry(b) Rz(c - pi), one solution of a Rz Ry Rz group gives its twin by a flip of
the middle angle and half a turn on both sides. The 7-axis arm has three such groups, hence 8 branches at one arm
angle; the 6-axis arm has a wrist of that kind and up to 4 solutions of the first three joints, hence also 8.

Angles are computed by atan2 of both components, never by acos, and thus accurate close to a singularity. At a
singularity, where only the sum of two angles is determined, the first of them is that of `near`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import atan2, cos, hypot, pi, sin, sqrt, tau

from rcilab.core.errors import ModelError, SingularError, UnreachableError
from rcilab.core.spatial import Pose, Rotation9
from rcilab.model.kinematics.arm_angle import reference_frame
from rcilab.model.kinematics.solvers.solver import REACH_TOLERANCE, Angles, describe_excess, unit_hint
from rcilab.robots.description import DhRow, RobotDescription

_AXIS_LOST = 1e-12  # sin of an angle below which the axes before and after it are parallel within rounding.
_STRETCHED = 1e-15  # 1 - cos of the elbow angle that rounding alone can cause; it moves the wrist by less than 1e-15 m.
_QUARTER = pi / 2
_SEVEN = (-_QUARTER, _QUARTER, -_QUARTER, _QUARTER, -_QUARTER, _QUARTER, 0.0)
_SIXES: tuple[tuple[Angles, Angles, Angles], ...] = (
    ((-_QUARTER, 0.0, _QUARTER, -_QUARTER, _QUARTER, 0.0), (0.0, -_QUARTER, _QUARTER, 0.0, 0.0, 0.0), (1.0,) * 6),
    (
        (_QUARTER, 0.0, _QUARTER, -_QUARTER, _QUARTER, 0.0),
        (0.0, _QUARTER, _QUARTER, 0.0, 0.0, -pi),
        (1.0, -1.0, -1.0, 1.0, -1.0, 1.0),
    ),
)
"""Tables of 6 axes: turns of the rows, theta of the upright arm, signs of the joints. In the second one the axes of
joints 2, 3 and 5 point the other way."""
ALL_FLIPS: tuple[Angles, ...] = tuple(product((0.0, pi), repeat=3))
"""Every branch of a 7-axis arm; see `inverse_seven`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmGeometry:
    """The four lengths of an arm with a spherical shoulder or elbow pair and a spherical wrist, [m]."""

    n: int
    shoulder: float
    """Height of the shoulder above the base: d1."""
    upper: float
    """Shoulder to elbow: d3 of 7 axes, a2 of 6."""
    fore: float
    """Elbow to wrist centre: d5 of 7 axes, d4 of 6."""
    hand: float
    """Wrist centre to flange: d7 of 7 axes, d6 of 6."""
    offsets: Angles
    """Joint angle minus upright angle, [rad]: zero unless the table's theta offsets differ from the upright ones."""
    signs: Angles
    """+1, or -1 for a joint that turns the other way about y; then the angle is the offset minus the upright angle."""

    @property
    def is_upright(self) -> bool:
        """Whether joint angles are the upright ones."""
        return not any(self.offsets) and min(self.signs) > 0.0


def build_geometry(description: RobotDescription) -> ArmGeometry:
    """Returns the lengths for the closed form.

    Raises:
        ModelError: The table does not have one of the two required shapes.
    """
    dh = description.dh
    if len(dh) == 7 and _has_shape(dh, _SEVEN, d=(0, 2, 4, 6), a=()):
        offsets = tuple(-row.theta_offset for row in dh)
        lengths = {"shoulder": dh[0].d, "upper": dh[2].d, "fore": dh[4].d, "hand": dh[6].d}
        return ArmGeometry(n=7, **lengths, offsets=offsets, signs=(1.0,) * 7)
    for alphas, upright, signs in _SIXES:
        if len(dh) == 6 and _has_shape(dh, alphas, d=(0, 3, 5), a=(1,)):
            offsets = tuple(zero - row.theta_offset for row, zero in zip(dh, upright, strict=True))
            lengths = {"shoulder": dh[0].d, "upper": dh[1].a, "fore": dh[3].d, "hand": dh[5].d}
            return ArmGeometry(n=6, **lengths, offsets=offsets, signs=signs)
    raise ModelError(
        f"{description.name}: no closed-form inverse for this Denavit-Hartenberg table; it needs a 7-axis arm "
        "without offsets or a 6-axis arm with a spherical wrist"
    )


def inverse_seven(
    arm: ArmGeometry,
    T_base_flange: Pose,
    psi: float,
    near: Sequence[float] | None,
    flips: Sequence[Angles] = ALL_FLIPS,
) -> list[Angles]:
    """Returns the 8 branches of a 7-axis arm at one arm angle, [rad], also outside the joint limits.

    Args:
        arm: From `build_geometry`.
        T_base_flange: Pose of the flange in base.
        psi: Arm angle, [rad]. If the shoulder-wrist line is vertical, it is measured from base x.
        near: Joint angles, [rad], that resolve the ambiguity at a singularity; None means zeros.
        flips: The branches: pi for a negative upright joint 2, 4 or 6, otherwise 0.

    Raises:
        UnreachableError: The wrist centre is out of reach.
    """
    r, x, y, z, length, c4 = wrist_centre(arm, T_base_flange)
    guess = near or (0.0,) * 7
    if length < REACH_TOLERANCE:  # Upper arm and forearm of equal length, folded: any elbow is valid.
        ux, uy, uz, along, aside = 0.0, 0.0, 1.0, 0.0, arm.upper
    else:
        ux, uy, uz = x / length, y / length, z / length
        along = arm.upper * (arm.upper + arm.fore * c4) / length
        aside = arm.upper * arm.fore * sqrt(max(0.0, 1.0 - c4 * c4)) / length
    try:
        (ax, ay, az), (bx, by, bz) = reference_frame((ux, uy, uz))
    except SingularError:
        (ax, ay, az), (bx, by, bz) = (-uz, 0.0, 0.0), (0.0, -1.0, 0.0)
    cp, sp = aside * cos(psi), aside * sin(psi)
    # Shoulder to elbow, and elbow to wrist, in base.
    ex = along * ux + cp * ax + sp * bx
    ey = along * uy + cp * ay + sp * by
    ez = along * uz + cp * az + sp * bz
    fx, fy, fz = x - ex, y - ey, z - ez

    horizontal = hypot(ex, ey)
    q1 = atan2(ey, ex) if horizontal > _AXIS_LOST else guess[0]
    q2 = atan2(horizontal, ez)
    c1, s1, c2, s2 = cos(q1), sin(q1), cos(q2), sin(q2)
    # Elbow to wrist in the frame of link 2, Rz(q1) Ry(q2).
    vx = c2 * (c1 * fx + s1 * fy) - s2 * fz
    vy = c1 * fy - s1 * fx
    vz = s2 * (c1 * fx + s1 * fy) + c2 * fz
    side = hypot(vx, vy)
    q3 = atan2(vy, vx) if side > _AXIS_LOST else guess[2]
    q4 = atan2(side, vz)
    rotation = _turn_zy((c1 * c2, -s1, c1 * s2, s1 * c2, c1, s1 * s2, -s2, 0.0, c2), q3, q4)
    q5, q6, q7 = _wrist(rotation, r, guess[4])
    # Each angle and its twin; two half turns cancel.
    twins_1, twins_3 = (_wrap(q1), _wrap(q1 + pi)), (_wrap(q3), _wrap(q3 + pi))
    twins_5, twins_7 = (_wrap(q5), _wrap(q5 + pi)), (_wrap(q7), _wrap(q7 + pi))
    twins_2, twins_4, twins_6 = (q2, -q2), (q4, -q4), (q6, -q6)
    branches: list[Angles] = []
    for flip_2, flip_4, flip_6 in flips:
        i, j, k = flip_2 > 0.0, flip_4 > 0.0, flip_6 > 0.0
        branches.append((twins_1[i], twins_2[i], twins_3[i ^ j], twins_4[j], twins_5[j ^ k], twins_6[k], twins_7[k]))
    return branches if arm.is_upright else [_from_upright(arm, q) for q in branches]


def inverse_six(arm: ArmGeometry, T_base_flange: Pose, near: Sequence[float] | None) -> list[Angles]:
    """Returns the 8 branches of a 6-axis arm, [rad], also outside the joint limits.

    Args:
        arm: From `build_geometry`.
        T_base_flange: Pose of the flange in base.
        near: Joint angles, [rad], that resolve the ambiguity at a singularity; None means zeros.

    Raises:
        UnreachableError: The wrist centre is out of reach.
    """
    r, x, y, z, _, c3 = wrist_centre(arm, T_base_flange)
    guess = upright_angles(arm, near) if near else (0.0,) * 6
    s3 = sqrt(max(0.0, 1.0 - c3 * c3))
    horizontal = hypot(x, y)
    azimuth = atan2(y, x) if horizontal > _AXIS_LOST else guess[0]
    branches: list[Angles] = []
    for turn, radius in ((0.0, horizontal), (pi, -horizontal)):
        q1 = azimuth + turn
        for elbow in (1.0, -1.0):
            q3 = atan2(elbow * s3, c3)
            # Planar two-link arm in the (radius, height) plane, angles counted from the vertical.
            if radius or z:
                q2 = atan2(radius, z) - atan2(arm.fore * elbow * s3, arm.upper + arm.fore * c3)
            else:
                q2 = guess[1]  # Wrist on the shoulder: the upper arm may point anywhere.
            c1, s1 = cos(q1), sin(q1)
            c23, s23 = cos(q2 + q3), sin(q2 + q3)
            rotation = (c1 * c23, -s1, c1 * s23, s1 * c23, c1, s1 * s23, -s23, 0.0, c23)
            q4, q5, q6 = _wrist(rotation, r, guess[3])
            head = (_wrap(q1), _wrap(q2), q3)
            branches.append((*head, _wrap(q4), q5, _wrap(q6)))
            branches.append((*head, _wrap(q4 + pi), -q5, _wrap(q6 + pi)))
    return branches if arm.is_upright else [_from_upright(arm, q) for q in branches]


def wrist_centre(arm: ArmGeometry, T: Pose) -> tuple[Rotation9, float, float, float, float, float]:
    """Returns the rotation, the wrist centre from the shoulder, its distance, and the cosine of the elbow angle."""
    r, (px, py, pz) = T.parts
    x, y, z = px - arm.hand * r[2], py - arm.hand * r[5], pz - arm.hand * r[8] - arm.shoulder
    length = sqrt(x * x + y * y + z * z)
    upper, fore = arm.upper, arm.fore
    beyond = length - (upper + fore)
    inside = abs(upper - fore) - length
    if beyond > REACH_TOLERANCE or inside > REACH_TOLERANCE:
        raise reach_error(arm, length)
    c = (length * length - upper * upper - fore * fore) / (2.0 * upper * fore)
    if c > 1.0 - _STRETCHED:
        c = 1.0
    return r, x, y, z, length, max(-1.0, c)


def reach_error(arm: ArmGeometry, length: float) -> UnreachableError:
    """Returns the error for a wrist centre out of reach at this distance from the shoulder, [m]."""
    longest, shortest = arm.upper + arm.fore, abs(arm.upper - arm.fore)
    if length > longest:
        return UnreachableError(
            f"out of reach by {describe_excess(length - longest)}: the wrist centre would be {length:.3f} m from the "
            f"shoulder, the arm reaches {longest:.3f} m; move the target closer{unit_hint(length)}",
            distance=length - longest,
        ).coded("too_far", distance=length - longest)
    return UnreachableError(
        f"too close by {describe_excess(shortest - length)}: the wrist centre would be {length:.3f} m from the "
        f"shoulder, the folded arm keeps {shortest:.3f} m; move the target away",
        distance=shortest - length,
    ).coded("too_close", distance=shortest - length)


def _turn_zy(r: Rotation9, about_z: float, about_y: float) -> Rotation9:
    """Returns R Rz(about_z) Ry(about_y), row-major."""
    c, s, cy, sy = cos(about_z), sin(about_z), cos(about_y), sin(about_y)
    ax, ay, az = r[0] * c + r[1] * s, r[3] * c + r[4] * s, r[6] * c + r[7] * s
    return (
        ax * cy - r[2] * sy, r[1] * c - r[0] * s, ax * sy + r[2] * cy,
        ay * cy - r[5] * sy, r[4] * c - r[3] * s, ay * sy + r[5] * cy,
        az * cy - r[8] * sy, r[7] * c - r[6] * s, az * sy + r[8] * cy,
    )  # fmt: skip


def _wrist(a: Rotation9, b: Rotation9, guess: float) -> tuple[float, float, float]:
    """Returns the angles of Rz Ry Rz = A^T B, the middle one >= 0; `guess` is the first where the axes coincide."""
    zx = a[0] * b[2] + a[3] * b[5] + a[6] * b[8]
    zy = a[1] * b[2] + a[4] * b[5] + a[7] * b[8]
    zz = a[2] * b[2] + a[5] * b[5] + a[8] * b[8]
    side = hypot(zx, zy)
    first = atan2(zy, zx) if side > _AXIS_LOST else guess
    c, s = cos(first), sin(first)
    # Second row of Rz(-first) A^T B is (sin third, cos third, 0).
    mx, my, mz = c * a[1] - s * a[0], c * a[4] - s * a[3], c * a[7] - s * a[6]
    third = atan2(mx * b[0] + my * b[3] + mz * b[6], mx * b[1] + my * b[4] + mz * b[7])
    return first, atan2(side, zz), third


def _wrap(angle: float) -> float:
    """Returns the angle in (-pi, pi]; angles here are within two turns of it."""
    while angle > pi:
        angle -= tau
    while angle <= -pi:
        angle += tau
    return angle


def upright_angles(arm: ArmGeometry, q: Sequence[float]) -> Angles:
    """Returns the upright angles of joint angles, with their full turns, [rad]."""
    return tuple(sign * (angle - offset) for angle, offset, sign in zip(q, arm.offsets, arm.signs, strict=True))


def _from_upright(arm: ArmGeometry, q: Angles) -> Angles:
    return tuple(_wrap(sign * angle + offset) for angle, offset, sign in zip(q, arm.offsets, arm.signs, strict=True))


def _has_shape(dh: Sequence[DhRow], alphas: Angles, d: tuple[int, ...], a: tuple[int, ...]) -> bool:
    return all(
        abs(row.alpha - alpha) < _AXIS_LOST and (bool(row.d) == (i in d)) and (bool(row.a) == (i in a))
        for i, (row, alpha) in enumerate(zip(dh, alphas, strict=True))
    )
