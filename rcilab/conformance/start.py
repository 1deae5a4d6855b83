"""The state of the arm at the start of a motion, as the controller has it before the first command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_vector


@dataclass(frozen=True, slots=True, eq=False)
class StartState:
    """The last commanded angles and their backward differences at 1 ms, as `RobotState` reports them."""

    q: JointVector
    """Commanded joint angles, shape (n,), [rad] (RobotState.q_c)."""
    dq: JointVector
    """First backward difference, shape (n,), [rad/s] (RobotState.dq_c)."""
    ddq: JointVector
    """Second backward difference, shape (n,), [rad/s^2] (RobotState.ddq_c)."""

    @property
    def moving(self) -> bool:
        """Whether the arm moves."""
        return bool(self.dq.any() or self.ddq.any())


def as_start(start: ArrayLike | StartState, n: int) -> StartState:
    """Returns a checked start state; plain joint angles are a stationary arm.

    Raises:
        InvalidValueError: Not n finite numbers.
    """
    if isinstance(start, StartState):
        return StartState(
            as_vector(start.q, n, "start.q", "rad"),
            as_vector(start.dq, n, "start.dq", "rad/s"),
            as_vector(start.ddq, n, "start.ddq", "rad/s^2"),
        )
    rest = np.zeros(n)
    return StartState(as_vector(start, n, "start", "rad"), rest, rest)
