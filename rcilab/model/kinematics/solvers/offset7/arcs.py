"""The feasible arm angles of an arm with offsets, from its self-motion, piece by piece.

The angle at which a joint passes its limit has no closed form here. Pieces of the self-motion that contain one, and
those between two branches, are divided until the angle is known with sufficient accuracy.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import Arc, FeasibleArcs, Reason
from rcilab.model.kinematics.solvers.newton import refine
from rcilab.model.kinematics.solvers.offset7.arm import ELBOW, OffsetGeometry, SelfMotion, wrapped
from rcilab.model.kinematics.solvers.offset7.singularity import held_singularity_path

_CUTS = 8  # Number of parts of a divided piece; tuning value.
_ROUNDS = 4  # Number of divisions: a piece of 0.1 rad then is 2e-5 rad long.
_LONG = 0.1  # [rad] A longer piece between two branches is curved and divided once in any case.
_SLIVER = 1e-4  # [rad] Shorter arcs are merged.
_GRID = 1e-9  # [rad] Ends of pieces that differ by less are equal.
_SINGULAR = 1 << 7
"""Bit of a singularity, after the bits of the joints."""
_NOWHERE = 1 << 8
"""Code of an angle without a branch."""


def feasible_offset_arcs(
    arm: OffsetGeometry, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool = False
) -> FeasibleArcs:
    """Returns the feasible arm angles of a pose; the ends of its arcs are accurate to about 1e-4 rad, on the safe side.

    Args:
        arm: From `build_offset_geometry`.
        T_base_flange: Pose of the flange in base.
        lower: Smallest joint angles, shape (7,), [rad].
        upper: Largest joint angles, shape (7,), [rad].
        outside_box: Whether the tool is outside the safety box, which does not depend on the arm angle.

    Raises:
        UnreachableError: The pose is out of reach at every arm angle.
    """
    starts, ends, codes = _pieces(arm, T_base_flange, lower, upper)
    low = np.round(np.minimum(starts, ends) / _GRID) * _GRID
    high = np.round(np.maximum(starts, ends) / _GRID) * _GRID
    turns = tau * np.floor((low + pi) / tau)
    low, high = low - turns, high - turns
    over = high > pi  # Beyond pi: the rest begins at -pi.
    low = np.concatenate((low, np.full(int(over.sum()), -pi)))
    high, codes = np.concatenate((np.minimum(high, pi), high[over] - tau)), np.concatenate((codes, codes[over]))
    breaks = np.unique(np.concatenate((low, high, (-pi, pi))))
    best = np.full(len(breaks) - 1, _NOWHERE)
    # The code of the best branch; of equal ones a singularity, because it has joint angles.
    for code in sorted(set(codes.tolist()), key=lambda code: (-code.bit_count(), code & _SINGULAR, -code)):
        change = np.zeros(len(breaks))
        chosen = codes == code
        np.add.at(change, np.searchsorted(breaks, low[chosen]), 1.0)
        np.add.at(change, np.searchsorted(breaks, high[chosen]), -1.0)
        best[np.cumsum(change)[:-1] > 0.5] = code
    first = np.flatnonzero(np.concatenate(([True], best[1:] != best[:-1])))
    begins = breaks[first].tolist()
    arcs: list[Arc] = []
    for start, end, i in zip(begins, [*begins[1:], pi], first.tolist(), strict=True):
        if (
            arcs and end - start < _SLIVER and best[i] and not arcs[-1].ok
        ):  # Remainder of a division between two reasons.
            arcs[-1] = replace(arcs[-1], end=end)
        else:
            arcs.append(_arc(start, end, int(best[i]), outside_box))
    return FeasibleArcs(arcs=tuple(arcs))


def _pieces(
    arm: OffsetGeometry, T_base_flange: Pose, lower: Array, upper: Array
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Returns arm angles at both ends of pieces, and the code of each: joints beyond their limits, singularity."""
    motion = SelfMotion(arm, T_base_flange)
    middles = np.array(arm.middles)
    bits = 1 << np.arange(7)

    def exceeded(q: Array, nearness: Array) -> NDArray[np.int64]:
        angle = wrapped(q - middles) + middles
        beyond = np.asarray(((angle <= lower) | (angle >= upper)) @ bits, dtype=np.int64)
        return beyond + _SINGULAR * (nearness >= 1.0)

    starts, ends, branches = motion.starts, motion.ends, motion.branches
    half = len(starts) // 2  # The other half are twins with the same determinants.
    nearness = held_singularity_path(arm, np.concatenate((starts[:half], ends[:half]))).reshape(2, half)
    before, after = (exceeded(q, np.tile(near, 2)) for q, near in zip((starts, ends), nearness, strict=True))
    cut = (before != after) | ((branches < 0) & (np.abs(ends - starts).max(axis=1) > _LONG))
    done: list[tuple[Array, Array, NDArray[np.int64]]] = []
    shares = np.linspace(0.0, 1.0, _CUTS + 1)[:, None, None]
    for _ in range(_ROUNDS):
        done.append((starts[~cut, ELBOW], ends[~cut, ELBOW], before[~cut]))
        between = starts[cut] + shares * (ends - starts)[cut]
        whole = _placed(arm, motion, T_base_flange, between.reshape(-1, 7), np.tile(branches[cut], _CUTS + 1))
        whole = whole.reshape(between.shape)
        q = whole.reshape(-1, 7)
        codes = exceeded(q, held_singularity_path(arm, q)).reshape(_CUTS + 1, -1)
        good = np.abs(whole - between).max(axis=2) < 2.0 * _LONG  # False for NaN.
        both = good[:-1] & good[1:]
        starts, ends, before, after = whole[:-1][both], whole[1:][both], codes[:-1][both], codes[1:][both]
        branches = np.broadcast_to(branches[cut], (_CUTS, int(cut.sum())))[both]
        cut = before != after
    done.append((starts[:, ELBOW], ends[:, ELBOW], before | after))
    first, last, found = zip(*done, strict=True)
    return np.concatenate(first), np.concatenate(last), np.concatenate(found)


def _placed(
    arm: OffsetGeometry, motion: SelfMotion, T_base_flange: Pose, guesses: Array, branches: NDArray[np.intp]
) -> Array:
    """Returns the points of the self-motion near guesses, shape (m, 7), [rad]; NaN without one."""
    whole = np.full_like(guesses, np.nan)
    on = branches >= 0
    whole[on] = motion.on_branches(guesses[on], branches[on])
    count = int((~on).sum())
    rotations = np.broadcast_to(T_base_flange.rotation, (count, 3, 3))
    positions = np.broadcast_to(T_base_flange.position, (count, 3))
    found, settled = refine(arm.chain, ELBOW, rotations, positions, guesses[~on])
    found[~settled] = np.nan
    whole[~on] = found
    return whole


def _arc(start: float, end: float, code: int, outside: bool) -> Arc:
    reasons: list[Reason] = []
    joints = () if code == _NOWHERE else tuple(joint + 1 for joint in range(7) if code >> joint & 1)
    if code == _NOWHERE:
        reasons.append("reach")
    if joints:
        reasons.append("joint limits")
    if code != _NOWHERE and code & _SINGULAR:
        reasons.append("singularity")
    if outside:
        reasons.append("safety box")
    return Arc(start=start, end=end, reasons=tuple(reasons), joints=joints, branches=())
