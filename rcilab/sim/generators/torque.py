"""Joint torques commanded one by one, on top of gravity and friction, which the controller compensates.

The commanded torques pass the torque filter, then the conditions of torques. The torque before the first command is
zero, so the first one may differ from zero by one cycle's torque rate. A lost cycle holds the last torque, or, if a
later command is already known, interpolates linearly to it. The conditions apply to the received commands, over the
cycles between them, or to every cycle where held torques count as commands (`MotionLimits`).
"""

from __future__ import annotations

from copy import copy
from math import isfinite

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.command_extrapolator import CommandExtrapolator
from rcilab.sim.filters import LowPass
from rcilab.sim.generators.generator import GeneratorOutput, MissedCycles, MotionGenerator, not_finite
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.violations import ArmCondition


class TorqueGenerator:
    """Follows commanded joint torques.

    Args:
        bounds: Filters and limits of the motion.
    """

    def __init__(self, bounds: MotionLimits) -> None:
        nothing = [0.0] * bounds.model.n
        self._n = bounds.model.n
        self._tau = nothing
        self._gap = MissedCycles(bounds)
        self._counts_replacements = bounds.counts_replacements
        self._stream = CommandExtrapolator(nothing)
        self._filter = LowPass(bounds.parameters.torque_filter, nothing)
        self._monitor = TorqueMonitor(bounds.limits.joint)
        self._monitor.reset(nothing)

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        return self._stream.is_next(command.tau[: self._n], steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the torques of this cycle, or bridges a cycle without any."""
        command, steps, is_lost, _ = playback
        cycles = self._gap.step(playback)
        tau = self._tau
        if command is not None:
            tau = list(command.tau[: self._n])
            if not isfinite(sum(tau)):
                return not_finite(ArmCondition.FINITE_TORQUES, "torques", tau, "N m")
            if is_lost and (violations := self._check_ahead(tau, steps)):
                return GeneratorOutput(violations=tuple(violations))
            if is_lost:
                tau = [last + (goal - last) / steps for last, goal in zip(self._tau, tau, strict=True)]
        self._tau = tau
        self._stream.take(tau)
        tau = self._filter.step(tau)
        if cycles > 0 and (violations := self._monitor.step(tau, cycles)):
            return GeneratorOutput(violations=tuple(violations))
        return GeneratorOutput(tau=tau)

    def _check_ahead(self, tau: list[float], steps: int) -> list[LimitViolation]:
        """Returns the violations of torques that are due later: the way to them begins in this cycle."""
        cycles = 1 if self._counts_replacements else self._gap.missing - 1 + steps
        return copy(self._monitor).step(copy(self._filter).step(tau), cycles)

    @property
    def is_off_commands(self) -> bool:
        """Returns False: torques have no reference."""
        return False

    def settle(self) -> GeneratorOutput | None:
        """Returns None: torques end with the last command."""
        return None


class TorqueAndMotionGenerator:
    """Follows commanded joint torques; a motion that is commanded along with them is checked and becomes the reference.

    Args:
        torques: Of the torques, which move the arm.
        motion: Of the motion.
    """

    def __init__(self, torques: TorqueGenerator, motion: MotionGenerator) -> None:
        self._torques = torques
        self._motion = motion

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether the motion continues by one cycle rather than by `steps`: torques may be constant."""
        return self._motion.is_next(command, steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the command of this cycle, or bridges a cycle without one: torques are held."""
        torques, motion = self._torques.step(playback), self._motion.step(playback)
        violations = (*torques.violations, *motion.violations)
        return GeneratorOutput(motion.q, torques.tau, violations, motion.differences)

    @property
    def is_off_commands(self) -> bool:
        """Returns False: a motion along with torques is bridged, not held."""
        return False

    def settle(self) -> GeneratorOutput | None:
        """Returns None: torques end with the last command."""
        return None
