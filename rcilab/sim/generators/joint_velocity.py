"""Joint velocities commanded one by one; their integral is the reference.

The commanded velocities pass the velocity filter. A lost cycle continues with the acceleration of the last commands,
or, if a later command is already known, on the way to it. The conditions of joint angles apply to the integral, whose
backward difference is the filtered velocity.
"""

from __future__ import annotations

from math import isfinite

from rcilab.core.clock import CYCLE_TIME
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.filters import LowPass
from rcilab.sim.generators.generator import GeneratorOutput, JointReference, MissedCycles, not_finite
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.generators.rate_extrapolator import RateExtrapolator
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.violations import ArmCondition


class JointVelocityGenerator:
    """Follows commanded joint velocities.

    Args:
        bounds: Limits of the motion.
        q: Joint angles of the stationary arm, n plain floats, [rad].
    """

    def __init__(self, bounds: MotionLimits, q: list[float]) -> None:
        self._n = bounds.model.n
        self._q = list(q)
        self._stream = RateExtrapolator(self._n)
        self._filter = LowPass(bounds.parameters.velocity_filter, [0.0] * self._n)
        self._gap = MissedCycles(bounds)
        self._reference = JointReference(bounds, q, checks_box=True)

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        return self._stream.is_next(command.dq[: self._n], steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the velocities of this cycle, or bridges a cycle without any."""
        cycles = self._gap.step(playback._replace(skipped=0))  # A skipped velocity has moved nothing.
        sent = None if playback.command is None else playback.command.dq[: self._n]
        dq = self._stream.step(sent, playback.steps)
        if not isfinite(sum(dq)):
            return not_finite(ArmCondition.FINITE_VELOCITIES, "velocities", dq, "rad/s")
        dq = self._filter.step(dq)
        self._q = [angle + CYCLE_TIME * rate for angle, rate in zip(self._q, dq, strict=True)]
        return self._reference.step(self._q, cycles)

    @property
    def is_off_commands(self) -> bool:
        """Returns False: velocities are bridged, not held."""
        return False

    def settle(self) -> GeneratorOutput | None:
        """Returns None: the arm stops after the last velocity."""
        return None
