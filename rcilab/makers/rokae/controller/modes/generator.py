"""What a motion generator is: one for each motion, from the client's commands to a reference the arm can follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.limit_violation import LimitViolation, describe_breaches
from rcilab.conformance.monitor import JointMonitor
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, box_from
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae.conditions import rci_faults
from rcilab.makers.rokae.controller.jitter_buffer import Playback
from rcilab.makers.rokae.controller.modes.start import StartMonitor, StartOffset, StartTolerance, find_joint_jump
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.wire import CommandPacket
from rcilab.model.robot_model import RobotModel
from rcilab.sim.reference_trajectory import JOIN_SHARE
from rcilab.sim.soft_limit_governor import SoftLimitGovernor

NOTHING = Remark("")
"""The reason of what raises no fault."""
_REACH = 2  # [cycles] that a second difference reaches back, after a gap


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionLimits:
    """What a motion is filtered with and judged by; fixed when it begins."""

    model: RobotModel
    """The arm with its tool and load."""
    settings: Settings
    limits: Limits
    """With the soft limits as position bounds, and the tool's bounds from the table in force."""
    box: SafetyBox | None
    """Where the tool must stay; None when nothing bounds it."""
    tolerance: StartTolerance
    """How far the first command may be off the reference."""
    starts: tuple[Pose, ...]
    """Poses of the tool in base where the motion begins: measured and commanded."""

    def entry_box(self) -> SafetyBox | EntryBox | None:
        """Returns what bounds the tool; where it starts outside the box, it may only move in."""
        return box_from(self.box, *(pose.parts[1] for pose in self.starts))


class GeneratorOutput(NamedTuple):
    """What one cycle's command comes to."""

    q: list[float] | None = None
    """Joint angles to be at, [rad]; None where torques are commanded."""
    tau: list[float] | None = None
    """Joint torques, [N m]; None where angles are commanded."""
    faults: tuple[Fault, ...] = ()
    """Broken conditions, in wire order; then nothing of this step is given to the arm."""
    reason: Remark = NOTHING
    """What broke, in words and numbers."""
    differences: tuple[list[float], list[float]] | None = None
    """First and second backward difference of `q` over one cycle, [rad/s], [rad/s^2], where they are known already."""
    is_number: bool = True
    """Whether the command was finite. One that was not is no joint beyond its range, which takes motor power."""


class MotionGenerator(Protocol):
    """Turns what the play-out gives into a reference, and judges it. Made when a motion begins, at rest."""

    def is_next(self, packet: CommandPacket, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`; see `Stream.is_next`."""
        ...

    def step(self, playback: Playback) -> GeneratorOutput:
        """Takes this cycle's command, or bridges a cycle that has none."""
        ...


class MissedCycles:
    """Counts the cycles that commands are apart. Owned by a motion generator."""

    def __init__(self) -> None:
        self._missing = 0

    def step(self, playback: Playback) -> int:
        """Returns how many cycles after the last command this one is due; 0 in a cycle that has none."""
        if playback.is_lost:
            self._missing += 1
            return 0
        cycles = 1 + self._missing + playback.skipped
        self._missing = 0
        return cycles


def lost_motion(reason: Remark) -> GeneratorOutput:
    """Returns the step of a motion that could not go on without the commands that were lost."""
    said = Remark(f"lost commands broke the motion: {reason}", "lost_motion", reason=reason)
    return GeneratorOutput(faults=(Fault.INSTABILITY_DETECTION,), reason=said)


class JointReference:
    """What every motion of joint angles passes last: the fence when it is up, then the conditions on joint angles.

    The conditions are those of the client's commands. What is played in place of a lost one is ours: it only may not
    throw the arm about, with more than `JOIN_SHARE` times its acceleration, nor leave its range.

    Args:
        terms: Of the motion.
        q: Where the arm stands, n plain floats, [rad].
        judges_box: Whether the safety box is judged here, from the joint angles.
    """

    def __init__(self, terms: MotionLimits, q: list[float], *, judges_box: bool) -> None:
        joint = terms.limits.joint
        self._model = terms.model
        self._limits = joint
        self._box = BoxMonitor(terms.entry_box() if judges_box else None)
        self._fence = SoftLimitGovernor(joint, q) if terms.settings.auto_limit else None
        self._monitor = self._monitor_from(q)
        self._start: StartMonitor[JointMonitor] | None = None
        self._offset: StartOffset | None = None
        self._jump: Remark | None = None
        self._range = list(zip(joint.lower.tolist(), joint.upper.tolist(), strict=True))
        self._hardest: list[float] = (JOIN_SHARE * joint.acceleration).tolist()
        self._last = self._before = q
        self._shaken = 0

    def begin(self, q: list[float], tolerance: StartTolerance | None) -> bool:
        """Takes the first commanded angles, before `step` does; returns whether the motion begins there, at rest.

        Otherwise they are the first step of a motion from the reference: near it, or too far off to begin there.

        Args:
            q: n plain floats, [rad].
            tolerance: How far they may be off the reference; None where that has been looked at already.
        """
        h3 = CYCLE_TIME**3
        offset = [here - angle for here, angle in zip(self._last, q, strict=True)]
        if not any(offset):
            return False
        if all(abs(d) <= jerk * h3 for d, jerk in zip(offset, self._limits.jerk.tolist(), strict=True)):
            self._start = StartMonitor(self._monitor, self._monitor_from(q))
            return False
        self._jump = None if tolerance is None else find_joint_jump(q, self._last, tolerance)
        if self._jump is not None:
            return False
        self._monitor = self._monitor_from(q)
        self._offset = StartOffset(self._limits, offset)
        if self._fence is not None:
            self._fence = SoftLimitGovernor(self._limits, q)
        return True

    def step(self, q: list[float], cycles: int) -> GeneratorOutput:
        """Takes the joint angles of this cycle.

        Args:
            q: Finite numbers, [rad].
            cycles: How many cycles the last command was before; 0 when these are no command but stand in for one.
        """
        if self._fence is not None:
            q = self._fence.step(q)
        reference = q
        if self._offset is not None:
            reference = self._offset.step(q)
            if self._offset.is_absorbed:
                self._offset, self._shaken = None, 0
        reason = NOTHING if cycles == 1 and self._shaken == 0 else self._find_throw(reference, cycles)
        self._last, self._before = reference, self._last
        if reason:
            return lost_motion(reason)
        if cycles == 0:
            return GeneratorOutput(reference)
        step = self._judge(q, cycles)
        return step if reference is q or step.faults else GeneratorOutput(reference)

    def _monitor_from(self, q: list[float]) -> JointMonitor:
        monitor = JointMonitor(self._limits)
        monitor.reset(q)
        return monitor

    def _find_throw(self, q: list[float], cycles: int) -> Remark:
        """Returns what the arm cannot be asked to do, or nothing; for as long as a difference reaches to a gap."""
        self._shaken = self._shaken - 1 if cycles == 1 else _REACH
        h2 = CYCLE_TIME * CYCLE_TIME
        columns = zip(q, self._last, self._before, self._hardest, self._range, strict=True)
        for number, (x, y, z, hardest, (lower, upper)) in enumerate(columns, 1):
            ddq = (x - 2.0 * y + z) / h2
            if abs(ddq) > hardest:
                said = f"joint {number} would need {ddq:.4g} rad/s^2 to go on, more than {hardest:g} rad/s^2"
                amounts = {"value": f"{ddq:.4g} rad/s^2", "bound": f"{hardest:g} rad/s^2"}
                return Remark(said, "thrown", joint=number, **amounts)
            if cycles == 0 and not lower < x < upper:
                said = f"joint {number} would go on to {x:.4g} rad, beyond its range {lower:.4g} to {upper:.4g} rad"
                bound = lower if x <= lower else upper
                return Remark(said, "beyond", joint=number, value=f"{x:.4g} rad", bound=f"{bound:.4g} rad")
        return NOTHING

    def _judge(self, q: list[float], cycles: int) -> GeneratorOutput:
        breaches = self._step_monitor(q, cycles)
        if self._box.is_active:
            breaches = [*breaches, *self._box.step(self._model.forward(q).parts[1])]
        if breaches:
            reason = describe_breaches(breaches)
            return GeneratorOutput(
                faults=rci_faults(breaches), reason=Remark.all((self._jump, reason)) if self._jump else reason
            )
        self._jump = None
        monitor = self._monitor
        return GeneratorOutput(
            q, differences=(monitor.dq, monitor.ddq) if monitor.is_even and self._start is None else None
        )

    def _step_monitor(self, q: list[float], cycles: int) -> Sequence[LimitViolation]:
        start = self._start
        if start is None:
            return self._monitor.step(q, cycles)
        breaches = start.step(q, cycles)
        self._monitor = start.monitor
        if start.is_decided:
            self._start = None
        return breaches
