"""A smooth curve of the tool through poses."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import dist, hypot

import numpy as np

from rcilab.core.spatial import Pose, rotation_between, rotation_from_wxyz, wxyz_from_rotation

_TURN_LENGTH = 0.1  # [m] A turn of 1 rad counts as much as this length between two poses.
_SAME = 1e-9  # [m] Poses that are closer are one.


class PoseSpline:
    """The natural cubic spline through positions and quaternions, by the distances between the poses.

    Its second derivative is continuous, and zero at both ends.

    Args:
        poses: At least two, of which neighbours differ.
    """

    def __init__(self, poses: Sequence[Pose]) -> None:
        rows = [[*poses[0].parts[1], *wxyz_from_rotation(poses[0].parts[0])]]
        knots = [0.0]
        self.turn = 0.0
        for before, pose in pairwise(poses):
            turn = hypot(*rotation_between(before.parts[0], pose.parts[0]))
            self.turn += turn
            knots.append(knots[-1] + dist(before.parts[1], pose.parts[1]) + _TURN_LENGTH * turn)
            quaternion = wxyz_from_rotation(pose.parts[0])
            # q and -q are the same orientation: the nearer one.
            sign = 1.0 if sum(map(float.__mul__, quaternion, rows[-1][3:])) >= 0.0 else -1.0
            rows.append([*pose.parts[1], *(sign * x for x in quaternion)])
        self.distance = knots[-1]
        self._goal = poses[-1]
        self._knots = knots
        t, values = np.array(knots), np.array(rows)
        h = np.diff(t)[:, np.newaxis]
        slopes = np.diff(values, axis=0) / h
        bends = np.zeros_like(values)
        if len(poses) > 2:
            matrix = np.diag(2.0 * (h[:-1, 0] + h[1:, 0])) + np.diag(h[1:-1, 0], 1) + np.diag(h[1:-1, 0], -1)
            bends[1:-1] = np.linalg.solve(matrix, 6.0 * np.diff(slopes, axis=0))
        first = slopes - h * (2.0 * bends[:-1] + bends[1:]) / 6.0
        third = np.diff(bends, axis=0) / (6.0 * h)
        self._pieces: list[list[tuple[float, float, float, float]]] = [
            list(zip(*(column.tolist() for column in piece), strict=True))
            for piece in zip(values[:-1], first, 0.5 * bends[:-1], third, strict=True)
        ]

    def at(self, share: float) -> Pose:
        """Returns the pose at a share of the sum of all distances, 0 to 1."""
        if share >= 1.0:
            return self._goal
        s = share * self.distance
        piece = min(bisect_right(self._knots, s), len(self._pieces)) - 1
        u = s - self._knots[piece]
        x, y, z, *wxyz = (a + u * (b + u * (c + u * d)) for a, b, c, d in self._pieces[piece])
        return Pose.from_parts(rotation_from_wxyz(wxyz), (x, y, z))


def without_repetitions(poses: Sequence[Pose]) -> list[Pose]:
    """Returns poses of which neighbours differ."""
    kept = [poses[0]]
    for pose in poses[1:]:
        last = kept[-1]
        turn = hypot(*rotation_between(last.parts[0], pose.parts[0]))
        if dist(last.parts[1], pose.parts[1]) + _TURN_LENGTH * turn > _SAME:
            kept.append(pose)
    return kept
