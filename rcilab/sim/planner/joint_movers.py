"""On-line motions of the joints: to angles that may change, and to standstill."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.core.limits import JointLimits
from rcilab.motion import _ruckig
from rcilab.sim.planner.mover import MotionState
from rcilab.sim.planner.section_bounds import joint_bounds
from rcilab.sim.planner.target import JointSpeed

_STANDSTILL = (1e-9, 1e-6)  # [rad/s], [rad/s^2] Rounding of the curve.


class JointMover:
    """Moves to joint angles that may change at any time, or to standstill.

    Attributes:
        is_synchronized: Whether all joints arrive together.

    Args:
        limits: Of the joints.
        state: Where it begins.
        is_synchronized: As the attribute.
    """

    def __init__(self, limits: JointLimits, state: MotionState, *, is_synchronized: bool) -> None:
        self.is_synchronized = is_synchronized
        self._limits = limits
        bounds = joint_bounds(limits, JointSpeed())
        self._bounds: tuple[list[float], list[float]] = bounds.acceleration.tolist(), bounds.jerk.tolist()
        self._axes = _ruckig.Stepper(*state, *self._bounds, is_synchronized=is_synchronized)
        self._goal: list[float] | None = None
        self._velocity = self._still = [0.0] * len(state.q)

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        axes = self._axes
        return MotionState(list(axes.q), list(axes.dq), list(axes.ddq))

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands at its goal, or after a stop."""
        slow, weak = _STANDSTILL
        axes = self._axes
        if self._goal is not None and max(abs(a - b) for a, b in zip(axes.q, self._goal, strict=True)) > slow:
            return False
        return all(-slow < v < slow for v in axes.dq) and all(-weak < a < weak for a in axes.ddq)

    def set_goal(self, q: Sequence[float], speed: JointSpeed) -> None:
        """Moves to these joint angles from the next step on, n finite numbers, [rad]."""
        bounds = joint_bounds(self._limits, speed)
        self._goal = list(q)
        self._velocity = bounds.velocity.tolist()
        self._axes.set_limits(bounds.acceleration.tolist(), bounds.jerk.tolist())

    def stop(self) -> None:
        """Stops every joint as fast as the limits allow, from the next step on."""
        self._goal = None
        self._axes.set_limits(*self._bounds)

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        if self._goal is None:
            self._axes.step_to_velocity(self._still)
        else:
            self._axes.step_to_positions(self._goal, self._velocity)
        return list(self._axes.q)
