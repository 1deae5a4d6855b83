"""Minimum times of motions from rest to rest, as reference for planned durations."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.limits import JointLimits


def fastest_straight(
    limits: JointLimits, displacement: JointVector, part: float = 1.0, jerk_part: float = 1.0
) -> float:
    """Returns the minimum time of a straight, synchronised joint motion from rest to rest, [s].

    The path is a single coordinate from 0 to 1, bounded by the most restrictive joint, with a profile of seven segments
    (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, 3.4).

    Args:
        limits: Bounds of the joints.
        displacement: Displacement of each joint, shape (n,), not all zero, [rad].
        part: Fraction of the velocity and acceleration limits to use.
        jerk_part: Fraction of the jerk limits to use.
    """
    moves = displacement != 0.0
    size = np.abs(displacement[moves])
    v, a, j = (
        float((bound[moves] / size).min())
        for bound in (part * limits.velocity, part * limits.acceleration, jerk_part * limits.jerk)
    )
    rise = v / a + a / j if v * j > a * a else 2.0 * (v / j) ** 0.5
    if v * rise <= 1.0:
        return 1.0 / v + rise
    if 2.0 * (a / j) ** 2 * a <= 1.0:
        return a / j + ((a / j) ** 2 + 4.0 / a) ** 0.5
    return 4.0 * float(np.cbrt(0.5 / j))


def slowest_alone(limits: JointLimits, displacement: JointVector) -> float:
    """Returns the minimum time of the slowest joint by itself, [s], a lower bound for any motion.

    Args:
        limits: Bounds of the joints.
        displacement: Displacement of each joint, shape (n,), not all zero, [rad].
    """
    joints = np.arange(len(displacement))
    alone = (np.where(joints == joint, displacement, 0.0) for joint in np.flatnonzero(displacement))
    return max(fastest_straight(limits, one) for one in alone)
