"""The protocol of motion generators, and the last stage of every motion of joint angles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.i18n.translator import Remark
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.generators.start import StartMonitor, StartOffset, find_joint_jump
from rcilab.sim.hold_response import HoldResponse
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.reference_trajectory import JOIN_SHARE
from rcilab.sim.soft_limit_governor import SoftLimitGovernor
from rcilab.sim.violations import ArmCondition, ArmViolation, Violations

_REACH = 2  # Cycles after a gap whose second difference includes the gap.


class GeneratorOutput(NamedTuple):
    """The reference of one cycle."""

    q: list[float] | None = None
    """Joint angles of the reference, [rad]; None if torques are commanded."""
    tau: list[float] | None = None
    """Joint torques, [N m]; None if angles are commanded."""
    violations: Violations = ()
    """Violations of the command; the arm must not follow an output with violations."""
    differences: tuple[list[float], list[float]] | None = None
    """First and second backward differences of `q`, [rad/s], [rad/s^2], if already known."""


class MotionGenerator(Protocol):
    """Converts the output of the jitter buffer to a checked reference. Created when a motion begins, at standstill."""

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        ...

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the command of this cycle, or bridges a cycle without one."""
        ...

    @property
    def is_off_commands(self) -> bool:
        """Whether the reference still responds to commands that were missing."""
        ...

    def settle(self) -> GeneratorOutput | None:
        """Returns the reference of a cycle after the last command; None: it does not move any more because of it."""
        ...


class MissedCycles:
    """Counts the cycles between two commands. Owned by a motion generator.

    Attributes:
        missing: Cycles without a command up to now.

    Args:
        bounds: Whether replacements of lost commands count as commands.
    """

    def __init__(self, bounds: MotionLimits) -> None:
        self._counts_replacements = bounds.counts_replacements
        self.missing = 0

    def step(self, playback: Playback) -> int:
        """Returns the number of cycles since the last command, or its replacement; 0 in a cycle without."""
        if self._counts_replacements:
            return 1 + playback.skipped
        if playback.is_lost:
            self.missing += 1
            return 0
        cycles = 1 + self.missing + playback.skipped
        self.missing = 0
        return cycles


def not_finite(condition: ArmCondition, what: str, numbers: Sequence[float], unit: str) -> GeneratorOutput:
    """Returns the output for a command that is not made of finite numbers.

    Args:
        condition: The violated condition.
        what: Name of the numbers, such as "positions".
        numbers: The command, in `unit`.
        unit: Their unit, such as "rad".
    """
    remark = Remark(f"commanded {what} {numbers} {unit} are not all finite numbers", "no_numbers")
    return GeneratorOutput(violations=(ArmViolation(condition, remark),))


def lost_motion(reason: Remark) -> GeneratorOutput:
    """Returns the output of a motion that cannot continue without the lost commands."""
    return GeneratorOutput(violations=(blame_lost_commands(reason),))


def blame_lost_commands(reason: Remark) -> ArmViolation:
    """Returns the violation of a motion that lost commands have ended."""
    remark = Remark(f"lost commands broke the motion: {reason}", "lost_motion", reason=reason)
    return ArmViolation(ArmCondition.COMMANDS_ARRIVE, remark)


def with_jump(jump: ArmViolation | None, violations: Sequence[LimitViolation]) -> Violations:
    """Returns violations, preceded by a jump at the start that explains them, if there was one."""
    return (jump, *violations) if jump else tuple(violations)


class JointReference:
    """The last stage of every motion of joint angles: the soft-limit governor, if enabled, then the joint conditions.

    The conditions apply to the client's commands, over the cycles between them, or to every cycle where replacements
    count as commands (`MotionLimits`). Otherwise the replacement of a lost command is checked only for an acceleration
    above `JOIN_SHARE` times the limit and for the range of the joint. Where the last command is held instead, the
    reference is the response of the servo (`HoldResponse`), which only the measured conditions check.

    Args:
        bounds: Filters and limits of the motion.
        q: Joint angles at the start, n plain floats, [rad].
        checks_box: Whether the safety box is checked here, from the joint angles.
    """

    def __init__(self, bounds: MotionLimits, q: list[float], *, checks_box: bool) -> None:
        joint = bounds.limits.joint
        self._model = bounds.model
        self._limits = joint
        self._box = BoxMonitor(bounds.entry_box() if checks_box else None)
        self._governor = SoftLimitGovernor(joint, q) if bounds.parameters.auto_limit else None
        self._monitor = self._monitor_from(q)
        self._start: StartMonitor[JointMonitor] | None = None
        self._offset: StartOffset | None = None
        self._tolerance = bounds.tolerance
        self._is_strict = bounds.is_strict_start
        self._jump: ArmViolation | None = None
        self._range = list(zip(joint.lower.tolist(), joint.upper.tolist(), strict=True))
        self._max_acceleration: list[float] = (JOIN_SHARE * joint.acceleration).tolist()
        self._last = self._before = q
        self._cycles_to_check = 0
        self._servo = None if bounds.servos is None else HoldResponse(bounds.servos, q)

    def begin(self, q: list[float], *, is_checked: bool = False) -> bool:
        """Processes the first commanded angles, before `step`; returns whether the motion starts there, at standstill.

        Otherwise they are the first step of a motion from the reference, near it or too far from it.

        Args:
            q: n plain floats, [rad].
            is_checked: Whether their difference from the reference is known to be inside the tolerance.
        """
        h3 = CYCLE_TIME**3
        offset = [here - angle for here, angle in zip(self._last, q, strict=True)]
        if not any(offset):
            return False
        jump = None if is_checked else find_joint_jump(q, self._last, self._tolerance)
        if self._is_strict and not is_checked:
            self._jump = jump
            return False
        if all(abs(d) <= jerk * h3 for d, jerk in zip(offset, self._limits.jerk.tolist(), strict=True)):
            self._start = StartMonitor(self._monitor, self._monitor_from(q))
            return False
        self._jump = jump
        if jump is not None:
            return False
        self._monitor = self._monitor_from(q)
        self._offset = StartOffset(self._limits, offset)
        if self._governor is not None:
            self._governor = SoftLimitGovernor(self._limits, q)
        return True

    def step(self, q: list[float], cycles: int) -> GeneratorOutput:
        """Processes the joint angles of this cycle.

        Args:
            q: Finite numbers, [rad].
            cycles: Cycles since the last command; 0 if these angles replace a lost command.
        """
        if self._is_strict and self._jump is not None:
            return GeneratorOutput(violations=(self._jump,))
        if self._governor is not None:
            q = self._governor.step(q)
        reference = q
        if self._offset is not None:
            reference = self._offset.step(q)
            if self._offset.is_absorbed:
                self._offset, self._cycles_to_check = None, 0
        if self._servo is not None:
            return self._step_servo(self._servo, q, reference, cycles)
        excess = (
            None if cycles == 1 and self._cycles_to_check == 0 else self._find_excess_acceleration(reference, cycles)
        )
        self._last, self._before = reference, self._last
        if excess is not None:
            return lost_motion(excess)
        if cycles == 0:
            return GeneratorOutput(reference)
        output = self._check(q, cycles)
        return output if reference is q or output.violations else GeneratorOutput(reference)

    @property
    def is_off_commands(self) -> bool:
        """Whether the servo still responds to commands that were missing."""
        return self._servo is not None and self._servo.is_active

    def hold(self) -> GeneratorOutput:
        """Processes a cycle without a command, and without joint angles that replace it."""
        return self.step([2.0 * x - y for x, y in zip(self._last, self._before, strict=True)], 0)

    def settle(self) -> GeneratorOutput | None:
        """Continues the response to a pause after the last command; None without one."""
        q = None if self._servo is None else self._servo.settle()
        return None if q is None else GeneratorOutput(q)

    def _step_servo(self, servo: HoldResponse, q: list[float], reference: list[float], cycles: int) -> GeneratorOutput:
        self._last, self._before = reference, self._last
        if cycles == 0:
            return GeneratorOutput(servo.hold())
        output = self._check(q, cycles)
        followed = servo.follow(reference, cycles)
        return output if followed is q or output.violations else GeneratorOutput(followed)

    def _monitor_from(self, q: list[float]) -> JointMonitor:
        monitor = JointMonitor(self._limits)
        monitor.reset(q)
        return monitor

    def _find_excess_acceleration(self, q: list[float], cycles: int) -> Remark | None:
        """Returns which joint would be accelerated too much or leave its range while differences span a gap."""
        self._cycles_to_check = self._cycles_to_check - 1 if cycles == 1 else _REACH
        h2 = CYCLE_TIME * CYCLE_TIME
        columns = zip(q, self._last, self._before, self._max_acceleration, self._range, strict=True)
        for number, (x, y, z, bound, (lower, upper)) in enumerate(columns, 1):
            ddq = (x - 2.0 * y + z) / h2
            if abs(ddq) > bound:
                sentence = f"joint {number} would need {ddq:.4g} rad/s^2 to continue, more than {bound:g} rad/s^2"
                return Remark(sentence, "thrown", joint=number, value=ddq, bound=bound, unit="rad/s^2")
            if cycles == 0 and not lower < x < upper:
                sentence = (
                    f"joint {number} would continue to {x:.4g} rad, beyond its range {lower:.4g} to {upper:.4g} rad"
                )
                limit = lower if x <= lower else upper
                return Remark(sentence, "beyond", joint=number, value=x, bound=limit, unit="rad")
        return None

    def _check(self, q: list[float], cycles: int) -> GeneratorOutput:
        violations = self._step_monitor(q, cycles)
        if self._box.is_active:
            violations = [*violations, *self._box.step(self._model.forward(q).parts[1])]
        if violations:
            return GeneratorOutput(violations=with_jump(self._jump, violations))
        self._jump = None
        monitor = self._monitor
        return GeneratorOutput(
            q, differences=(monitor.dq, monitor.ddq) if monitor.is_even and self._start is None else None
        )

    def _step_monitor(self, q: list[float], cycles: int) -> Sequence[LimitViolation]:
        start = self._start
        if start is None:
            return self._monitor.step(q, cycles)
        violations = start.step(q, cycles)
        self._monitor = start.monitor
        if start.is_decided:
            self._start = None
        return violations
