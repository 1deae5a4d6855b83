"""On-line motions of a planner: what moves the joints, cycle by cycle, from any moving state."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class MotionState(NamedTuple):
    """Where the joints are and how they move: derivatives of the curve, not differences."""

    q: list[float]
    """[rad]."""
    dq: list[float]
    """[rad/s]."""
    ddq: list[float]
    """[rad/s^2]."""


class Mover(Protocol):
    """A motion from one state on. Owned by a planner."""

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        ...

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands, or will after the next step, until another command."""
        ...

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        ...
