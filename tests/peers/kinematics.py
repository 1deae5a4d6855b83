"""Just enough kinematics for a peer's programs, from the manual's DH convention: no code shared with the package."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

_ALPHAS = (-math.pi / 2, math.pi / 2, -math.pi / 2, math.pi / 2, -math.pi / 2, math.pi / 2, 0.0)


class Model:
    """The 7-axis model library: it reads only d of joints 1, 3, 5 and 7 from the download, all else is built in.

    Args:
        numbers: What LoadRobotModel served; the first 28 are rows of a [mm], alpha, d [mm], theta.
    """

    def __init__(self, numbers: Sequence[float]) -> None:
        lengths = np.array(numbers[2:28:4]) / 1000.0
        self.d = np.where(np.arange(7) % 2 == 0, lengths, 0.0)

    def frames(self, q: Sequence[float]) -> list[Matrix]:
        """Returns the base frame and the frames after each joint, (4, 4) each."""
        frames = [np.eye(4)]
        for angle, alpha, d in zip(q, _ALPHAS, self.d, strict=True):
            c, s, ca, sa = math.cos(angle), math.sin(angle), math.cos(alpha), math.sin(alpha)
            frames.append(
                frames[-1] @ np.array([[c, -s * ca, s * sa, 0], [s, c * ca, -c * sa, 0], [0, sa, ca, d], [0, 0, 0, 1]])
            )
        return frames

    def pose(self, q: Sequence[float]) -> Matrix:
        """Returns the flange in the base frame."""
        return self.frames(q)[7]

    def jacobian(self, q: Sequence[float]) -> Matrix:
        """Returns the flange's Jacobian, (6, 7), linear rows first, base axes."""
        frames = self.frames(q)
        tip = frames[7][:3, 3]
        columns = [np.concatenate((np.cross(f[:3, 2], tip - f[:3, 3]), f[:3, 2])) for f in frames[:7]]
        return np.array(columns).T

    def arm_angle(self, q: Sequence[float]) -> float:
        """Returns psi, [rad]: how far the elbow has turned out of the vertical plane of shoulder and wrist."""
        frames = self.frames(q)
        shoulder, elbow, wrist = (frames[k][:3, 3] for k in (1, 3, 5))
        u = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
        up = np.array([0.0, 0.0, 1.0])
        up = up - (up @ u) * u
        out = elbow - shoulder
        out = out - (out @ u) * u
        return math.atan2(float(u @ np.cross(up, out)), float(up @ out))


def matrix(pose: Sequence[float]) -> Matrix:
    """Returns 16 numbers, row by row, as a (4, 4) matrix."""
    return np.array(pose).reshape(4, 4)


def numbers(T: Matrix) -> tuple[float, ...]:
    """Returns a (4, 4) matrix as 16 numbers, row by row."""
    return tuple(T.ravel().tolist())


def rotation_vector(R: Matrix) -> Matrix:
    """Returns axis times angle of a rotation less than half a turn, (3,), [rad]."""
    v = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    sine, cosine = float(np.linalg.norm(v)), (np.trace(R) - 1.0) / 2.0
    return v if sine < 1e-12 else v / sine * math.atan2(sine, cosine)


def rotation(vector: Matrix) -> Matrix:
    """Returns the rotation about an axis by an angle given as their product, (3,), [rad] (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K


def slerp(old: Sequence[float], new: Sequence[float], share: float) -> Matrix:
    """Returns the rotation that share of the way between those of two poses, (3, 3)."""
    R_old, R_new = matrix(old)[:3, :3], matrix(new)[:3, :3]
    return R_old @ rotation(share * rotation_vector(R_old.T @ R_new))
