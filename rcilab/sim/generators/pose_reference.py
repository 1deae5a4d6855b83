"""The last stage of every motion of the tool: its conditions, the inverse kinematics, and the joints' last stage."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, hypot, pi, remainder, tau

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.common_conditions import ARM_ANGLE_TOLERANCE
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose, rotation_between
from rcilab.i18n.translator import Remark
from rcilab.motion.ik_tracker import IkTracker
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.generators.generator import GeneratorOutput, JointReference, lost_motion, with_jump
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.generators.start import StartMonitor, find_tool_jump
from rcilab.sim.violations import ArmCondition, ArmViolation

_SMALL_TURN = 1e-6  # [rad] In one cycle: a jerk inside every bound.


def invalid_pose(remark: Remark) -> GeneratorOutput:
    """Returns the output for a command that is not a pose the arm can reach."""
    return GeneratorOutput(violations=(ArmViolation(ArmCondition.VALID_POSE, remark),))


def find_arm_angle_error(command: ArmCommand) -> ArmViolation | None:
    """Returns the violation of a commanded arm angle beyond one turn, or None."""
    if not command.has_psi or abs(command.psi) <= pi + ARM_ANGLE_TOLERANCE:
        return None
    sentence = f"arm angle: commanded position {command.psi} rad passes +-pi rad"
    remark = Remark(sentence, "arm_angle", value=command.psi, bound=pi, unit="rad")
    return ArmViolation(ArmCondition.ARM_ANGLE_RANGE, remark)


def _flipped(sentence: str) -> ArmViolation:
    return ArmViolation(ArmCondition.ELBOW_SIDE, Remark(sentence, "elbow_side"))


class PoseReference:
    """Checks commanded poses and arm angles and returns their joint angles, on the present branch.

    The conditions apply to the client's commands, over the cycles between them. A wrong pose is not solved, except of
    an arm with an elbow flip, whose maker names the errors of the joints and of the tool together. Owned by a motion
    generator.

    Attributes:
        pose: Pose of the tool in base at the start of the motion.
        psi: Arm angle there, [rad]; 0 for an arm without one.
        has_psi: Whether the arm has one.

    Args:
        bounds: Filters and limits of the motion.
        q: Joint angles of the stationary arm, n plain floats, [rad]; not at a singularity.
    """

    def __init__(self, bounds: MotionLimits, q: list[float]) -> None:
        model = bounds.model
        self._bounds = bounds
        self._q = q
        self.has_psi = bool(model.redundancy)
        self.pose = model.forward(q)
        self.psi = model.arm_angle(q) if self.has_psi else 0.0
        self._flip = model.description.elbow_flip
        self._side = self._find_side(q)
        self._jump: ArmViolation | None = None
        self._tracker = IkTracker(model)
        self._monitor = self._monitor_from(self.pose, self.psi)
        self._start: StartMonitor[CartesianMonitor] | None = None
        self._joints = JointReference(bounds, q, checks_box=False)
        self._joints_have_begun = False

    def find_elbow_error(self, command: ArmCommand) -> ArmViolation | None:
        """Returns the violation of a commanded elbow, angle or side, or None."""
        if not self.has_psi:
            return None
        violation = find_arm_angle_error(command)
        if violation is None and self._flip is not None and command.has_psi and command.elbow_side != self._side:
            sides = f"{command.elbow_side:g}, and the arm began on side {self._side:+d}"
            return _flipped(f"elbow: the commanded side is {sides}")
        return violation

    def begin(self, pose: Pose, psi: float, distortion: float = 0.0) -> bool:
        """Processes the first command, before `step`; returns whether the motion starts there, at standstill.

        Otherwise it is the first step of a motion from the reference, near it or too far from it.

        Args:
            pose: Pose of the tool in base.
            psi: Arm angle, [rad].
            distortion: How far the commanded orientation is from a rotation: its turn is known to this only, [rad].
        """
        rotation, position = self.pose.parts
        translation = dist(position, pose.parts[1])
        turn = hypot(*rotation_between(rotation, pose.parts[0]))
        lag = remainder(psi - self.psi, tau)
        if not (translation or turn or lag):
            self._joints_have_begun = self._bounds.is_strict_start
            return False
        if self._bounds.is_strict_start:
            is_distorted = _SMALL_TURN < turn <= distortion
            self._jump = find_tool_jump(translation, 0.0 if is_distorted else turn, lag, self._bounds.tolerance)
            if is_distorted:  # Its turn is not a motion.
                self._monitor = self._monitor_from(Pose.from_parts(pose.parts[0], position), self.psi)
            self._joints_have_begun = not is_distorted
            return False
        jump = find_tool_jump(translation, turn, lag, self._bounds.tolerance)
        cartesian, arm_angle = self._bounds.limits.cartesian, self._bounds.limits.arm_angle
        h3 = CYCLE_TIME**3
        is_a_step = translation <= cartesian.translation_jerk * h3 and turn <= cartesian.rotation_jerk * h3
        if is_a_step and (arm_angle is None or abs(lag) <= arm_angle.jerk * h3):
            self._start = StartMonitor(self._monitor, self._monitor_from(pose, psi))
            return False
        self._jump = jump
        if jump is not None:
            return False
        self._monitor = self._monitor_from(pose, psi)
        return True

    def step(self, pose: Pose, psi: float | None, cycles: int) -> GeneratorOutput:
        """Processes the pose of this cycle.

        Args:
            pose: Pose of the tool in base.
            psi: Arm angle, [rad]; without effect for an arm without one. None: the joints move least.
            cycles: Cycles since the last command; 0 if this pose replaces a lost command.
        """
        if self._jump is not None and self._bounds.is_strict_start:
            return GeneratorOutput(violations=(self._jump,))
        violations: Sequence[LimitViolation] = ()
        if cycles > 0:
            violations = self._step_monitor(pose, psi if self.has_psi else None, cycles)
            if violations and self._flip is None:
                return GeneratorOutput(violations=with_jump(self._jump, violations))
            self._jump = None
        try:
            q = self._tracker.follow(pose, self._q) if psi is None else self._tracker.solve(pose, psi, self._q)
        except KinematicsError as error:
            if violations:
                return GeneratorOutput(violations=tuple(violations))
            if cycles == 0:
                return lost_motion(Remark(f"no joint angles for a bridged pose: {error}", "no_angles"))
            return invalid_pose(Remark(f"commanded pose: {error}", "no_angles"))
        if cycles > 0 and self._find_side(q) != self._side:
            flipped = _flipped("elbow: the commanded pose flips it to the other side")
            return GeneratorOutput(violations=(*violations, flipped))
        if not self._joints_have_begun:
            self._joints_have_begun = True
            self._joints.begin(q, is_checked=True)
        step = self._joints.step(q, cycles)
        if violations:
            return GeneratorOutput(violations=(*violations, *step.violations))
        if step.q is not None:
            self._q = q
        return step

    def hold(self) -> GeneratorOutput:
        """Processes a cycle without a command, in which the servo continues from the last joint angles."""
        return self._joints.hold()

    @property
    def is_off_commands(self) -> bool:
        """Whether the joints still respond to commands that were missing."""
        return self._joints.is_off_commands

    def settle(self) -> GeneratorOutput | None:
        """Continues the response to a pause after the last command; None without one."""
        return self._joints.settle()

    def _find_side(self, q: Sequence[float]) -> int:
        """Returns the side of the elbow, +1 or -1, or 0 where the maker defines no flip."""
        flip = self._flip
        if flip is None:
            return 0
        return 1 if q[3] > flip else -1

    def _monitor_from(self, pose: Pose, psi: float) -> CartesianMonitor:
        bounds = self._bounds
        monitor = CartesianMonitor(bounds.limits, bounds.entry_box(), bounds.tool_conditions())
        monitor.reset(pose, psi if self.has_psi else None)
        return monitor

    def _step_monitor(self, pose: Pose, psi: float | None, cycles: int) -> Sequence[LimitViolation]:
        start = self._start
        if start is None:
            return self._monitor.step(pose, psi, cycles)
        violations = start.step(pose, psi, cycles)
        self._monitor = start.monitor
        if start.is_decided:
            self._start = None
        return violations
