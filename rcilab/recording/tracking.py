"""Tracking error of an arm: per joint and at the tool, over time and in a few numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath
from rcilab.core.clock import CYCLE_TIME

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tracking:
    """Measured against planned, corrected for the play-out delay. NaN where there is no reference."""

    joint: JointPath
    """Error of every joint, shape (N, n), [rad]."""
    position: Array
    """Distance of the tool from its planned position, shape (N,), [m]."""
    rotation: Array
    """Angle between the tool's orientation and the planned one, shape (N,), [rad]."""

    @property
    def joint_rms(self) -> Array:
        """Root mean square of each joint, shape (n,), [rad]."""
        return np.array([_rms(column) for column in self.joint.T])

    @property
    def joint_max(self) -> Array:
        """Largest magnitude of each joint, shape (n,), [rad]."""
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
    """Returns the tracking error from measured and planned joint angles, each of shape (N, n), [rad].

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


def find_stop_time(cycles: NDArray[np.void]) -> float | None:
    """Returns when an arm stopped following its plan, [s]; None: it followed the plan to its end.

    Args:
        cycles: See `cycle_dtype`.
    """
    rows = [row for row in (_first_unplanned(cycles), _first_set(cycles["faults"])) if row is not None]
    return float(cycles["t"][min(rows)]) if rows else None


def count_compared(cycles: NDArray[np.void], delay: int) -> int:
    """Returns the number of cycles that follow the plan; the last command takes effect `delay` cycles later.

    A controller with a fault stops at once and drops the commands in its buffer.

    Args:
        cycles: See `cycle_dtype`.
        delay: Between a command and the state that shows it, [cycles].
    """
    fault, lost = _first_set(cycles["faults"]), _first_unplanned(cycles)
    played = (
        len(cycles) if lost is None else np.searchsorted(cycles["t"], cycles["t"][lost] + (delay - 0.5) * CYCLE_TIME)
    )
    return min(int(played), len(cycles) if fault is None else fault)


def _first_unplanned(cycles: NDArray[np.void]) -> int | None:
    """Returns the first row whose command was not planned: it belongs to a stop, or nothing was sent from there on."""
    braking, answered = _first_set(cycles["braking"]), np.flatnonzero(cycles["sent_ns"])
    if braking is not None or not answered.size or answered[-1] + 1 == len(cycles):
        return braking
    return int(answered[-1]) + 1


def _first_set(marks: NDArray[np.integer]) -> int | None:
    rows = np.flatnonzero(marks)
    return int(rows[0]) if rows.size else None


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def _max(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max()) if finite.size else 0.0
