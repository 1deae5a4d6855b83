"""The feasible arm angles of an arm without offsets, in closed form.

At a fixed pose the elbow E = S + e circles the shoulder-wrist line, e = e0 + ec cos(psi) + es sin(psi). Every joint
angle follows as atan2(Y, X), or as an angle between 0 and pi of known cosine, where X, Y and that cosine are linear in
(1, cos(psi), sin(psi)) (Shimizu et al., IEEE Transactions on Robotics 24(5), 2008, write the same with
tangents). So a joint passes a limit L only where X sin(L) - Y cos(L) = 0 or where the cosine is cos(L): two arm angles
each, in closed form. Between adjacent ones of these nothing changes, so the middle determines the whole arc.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from math import acos, cos, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.arm_angle import reference_frame
from rcilab.model.kinematics.elbow_ranges import Arc, FeasibleArcs, Reason
from rcilab.model.kinematics.solvers.solver import Angles
from rcilab.model.kinematics.solvers.spherical.inverse import ALL_FLIPS, ArmGeometry, wrist_centre
from rcilab.model.kinematics.solvers.spherical.singularity import SINGULAR

_TINY = 1e-9  # Of a sine or a length in [m]: below it the elbow has no circle, or the circle no upper side.
_SAME = 1e-12  # [rad] Rounding of arm angles.
_TURNS = {0: 0, 2: 1, 4: 2, 6: 3}  # Joints that turn about z, counted from 0: which form is their X; Y is 4 further.
_BENDS = {1: 8, 5: 9}  # Joints that bend about y, whose bend changes on the circle: which form is their cosine.
_TURNING, _BENDING = slice(0, None, 2), slice(1, None, 4)  # The same joints, in the order of their forms.
_FLIPS = np.array(ALL_FLIPS) > 0.0  # Shape (8, 3): which of upright joints 2, 4 and 6 are negative.
_TURNED = np.stack(  # Shape (7, 8): which branches turn or mirror each joint, see `inverse_seven`.
    (
        _FLIPS[:, 0],
        _FLIPS[:, 0],
        _FLIPS[:, 0] ^ _FLIPS[:, 1],
        _FLIPS[:, 1],
        _FLIPS[:, 1] ^ _FLIPS[:, 2],
        _FLIPS[:, 2],
        _FLIPS[:, 2],
    )
)
_TWINS = 2 * np.arange(7)[:, None] + _TURNED  # Which of every joint's two angles, counted through, a branch has.
_MEMBERS = tuple(tuple(i for i in range(8) if bits >> i & 1) for bits in range(256))
"""By number: the indices of its set bits, from 0."""
_NUMBERS = tuple(tuple(i + 1 for i in members) for members in _MEMBERS)
"""The same, from 1."""
_SIZES = np.array([len(members) for members in _MEMBERS])
_WHY: list[Reason] = ["joint limits", "singularity", "safety box"]
_REASONS: dict[tuple[bool, ...], tuple[Reason, ...]] = {
    found: tuple(why for why, is_so in zip(_WHY, found, strict=True) if is_so)
    for found in itertools.product((False, True), repeat=len(_WHY))
}
"""By whether a joint limit, a singularity and the safety box forbid an arc."""


def feasible_arcs(
    arm: ArmGeometry, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool = False
) -> FeasibleArcs:
    """Returns the feasible arm angles of a pose.

    An arm angle is singular if `find_singularity` finds a singularity at it.

    Args:
        arm: Of 7 axes, from `build_geometry`.
        T_base_flange: Pose of the flange in base.
        lower: Smallest joint angles, shape (7,), [rad].
        upper: Largest joint angles, shape (7,), [rad].
        outside_box: Whether the tool is outside the safety box, which does not depend on the arm angle.

    Raises:
        UnreachableError: The wrist centre is out of reach.
    """
    r, x, y, z, length, c4 = wrist_centre(arm, T_base_flange)
    s4 = sqrt(max(0.0, 1.0 - c4 * c4))
    horizontal = sqrt(x * x + y * y)
    if s4 < _TINY or horizontal < _TINY:
        nowhere = Arc(start=-pi, end=pi, reasons=_REASONS[False, True, outside_box], joints=(), branches=())
        return FeasibleArcs(arcs=(nowhere,))
    forms = _linear_forms(arm, r, (x, y, z), length, c4, s4)
    starts = _breaks(forms, _crossings(tuple(lower.tolist()), tuple(upper.tolist()), arm.offsets))
    middle = 0.5 * starts
    middle[:-1] += middle[1:]
    middle[-1] += 0.5 * (starts[0] + tau)
    values = forms[:, 1:2] * np.cos(middle) + forms[:, 2:3] * np.sin(middle) + forms[:, 0:1]
    both, lost = _angles_at(values, acos(c4), arm.offsets)
    lost |= s4 < SINGULAR or horizontal < SINGULAR * length
    return FeasibleArcs(arcs=tuple(_arcs(starts, _exceeded(both, lower, upper), lost, outside_box)))


def _linear_forms(
    arm: ArmGeometry, r: tuple[float, ...], wrist: tuple[float, float, float], length: float, c4: float, s4: float
) -> Array:
    """Returns X1 X3 X5 X7 Y1 Y3 Y5 Y7 cos2 cos6 as factors of (1, cos psi, sin psi), shape (10, 3)."""
    upper, fore = arm.upper, arm.fore
    x, y, z = wrist
    ux, uy, uz = x / length, y / length, z / length
    (ax, ay, az), (bx, by, _) = reference_frame((ux, uy, uz))
    along, aside = upper * (upper + fore * c4) / length, upper * fore * s4 / length
    dot = upper * fore * c4  # Of shoulder to elbow and elbow to wrist, the same all round.
    r0, r1, hx, r3, r4, hy, r6, r7, hz = r
    tx, ty, tz = y * hz - z * hy, z * hx - x * hz, x * hy - y * hx
    columns: list[tuple[float, ...]] = []
    for (ex, ey, ez), (wx, wy, wz) in (
        ((along * ux, along * uy, along * uz), wrist),
        ((aside * ax, aside * ay, aside * az), (0.0, 0.0, 0.0)),
        ((aside * bx, aside * by, 0.0), (0.0, 0.0, 0.0)),
    ):
        fx, fy, fz = wx - ex, wy - ey, wz - ez  # Elbow to wrist.
        ahead = hx * fx + hy * fy + hz * fz
        columns.append(
            (
                ex,
                ez * (dot / upper) - upper * fz,
                dot * ahead - fore * fore * (hx * ex + hy * ey + hz * ez),
                -(r0 * fx + r3 * fy + r6 * fz),
                ey,
                y * ex - x * ey,  # (e x w) . z
                fore * (tx * ex + ty * ey + tz * ez),
                r1 * fx + r4 * fy + r7 * fz,
                ez / upper,
                ahead / fore,
            )
        )
    return np.array(columns).T


def _breaks(forms: Array, crossings: tuple[Array, Array]) -> Array:
    """Returns the arm angles at which a joint may pass a limit or a singularity begin or end, sorted, [rad]."""
    factors, levels = crossings
    lines = factors @ forms
    c, a, b = lines[:, 0] - levels, lines[:, 1], lines[:, 2]
    radius = np.sqrt(a * a + b * b)
    is_met = (np.abs(c) <= radius) & (radius > 0.0)
    half = np.arccos(-c[is_met] / radius[is_met])
    towards = np.arctan2(b[is_met], a[is_met])
    found = np.sort((np.concatenate((towards - half, towards + half)) + pi) % tau - pi)
    if not len(found):
        return np.array((-pi,))
    is_distinct = np.ones(len(found), dtype=np.bool_)
    is_distinct[1:] = found[1:] - found[:-1] > _SAME
    if len(found) > 1:  # Around the circle.
        is_distinct[0] = found[0] + tau - found[-1] > _SAME
    return found[is_distinct]


@lru_cache(maxsize=16)
def _crossings(lower: tuple[float, ...], upper: tuple[float, ...], offsets: tuple[float, ...]) -> tuple[Array, Array]:
    """Returns which combinations of the ten forms, shape (lines, 10), cross which levels, shape (lines,)."""
    factors: list[list[float]] = []
    levels: list[float] = []

    def add(row: dict[int, float], level: float) -> None:
        factors.append([row.get(column, 0.0) for column in range(10)])
        levels.append(level)

    for joint in range(7):
        low, high = max(-pi, lower[joint]), min(pi, upper[joint])
        bounds = set[float]() if high - low >= tau else {low - offsets[joint], high - offsets[joint]}
        if joint in _TURNS:
            x = _TURNS[joint]
            for bound in bounds:
                add({x: sin(bound), x + 4: -cos(bound)}, 0.0)
        elif joint in _BENDS:
            slight = sqrt(1.0 - SINGULAR * SINGULAR)
            for level in {cos(bound) for bound in bounds} | {slight, -slight}:
                add({_BENDS[joint]: 1.0}, level)
    return np.array(factors), np.array(levels)


def _angles_at(values: Array, q4: float, offsets: Angles) -> tuple[Array, NDArray[np.bool_]]:
    """Returns both angles that every joint has in some branch, shape (7, 2, m), and where the arm is singular.

    The first is that of the branch with no flip, the second its twin.
    """
    both = np.empty((7, 2, values.shape[1]))
    q, twin = both[:, 0], both[:, 1]
    np.arctan2(values[4:8], values[0:4], out=q[_TURNING])
    np.arccos(np.minimum(np.maximum(values[8:10], -1.0), 1.0), out=q[_BENDING])
    q[3] = q4
    unbent = np.sin(q[_BENDING]) < SINGULAR
    np.negative(q, out=twin)
    np.add(q[_TURNING], pi, out=twin[_TURNING])
    if any(offsets):
        both += np.array(offsets)[:, None, None]
    both -= tau * np.ceil((both - pi) / tau)
    return both, unbent[0] | unbent[1]


def _exceeded(both: Array, lower: Array, upper: Array) -> NDArray[np.uint8]:
    """Returns the joints beyond their limits in every branch, as bits from that of joint 1, shape (8, m)."""
    beyond = (both <= lower[:, None, None]) | (both >= upper[:, None, None])
    return np.packbits(beyond.reshape(14, -1).take(_TWINS, axis=0), axis=0, bitorder="little")[0]


def _arcs(starts: Array, exceeded: NDArray[np.uint8], lost: NDArray[np.bool_], outside: bool) -> list[Arc]:
    """Returns arcs, with equal neighbours merged."""
    best = exceeded[_SIZES.take(exceeded).argmin(axis=0), np.arange(len(starts))]
    possible = np.packbits(exceeded == 0, axis=0, bitorder="little")[0]
    looks = best + 256 * possible.astype(np.intp) + 65536 * lost  # Everything an arc reports.
    is_new = np.empty(len(starts), dtype=np.bool_)
    np.not_equal(looks[1:], looks[:-1], out=is_new[1:])
    is_new[0] = looks[0] != looks[-1] or not is_new[1:].any()
    begins = starts[is_new].tolist()
    arcs: list[Arc] = []
    for start, end, look in zip(begins, [*begins[1:], begins[0] + tau], looks[is_new].tolist(), strict=True):
        joints, branches = _NUMBERS[look & 255], _MEMBERS[look >> 8 & 255]
        reasons = _REASONS[bool(joints), look > 65535, outside]
        arcs.append(Arc(start=start, end=end, reasons=reasons, joints=joints, branches=branches))
    return arcs
