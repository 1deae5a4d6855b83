"""Tool poses commanded one by one: Cartesian position and Cartesian impedance.

A commanded pose passes the pose filter and the conditions of the tool, then the inverse kinematics on the present
branch, then the soft-limit governor if enabled, and finally the conditions of the joint angles. A lost cycle continues
with the acceleration of the last poses, or holds the joint angles of the last one; then the filter takes the path over
the pause once the next pose is there.

The arm angle of a 7-axis arm is the commanded one if it is valid. Otherwise it is held: from the start of the motion,
or from the last command with one. The vendor's client cannot command an arm angle of exactly zero (it is sent as "not
valid"); therefore an arm angle that is not valid counts as zero while the arm angle passes zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from math import dist, hypot, pi, remainder, tau

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.common_conditions import ARM_ANGLE_TOLERANCE
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.pose_validation import find_frame_error
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, KinematicsError, SingularError, UnreachableError
from rcilab.core.spatial import IDENTITY, Pose, rotation_between, rotation_from_wxyz, wxyz_from_rotation
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.command_extrapolator import CommandExtrapolator
from rcilab.sim.filters import PoseLowPass
from rcilab.sim.generators.generator import GeneratorOutput, JointReference, MissedCycles, lost_motion, with_jump
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.generators.start import StartMonitor, find_tool_jump
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.violations import ArmCondition, ArmViolation


class CartesianGenerator:
    """Follows commanded tool poses and arm angles.

    Args:
        bounds: Filters and limits of the motion.
        q: Joint angles of the stationary arm, n plain floats, [rad]; not at a singularity.
    """

    def __init__(self, bounds: MotionLimits, q: list[float]) -> None:
        model = bounds.model
        self._bounds = bounds
        self._has_begun = False
        self._jump: Remark | None = None
        self._has_psi = bool(model.redundancy)
        self._q = q
        self._psi = model.arm_angle(q) if self._has_psi else 0.0
        limits = bounds.limits.arm_angle
        self._had_psi = False  # Whether this motion's commands have had an arm angle.
        self._smallest_psi = 2.0 * CYCLE_TIME * limits.velocity if limits is not None else 0.0
        pose = model.forward(q)
        self._tracker = IkTracker(model)
        self._stream = CommandExtrapolator([*pose.parts[1], *wxyz_from_rotation(pose.parts[0]), self._psi])
        self._filter = PoseLowPass(bounds.parameters.cartesian_filter, pose, self._psi)
        self._pose = pose
        self._monitor = self._monitor_from(pose, self._psi)
        self._start: StartMonitor[CartesianMonitor] | None = None
        self._before_pause: CommandExtrapolator | None = None  # While the last command is held.
        self._gap = MissedCycles()
        self._reference = JointReference(bounds, q, checks_box=False)
        self._reference_has_begun = False

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        if find_frame_error(command.T_base_tool) is not None:
            return True  # `step` refuses it.
        return self._stream.is_next(self._read(command), steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the pose of this cycle, or bridges a cycle without one."""
        command, is_lost = playback.command, playback.is_lost
        cycles = self._gap.step(playback)
        is_held = cycles == 0 and self._bounds.servos is not None
        if is_held and self._before_pause is None:
            self._before_pause = copy(self._stream)
        if command is None:
            values = self._stream.predict(1)
        else:
            error = find_frame_error(command.T_base_tool)
            if error is not None:
                return _invalid_pose(Remark(error, "no_pose"))
            if self._has_psi and command.has_psi and not abs(command.psi) <= pi + ARM_ANGLE_TOLERANCE:
                sentence = f"arm angle: commanded position {command.psi} rad passes +-pi rad"
                remark = Remark(sentence, "arm_angle", value=command.psi, bound=pi, unit="rad")
                return GeneratorOutput(violations=(ArmViolation(ArmCondition.ARM_ANGLE_RANGE, remark),))
            values = self._read(command)
            if is_lost:
                values = self._stream.predict(1, values, playback.steps)
        if not self._has_begun:
            self._begin(values)
        if is_held:  # The servo continues from the last joint angles.
            self._stream.take(values)
            return self._reference.hold()
        between = self._end_pause(values, cycles)
        self._stream.take(values)
        self._psi = remainder(values[7], tau) if command is None or is_lost else self._arm_angle(command)
        self._had_psi |= command is not None and command.has_psi
        try:
            for earlier in between:
                self._filter.step(_pose(earlier), remainder(earlier[7], tau))
            pose, psi = self._filter.step(_pose(values), self._psi)
        except InvalidValueError as error:  # Extreme numbers, from which bridge or filter gave no pose.
            return _invalid_pose(Remark(f"commanded pose: {error}", "no_pose"))
        return self._check(pose, psi, cycles)

    def _end_pause(self, values: list[float], cycles: int) -> list[list[float]]:
        """Returns the poses on the path over a pause, for the filter if it is on; none without a pause."""
        if self._before_pause is None:
            return []
        self._stream, self._before_pause = self._before_pause, None
        between = self._stream.bridge(values, cycles)
        return between if self._filter.is_on else []

    def _check(self, pose: Pose, psi: float, cycles: int) -> GeneratorOutput:
        if cycles > 0:
            violations = self._step_monitor(pose, psi if self._has_psi else None, cycles)
            if violations:
                return GeneratorOutput(violations=with_jump(self._jump, violations))
            self._jump = None
        try:
            q = self._tracker.solve(pose, psi, self._q)
        except KinematicsError as error:
            if cycles == 0:
                return lost_motion(Remark(f"no joint angles for a bridged pose: {error}", "no_angles"))
            return _invalid_pose(Remark(f"commanded pose: {error}", "no_angles"))
        if not self._reference_has_begun:
            self._reference_has_begun = True
            self._reference.begin(q, None)  # The tolerance of the tool was already checked.
        step = self._reference.step(q, cycles)
        if step.q is not None:
            self._q = q
        return step

    @property
    def is_off_commands(self) -> bool:
        """Whether the joints still respond to commands that were missing."""
        return self._reference.is_off_commands

    def settle(self) -> GeneratorOutput | None:
        """Continues the response to a pause after the last command; None without one."""
        return self._reference.settle()

    def _begin(self, values: list[float]) -> None:
        """Processes the first command: the start of the motion at standstill, or its first step from the reference."""
        self._has_begun = True
        x, y, z, *wxyz, psi = values
        try:
            pose = Pose.from_parts(rotation_from_wxyz(wxyz), (x, y, z))
        except InvalidValueError:
            return  # `step` refuses it.
        rotation, position = self._pose.parts
        translation = dist(position, (x, y, z))
        turn = hypot(*rotation_between(rotation, pose.parts[0]))
        lag = remainder(psi - self._psi, tau)
        if not (translation or turn or lag):
            return
        cartesian, arm_angle = self._bounds.limits.cartesian, self._bounds.limits.arm_angle
        h3 = CYCLE_TIME**3
        is_a_step = translation <= cartesian.translation_jerk * h3 and turn <= cartesian.rotation_jerk * h3
        if is_a_step and (arm_angle is None or abs(lag) <= arm_angle.jerk * h3):
            self._start = StartMonitor(self._monitor, self._monitor_from(pose, psi))
            return
        self._jump = find_tool_jump(translation, turn, lag, self._bounds.tolerance)
        if self._jump is None:
            self._stream = CommandExtrapolator(values)
            self._filter = PoseLowPass(self._bounds.parameters.cartesian_filter, pose, psi)
            self._monitor = self._monitor_from(pose, psi)

    def _monitor_from(self, pose: Pose, psi: float) -> CartesianMonitor:
        bounds = self._bounds
        monitor = CartesianMonitor(bounds.limits, bounds.entry_box())
        monitor.reset(pose, psi if self._has_psi else None)
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

    def _read(self, command: ArmCommand) -> list[float]:
        """Returns position, quaternion and arm angle of a command, continuous with the last ones."""
        m = command.T_base_tool
        w, x, y, z = wxyz_from_rotation((m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]))
        _, _, _, last_w, last_x, last_y, last_z, last_psi = self._stream.last
        if w * last_w + x * last_x + y * last_y + z * last_z < 0.0:
            w, x, y, z = -w, -x, -y, -z
        psi = last_psi + remainder(self._arm_angle(command) - last_psi, tau)
        return [m[3], m[7], m[11], w, x, y, z, psi]

    def _arm_angle(self, command: ArmCommand) -> float:
        if not self._has_psi:
            return 0.0
        if command.has_psi:
            return command.psi
        # The vendor's client marks an arm angle of exactly zero as not valid.
        passes_zero = self._had_psi and command.psi == 0.0 and abs(self._psi) <= self._smallest_psi
        return 0.0 if passes_zero else self._psi


def _pose(values: Sequence[float]) -> Pose:
    return Pose.from_parts(rotation_from_wxyz(values[3:7]), (values[0], values[1], values[2]))


def _invalid_pose(remark: Remark) -> GeneratorOutput:
    return GeneratorOutput(violations=(ArmViolation(ArmCondition.VALID_POSE, remark),))


class IkTracker:
    """The inverse of one arm with its tool, for poses that follow each other. Owned by a motion generator.

    It stays on the branch nearest to the last angles. Joint limits are checked later.

    Args:
        model: The arm with its tool.
    """

    def __init__(self, model: RobotModel) -> None:
        self._solver = model.solver
        self._T_tool_flange = model.T_flange_tool.inverse()
        self._has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)

    def solve(self, T_base_tool: Pose, psi: float, near: Sequence[float]) -> list[float]:
        """Returns the joint angles of a pose, [rad]: those closest to `near`, full turns counted.

        Args:
            T_base_tool: Pose of the tool in base.
            psi: Redundancy angle, [rad]; without effect for an arm without redundancy.
            near: Last joint angles, n plain floats, [rad].

        Raises:
            UnreachableError: The pose is out of reach, even without joint limits.
            SingularError: The arm would be at a singularity; the message names it.
        """
        flange = T_base_tool @ self._T_tool_flange if self._has_tool else T_base_tool
        q = self._solver.solve_near(flange, psi, near)
        if q is None:
            self._solver.at(flange, near).branches(psi)  # Raises an error with the distance.
            raise UnreachableError("no joint angles near the last ones put the tool there")
        singularity = self._solver.singularity(q)
        if singularity is not None:
            raise SingularError(singularity)
        return q
