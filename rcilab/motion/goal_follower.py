"""On-line motion to joint angles that may change at any time, inside the limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.limits import JointLimits
from rcilab.motion import _ruckig
from rcilab.motion.bounds import LIMIT_MARGIN

_STANDSTILL = (1e-9, 1e-6)  # [rad/s], [rad/s^2] Rounding of the curve.


class GoalFollower:
    """Moves every joint by itself and time-optimally to standstill at its goal. Owned by the thread of the cycle.

    It starts at standstill, also outside the range of a joint. Velocity, acceleration and jerk stay inside the limits,
    `LIMIT_MARGIN` of them at most. Where the velocity bound decreases towards the ends of the range, a joint keeps that
    of its goal on the whole way.

    Args:
        limits: Bounds of the joints; their range is not checked.
        q: Joint angles at the start, n plain floats, [rad].
        velocity: Largest joint velocities, above zero, n numbers, [rad/s]; the limits apply where they are smaller.
    """

    def __init__(self, limits: JointLimits, q: Sequence[float], velocity: Sequence[float]) -> None:
        zero = [0.0] * len(q)
        self._limits = limits
        self._largest = velocity
        self._goal: list[float] | None = None
        self._velocity = zero
        acceleration, jerk = (LIMIT_MARGIN * limits.acceleration).tolist(), (LIMIT_MARGIN * limits.jerk).tolist()
        self._axes = _ruckig.Stepper(q, zero, zero, acceleration, jerk)
        self._zero = zero

    @property
    def is_stationary(self) -> bool:
        """Whether no joint moves, to rounding."""
        slow, weak = _STANDSTILL
        return all(-slow < v < slow for v in self._axes.dq) and all(-weak < a < weak for a in self._axes.ddq)

    def set_goal(self, q: Sequence[float]) -> None:
        """Moves to these joint angles, n finite numbers, [rad], from the next step on."""
        self._goal = list(q)
        lowest, highest = self._limits.checked_velocity_bounds(np.array(self._goal))
        bounds: list[float] = (LIMIT_MARGIN * np.minimum(-lowest, highest)).tolist()
        self._velocity = list(map(min, self._largest, bounds))

    def stop(self) -> None:
        """Stops every joint from the next step on."""
        self._goal = None

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad].

        Raises:
            PlanningError: The planner found no stop; not observed inside the limits.
        """
        if self._goal is None:
            self._axes.step_to_velocity(self._zero)
        else:
            self._axes.step_to_positions(self._goal, self._velocity)
        return list(self._axes.q)
