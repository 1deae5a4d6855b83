"""The commands a control callback returns: one immutable command per cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

from rcilab.core.arrays import JointVector, Matrix
from rcilab.core.spatial import Pose


@dataclass(frozen=True, slots=True, eq=False)
class JointPosition:
    """Commanded joint angles."""

    q: JointVector
    """Joint angles, shape (n,), [rad]."""
    finished: bool = False
    """True on the last command of a motion."""


@dataclass(frozen=True, slots=True, eq=False, init=False)
class CartesianPosition:
    """Commanded pose of the tool in the base frame; made from a `Pose` or a homogeneous transform."""

    T_base_tool: Matrix
    """Homogeneous transform, shape (4, 4), [m]."""
    psi: float | None = None
    """Arm angle, [rad]; None: the controller chooses it."""
    finished: bool = False
    """True on the last command of a motion."""

    def __init__(self, T_base_tool: Pose | Matrix, psi: float | None = None, finished: bool = False) -> None:
        T = T_base_tool.matrix if isinstance(T_base_tool, Pose) else T_base_tool
        object.__setattr__(self, "T_base_tool", T)
        object.__setattr__(self, "psi", psi)
        object.__setattr__(self, "finished", finished)


@dataclass(frozen=True, slots=True, eq=False)
class JointTorque:
    """Commanded joint torques, on top of the gravity and friction that the controller compensates."""

    tau: JointVector
    """Joint torques, shape (n,), [N m]."""
    finished: bool = False
    """True on the last command of a motion."""


Command: TypeAlias = JointPosition | CartesianPosition | JointTorque


class CommandFilter(Protocol):
    """A filter of a callback's commands. Owned by the control loop."""

    def begin(self, command: Command) -> None:
        """Starts at standstill at the first command of a motion."""
        ...

    def step(self, command: Command) -> Command:
        """Returns the filtered command; called once per cycle."""
        ...
