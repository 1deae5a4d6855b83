"""Which arm angles a pose leaves to a 7-axis arm: arcs of the elbow's circle, and why the others are forbidden.

At a fixed pose the elbow E = S + e goes round the shoulder-wrist line, e = e0 + ec cos(psi) + es sin(psi). Every joint
angle follows as atan2(Y, X), or as an angle between 0 and pi of known cosine, where X, Y and that cosine are linear in
(1, cos(psi), sin(psi)) (Shimizu et al., IEEE Transactions on Robotics 24(5), 2008, write the same with
tangents). So a joint passes a limit L only where X sin(L) - Y cos(L) = 0 or where the cosine is cos(L): two arm angles
each, in closed form. Between neighbours of all of these nothing changes, and one look in the middle judges the arc.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from math import acos, cos, pi, sin, sqrt, tau
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.arrays import Array
from rcilab.kinematics.arm_angle import reference_frame
from rcilab.kinematics.inverse import ALL_FLIPS, ArmGeometry, wrist_centre
from rcilab.kinematics.singularity import SINGULAR
from rcilab.spatial import Pose

Reason: TypeAlias = Literal["joint limits", "singularity", "safety box"]

_TINY = 1e-9  # Of a sine or a length in [m]: below it the elbow has no circle, or the circle no upper side.
_SAME = 1e-12  # [rad] Arm angles that differ by rounding alone.
_TURNS = {0: 0, 2: 3, 4: 5, 6: 8}  # Joints that turn about z, counted from 0: which form is their X; Y is the next.
_BENDS = {1: 2, 5: 7}  # Joints that bend about y, whose bend changes on the circle: which form is their cosine.
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
).astype(np.intp)
_JOINTS, _BRANCHES = range(1, 8), range(8)
_WHY: tuple[Reason, ...] = ("joint limits", "singularity", "safety box")
_REASONS = {
    found: tuple(itertools.compress(_WHY, found)) for found in itertools.product((False, True), repeat=len(_WHY))
}
"""By whether a joint limit, a singularity and the safety box forbid an arc."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arc:
    """A range of arm angles in which nothing changes."""

    start: float
    """[rad] in [-pi, pi)."""
    end: float
    """[rad], above start by at most a full turn."""
    reasons: tuple[Reason, ...]
    """What forbids it; empty where the arm can stand."""
    joints: tuple[int, ...]
    """Numbers (from 1) of the joints beyond their limits in the branch that breaks fewest; empty if one breaks none."""
    branches: tuple[int, ...]
    """Which branches, counted from 0 as in `Solutions.all`, keep every joint limit."""

    @property
    def ok(self) -> bool:
        """Whether the arm can stand here, in at least one branch."""
        return not self.reasons

    def holds(self, psi: float) -> bool:
        """Returns whether an arm angle, [rad], is in this range, ends included."""
        return (psi - self.start) % tau <= self.end - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class FeasibleArcs:
    """The whole circle of arm angles at one pose."""

    arcs: tuple[Arc, ...]
    """One after the other, from the smallest start; together a full turn."""

    @property
    def feasible(self) -> tuple[tuple[float, float], ...]:
        """Ranges (start, end) of arm angles where the arm can stand in at least one branch, [rad], end above start."""
        return _joined([(arc.start, arc.end) for arc in self.arcs if arc.ok])

    def of_branch(self, branch: int) -> tuple[tuple[float, float], ...]:
        """Returns the ranges (start, end), [rad], in which one branch, 0 to 7, stays possible all along."""
        return _joined([(arc.start, arc.end) for arc in self.arcs if arc.ok and branch in arc.branches])

    def at(self, psi: float) -> Arc:
        """Returns the arc that an arm angle, [rad], is in."""
        return next((arc for arc in self.arcs if arc.holds(psi)), self.arcs[0])

    def __repr__(self) -> str:
        ranges = ", ".join(f"{np.degrees(start):.1f} to {np.degrees(end):.1f}" for start, end in self.feasible)
        why = sorted({reason for arc in self.arcs for reason in arc.reasons})
        return f"<FeasibleArcs at {ranges or 'no arm angle'} deg; forbidden by: {', '.join(why) or 'nothing'}>"


def feasible_arcs(
    arm: ArmGeometry, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool = False
) -> FeasibleArcs:
    """Returns the feasible arm angles of a pose.

    Singular are the arm angles at which `find_singularity` names one.

    Args:
        arm: Of 7 axes, from `rcilab.kinematics.inverse.build_geometry`.
        T_base_flange: Pose of the flange in base.
        lower: Smallest joint angles, shape (7,), [rad].
        upper: Largest joint angles, shape (7,), [rad].
        outside_box: Whether the tool is outside the safety box. It is so at every arm angle or at none.

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
    q, lost = _angles_at(values, acos(c4))
    lost |= s4 < SINGULAR or horizontal < SINGULAR * length
    broken = _broken(q, np.array(arm.offsets), lower, upper)
    return FeasibleArcs(arcs=tuple(_arcs(starts, broken, lost, outside_box)))


def _linear_forms(
    arm: ArmGeometry, r: tuple[float, ...], wrist: tuple[float, float, float], length: float, c4: float, s4: float
) -> Array:
    """Returns X1 Y1 cos2 X3 Y3 X5 Y5 cos6 X7 Y7 as factors of (1, cos psi, sin psi), shape (10, 3)."""
    upper, fore = arm.upper, arm.fore
    ux, uy, uz = wrist[0] / length, wrist[1] / length, wrist[2] / length
    (ax, ay, az), (bx, by, _) = reference_frame((ux, uy, uz))
    along, aside = upper * (upper + fore * c4) / length, upper * fore * s4 / length
    e = np.array(
        (
            (along * ux, aside * ax, aside * bx),
            (along * uy, aside * ay, aside * by),
            (along * uz, aside * az, 0.0),
        )
    )
    f = -e  # Elbow to wrist.
    f[:, 0] += wrist
    dot = upper * fore * c4  # e . f, the same all round.
    (wx, wy, wz), (hx, hy, hz) = wrist, (r[2], r[5], r[8])
    ahead = np.array((hx, hy, hz))
    forms = np.empty((10, 3))
    forms[0:2] = e[:2]
    forms[2] = e[2] / upper
    forms[3] = e[2] * (dot / upper) - upper * f[2]
    forms[4] = wy * e[0] - wx * e[1]  # (e x w) . z
    forms[5] = ahead @ (dot * f - fore * fore * e)
    forms[6] = fore * np.array((wy * hz - wz * hy, wz * hx - wx * hz, wx * hy - wy * hx)) @ e
    forms[7] = ahead @ f / fore
    forms[8] = -np.array((r[0], r[3], r[6])) @ f
    forms[9] = np.array((r[1], r[4], r[7])) @ f
    return forms


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
            bounds |= {acos(SINGULAR), acos(-SINGULAR)} if joint in (2, 4) else set()
            for bound in bounds:
                add({x: sin(bound), x + 1: -cos(bound)}, 0.0)
        elif joint in _BENDS:
            slight = sqrt(1.0 - SINGULAR * SINGULAR)
            for level in {cos(bound) for bound in bounds} | {slight, -slight}:
                add({_BENDS[joint]: 1.0}, level)
    return np.array(factors), np.array(levels)


def _angles_at(values: Array, q4: float) -> tuple[Array, NDArray[np.bool_]]:
    """Returns upright joint angles of the branch with no flip, shape (7, m), and where the arm is singular."""
    q = np.empty((7, values.shape[1]))
    for joint, x in _TURNS.items():
        q[joint] = np.arctan2(values[x + 1], values[x])
    for joint, row in _BENDS.items():
        q[joint] = np.arccos(np.clip(values[row], -1.0, 1.0))
    q[3] = q4
    unbent_2, unbent_6 = np.sin(q[1]) < SINGULAR, np.sin(q[5]) < SINGULAR
    across_3, across_5 = np.abs(np.cos(q[2])) < SINGULAR, np.abs(np.cos(q[4])) < SINGULAR
    return q, (unbent_2 & across_3) | (unbent_6 & across_5) | (unbent_2 & unbent_6)


def _broken(q: Array, offsets: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Returns which joints are beyond their limits in which branch, shape (7, 8, m)."""
    twin = -q
    turning = list(_TURNS)
    twin[turning] = q[turning] + pi
    both = np.stack((q, twin), axis=1) + offsets[:, None, None]
    both -= tau * np.ceil((both - pi) / tau)
    beyond = (both <= lower[:, None, None]) | (both >= upper[:, None, None])
    return beyond[np.arange(7)[:, None], _TURNED]


def _arcs(starts: Array, broken: NDArray[np.bool_], lost: NDArray[np.bool_], outside: bool) -> list[Arc]:
    """Returns arcs without neighbours that are alike."""
    counts = broken.sum(axis=0)
    best = broken[:, counts.argmin(axis=0), np.arange(len(starts))]
    looks = np.concatenate((best, counts == 0, lost[None]))  # All that an arc says, one column an arc.
    is_new = np.empty(len(starts), dtype=np.bool_)
    is_new[1:] = (looks[:, 1:] != looks[:, :-1]).any(axis=0)
    is_new[0] = (looks[:, 0] != looks[:, -1]).any() or not is_new[1:].any()
    first = np.flatnonzero(is_new)
    begins = starts[first].tolist()
    arcs: list[Arc] = []
    for start, end, look in zip(begins, [*begins[1:], begins[0] + tau], looks[:, first].T.tolist(), strict=True):
        joints, branches = tuple(itertools.compress(_JOINTS, look)), tuple(itertools.compress(_BRANCHES, look[7:]))
        reasons = _REASONS[bool(joints), look[15], outside]
        arcs.append(Arc(start=start, end=end, reasons=reasons, joints=joints, branches=branches))
    return arcs


def _joined(ranges: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Returns ranges of a circle, given in order, with those in one that meet."""
    joined: list[tuple[float, float]] = []
    for start, end in ranges:
        if joined and start - joined[-1][1] < _SAME:
            start = joined.pop()[0]
        joined.append((start, end))
    if len(joined) > 1 and abs(joined[0][0] + tau - joined[-1][1]) < _SAME:
        joined[-1] = joined[-1][0], joined[0][1] + tau
        del joined[0]
    return tuple(joined)
