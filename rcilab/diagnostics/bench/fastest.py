"""The least time of a straight motion from rest to rest: what planned durations are held against."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.limits import JointLimits


def fastest_straight(limits: JointLimits, way: JointVector, part: float = 1.0, jerk_part: float = 1.0) -> float:
    """Returns the least time in which all joints go straight, and together, by a way from rest to rest, [s].

    The way is a single coordinate from 0 to 1, bounded by whichever joint allows least, and driven in seven steps
    (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, 3.4).

    Args:
        limits: Bounds of the joints.
        way: By how far each joint moves, shape (n,), not all zero, [rad].
        part: Part of the velocity and acceleration limits to use.
        jerk_part: Part of the jerk limits to use.
    """
    moves = way != 0.0
    size = np.abs(way[moves])
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


def slowest_alone(limits: JointLimits, way: JointVector) -> float:
    """Returns the least time of the joint that needs most by itself, [s]: a bound for any motion, straight or not.

    Args:
        limits: Bounds of the joints.
        way: By how far each joint moves, shape (n,), not all zero, [rad].
    """
    alone = (np.where(np.arange(len(way)) == joint, way, 0.0) for joint in np.flatnonzero(way))
    return max(fastest_straight(limits, one) for one in alone)
