"""Joint angles to move to, commanded at any time: the controller plans the motion to the newest ones, cycle by cycle.

A goal may be anywhere in the range of the joints, and may change while the arm moves; a cycle without a command is not
a lost one. The last command of a motion has no goal: the arm stops where it is. The conditions of joint angles apply to
the goal; the planned motion is inside the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.motion.goal_follower import GoalFollower
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.generators.generator import GeneratorOutput, JointReference, not_finite
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.violations import ArmCondition


class GoalGenerator:
    """Moves to commanded joint angles.

    Args:
        bounds: Limits of the motion.
        velocity: Largest joint velocities, n numbers above zero, [rad/s].
        q: Joint angles of the stationary arm, n plain floats, [rad].
    """

    def __init__(self, bounds: MotionLimits, velocity: Sequence[float], q: list[float]) -> None:
        self._n = bounds.model.n
        self._follower = GoalFollower(bounds.model.limits.joint, q, velocity)
        self._goal_monitor = JointMonitor(bounds.limits.joint)
        self._reference = JointReference(bounds, q, checks_box=True)

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns True: a goal is due when it arrives."""
        return True

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the command of this cycle."""
        command = playback.command
        assert command is not None  # No cycle is lost.
        if command.finished:
            self._follower.stop()
            return self._advance()
        goal = list(command.q[: self._n])
        if not isfinite(sum(goal)):
            return not_finite(ArmCondition.FINITE_ANGLES, "positions", goal, "rad")
        self._goal_monitor.reset(goal)  # At standstill there: only its position is checked.
        violations = self._goal_monitor.step(goal)
        if violations:
            return GeneratorOutput(violations=tuple(violations))
        self._follower.set_goal(goal)
        return self._advance()

    @property
    def is_off_commands(self) -> bool:
        """Returns False: no command is missing."""
        return False

    def settle(self) -> GeneratorOutput | None:
        """Continues the motion to the goal, or the stop; None at standstill."""
        return None if self._follower.is_stationary else self._advance()

    def _advance(self) -> GeneratorOutput:
        return self._reference.step(self._follower.step(), 1)
