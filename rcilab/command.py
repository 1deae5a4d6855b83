"""What a control callback answers with: one immutable command a cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from rcilab.arrays import JointVector, Matrix
from rcilab.spatial import Pose


@dataclass(frozen=True, slots=True, eq=False)
class JointPosition:
    """Commanded joint angles."""

    q: JointVector
    """Joint angles, shape (n,), [rad]."""
    finished: bool = False
    """True on the last command of a motion."""


@dataclass(frozen=True, slots=True, eq=False)
class CartesianPosition:
    """Commanded pose of the tool in the base frame."""

    T_base_tool: Matrix
    """Homogeneous transform, shape (4, 4), [m]; a `Pose` becomes one."""
    psi: float | None = None
    """Arm angle, [rad]; None leaves it to the controller."""
    finished: bool = False
    """True on the last command of a motion."""

    def __post_init__(self) -> None:
        """Takes a pose for its matrix."""
        if isinstance(self.T_base_tool, Pose):
            object.__setattr__(self, "T_base_tool", self.T_base_tool.matrix)


@dataclass(frozen=True, slots=True, eq=False)
class JointTorque:
    """Commanded joint torques, on top of the gravity and friction that the controller compensates."""

    tau: JointVector
    """Joint torques, shape (n,), [N m]."""
    finished: bool = False
    """True on the last command of a motion."""


Command: TypeAlias = JointPosition | CartesianPosition | JointTorque
