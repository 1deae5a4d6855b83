"""How far an arm was from its plan: per joint and at the tool, over time and in a few numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rcilab.arrays import Array, JointPath

if TYPE_CHECKING:
    from rcilab.model import RobotModel


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tracking:
    """Measured against planned, with the play-out delay taken out. NaN where one of the two is missing."""

    joint: JointPath
    """Error of every joint, shape (N, n), [rad]."""
    position: Array
    """Distance of the tool from where it was to be, shape (N,), [m]."""
    rotation: Array
    """Angle between the tool's orientation and the planned one, shape (N,), [rad]."""

    @property
    def joint_rms(self) -> Array:
        """Root mean square a joint, shape (n,), [rad]."""
        return np.array([_rms(column) for column in self.joint.T])

    @property
    def joint_max(self) -> Array:
        """Largest magnitude a joint, shape (n,), [rad]."""
        return np.array([_max(column) for column in self.joint.T])

    @property
    def position_rms(self) -> float:
        """[m]."""
        return _rms(self.position)

    @property
    def position_max(self) -> float:
        """[m]."""
        return _max(self.position)

    @property
    def rotation_rms(self) -> float:
        """[rad]."""
        return _rms(self.rotation)

    @property
    def rotation_max(self) -> float:
        """[rad]."""
        return _max(self.rotation)


def compute_tracking(model: RobotModel | None, q: JointPath, planned: JointPath) -> Tracking:
    """Returns the error of measured against planned joint angles, each of shape (N, n), [rad].

    Args:
        model: The arm, for the errors at the tool; None leaves them NaN.
        q: Measured.
        planned: Planned, row by row for the same instants.
    """
    nothing = np.full(len(q), np.nan)
    known = np.isfinite(planned).all(axis=1) & np.isfinite(q).all(axis=1)
    if model is None or not known.any():
        return Tracking(joint=q - planned, position=nothing, rotation=nothing)
    position, rotation = nothing.copy(), nothing.copy()
    T, T_plan = model.forward_path(q[known]), model.forward_path(planned[known])
    position[known] = np.linalg.norm(T[:, :3, 3] - T_plan[:, :3, 3], axis=1)
    # |R - R'| (Frobenius) = 2 sqrt(2) sin(angle / 2): exact for small angles too, where an arc cosine is not.
    chord = np.linalg.norm(T[:, :3, :3] - T_plan[:, :3, :3], axis=(1, 2))
    rotation[known] = 2.0 * np.arcsin(np.clip(chord / (2.0 * np.sqrt(2.0)), 0.0, 1.0))
    return Tracking(joint=q - planned, position=position, rotation=rotation)


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def _max(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max()) if finite.size else 0.0
