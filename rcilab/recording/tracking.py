"""How far an arm was from its plan: per joint and at the tool, over time and in a few numbers."""

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
    """Measured against planned, with the play-out delay taken out. NaN where there is nothing to compare with."""

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


def find_stop(cycles: NDArray[np.void]) -> float | None:
    """Returns when an arm was no longer to follow its plan, [s]; None: it followed to its end.

    Args:
        cycles: See `cycle_dtype`.
    """
    places = [place for place in (_first_unplanned(cycles), _first(cycles["faults"])) if place is not None]
    return float(cycles["t"][min(places)]) if places else None


def last_compared(cycles: NDArray[np.void], delay: int) -> int:
    """Returns the number of cycles that still show the plan: what was sent last is seen `delay` cycles later.

    A controller with a fault stops at once, whatever it still has to play.

    Args:
        cycles: See `cycle_dtype`.
        delay: Between a command and the state that shows it, [cycles].
    """
    fault, lost = _first(cycles["faults"]), _first_unplanned(cycles)
    played = (
        len(cycles) if lost is None else np.searchsorted(cycles["t"], cycles["t"][lost] + (delay - 0.5) * CYCLE_TIME)
    )
    return min(int(played), len(cycles) if fault is None else fault)


def _first_unplanned(cycles: NDArray[np.void]) -> int | None:
    """Returns the first row that was not answered by the plan: with a way to rest, or not at all any more."""
    braking, answered = _first(cycles["braking"]), np.flatnonzero(cycles["sent_ns"])
    if braking is not None or not answered.size or answered[-1] + 1 == len(cycles):
        return braking
    return int(answered[-1]) + 1


def _first(marks: NDArray[np.integer]) -> int | None:
    places = np.flatnonzero(marks)
    return int(places[0]) if places.size else None


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def _max(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max()) if finite.size else 0.0
