"""Joint angles commanded one by one: joint position and joint impedance.

The commanded angles pass the joint filter, then the soft-limit governor if enabled, and then the conditions of joint
angles. A lost cycle continues with the acceleration of the last commands, or, if a later command is already known, on
the cubic to it. Where the last command is held instead, the filter waits, and takes the cubic once the next command is
there. The conditions apply to the received commands, over the cycles between them.
"""

from __future__ import annotations

from copy import copy
from math import isfinite

from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.command_extrapolator import CommandExtrapolator
from rcilab.sim.filters import LowPass
from rcilab.sim.generators.generator import GeneratorOutput, JointReference, MissedCycles, not_finite
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.violations import ArmCondition


class JointGenerator:
    """Follows commanded joint angles.

    Args:
        bounds: Filters and limits of the motion.
        q: Joint angles of the stationary arm, n plain floats, [rad].
    """

    def __init__(self, bounds: MotionLimits, q: list[float]) -> None:
        self._n = bounds.model.n
        self._bounds = bounds
        self._has_begun = False
        self._stream = CommandExtrapolator(q)
        self._filter = LowPass(bounds.parameters.joint_filter, q)
        self._before_pause: CommandExtrapolator | None = None  # While the last command is held.
        self._gap = MissedCycles(bounds)
        self._reference = JointReference(bounds, q, checks_box=True)

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        return self._stream.is_next(command.q[: self._n], steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the angles of this cycle, or bridges a cycle without any."""
        command = playback.command
        cycles = self._gap.step(playback)
        is_held = cycles == 0 and self._bounds.servos is not None
        if is_held and self._before_pause is None:
            self._before_pause = copy(self._stream)
        if command is None:
            q = self._stream.predict(1)
        else:
            q = list(command.q[: self._n])
            if playback.is_lost:
                q = self._stream.predict(1, q, playback.steps)
        if not isfinite(sum(q)):  # A NaN would pass every comparison.
            return not_finite(ArmCondition.FINITE_ANGLES, "positions", q, "rad")
        if not self._has_begun:
            self._begin(q)
        if is_held:
            self._stream.take(q)
            return self._reference.hold()
        if self._before_pause is not None:
            self._stream, self._before_pause = self._before_pause, None
            for between in self._stream.bridge(q, cycles):
                self._filter.step(between)
        self._stream.take(q)
        return self._reference.step(self._filter.step(q), cycles)

    @property
    def is_off_commands(self) -> bool:
        """Whether the joints still respond to commands that were missing."""
        return self._reference.is_off_commands

    def settle(self) -> GeneratorOutput | None:
        """Continues the response to a pause after the last command; None without one."""
        return self._reference.settle()

    def _begin(self, q: list[float]) -> None:
        """Processes the first command; filter and prediction start there if the motion does."""
        self._has_begun = True
        if self._reference.begin(q):
            self._stream = CommandExtrapolator(q)
            self._filter = LowPass(self._bounds.parameters.joint_filter, q)
