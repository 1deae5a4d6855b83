"""Tool poses commanded one by one: Cartesian position and Cartesian impedance.

A commanded pose passes the pose filter and the conditions of the tool, then the inverse kinematics on the present
branch, then the soft-limit governor if enabled, and finally the conditions of the joint angles. A lost cycle continues
with the acceleration of the last poses, or holds the joint angles of the last one; then the filter takes the path over
the pause once the next pose is there.

The arm angle of a 7-axis arm is the commanded one if it is valid. Otherwise it is free, where the maker leaves it so,
or held: from the start of the motion, or from the last command with one. The vendor's client cannot command an arm
angle of exactly zero (it is sent as "not valid"); therefore an arm angle that is not valid counts as zero while the arm
angle passes zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from math import dist, remainder, tau

from rcilab.conformance.pose_validation import find_frame_error
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose, rotation_from_wxyz, wxyz_from_rotation
from rcilab.i18n.translator import Remark
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.command_extrapolator import CommandExtrapolator
from rcilab.sim.filters import PoseLowPass
from rcilab.sim.generators.generator import GeneratorOutput, MissedCycles
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.generators.pose_reference import PoseReference, find_arm_angle_error, invalid_pose
from rcilab.sim.jitter_buffer import Playback


class CartesianGenerator:
    """Follows commanded tool poses and arm angles.

    Args:
        bounds: Filters and limits of the motion.
        q: Joint angles of the stationary arm, n plain floats, [rad]; not at a singularity.
    """

    def __init__(self, bounds: MotionLimits, q: list[float]) -> None:
        self._bounds = bounds
        self._has_begun = False
        self._reference = reference = PoseReference(bounds, q)
        self._psi = reference.psi
        self._is_free = self._has_free_elbow = bounds.has_free_elbow
        limits = bounds.limits.arm_angle
        self._had_psi = False  # Whether this motion's commands have had an arm angle.
        self._smallest_psi = 2.0 * CYCLE_TIME * limits.velocity if limits is not None else 0.0
        rotation, position = reference.pose.parts
        self._stream = CommandExtrapolator([*position, *wxyz_from_rotation(rotation), self._psi])
        self._filter = PoseLowPass(bounds.parameters.cartesian_filter, reference.pose, self._psi)
        self._before_pause: CommandExtrapolator | None = None  # While the last command is held.
        self._gap = MissedCycles(bounds)

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        if find_frame_error(command.T_base_tool) is not None or find_arm_angle_error(command) is not None:
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
                return invalid_pose(Remark(error, "no_pose"))
            violation = self._reference.find_elbow_error(command)
            if violation is not None:
                return GeneratorOutput(violations=(violation,))
            values = self._read(command)
            if is_lost:
                values = self._stream.predict(1, values, playback.steps)
        if not self._has_begun:
            self._begin(values, command)
        if is_held:  # The servo continues from the last joint angles.
            self._stream.take(values)
            return self._reference.hold()
        between = self._end_pause(values, cycles)
        self._stream.take(values)
        if command is not None:
            self._is_free = self._has_free_elbow and not command.has_psi
        self._psi = remainder(values[7], tau) if command is None or is_lost else self._arm_angle(command)
        self._had_psi |= command is not None and command.has_psi
        try:
            for earlier in between:
                self._filter.step(_pose(earlier), remainder(earlier[7], tau))
            pose, psi = self._filter.step(_pose(values), self._psi)
        except InvalidValueError as error:  # Extreme numbers, from which bridge or filter gave no pose.
            return invalid_pose(Remark(f"commanded pose: {error}", "no_pose"))
        return self._reference.step(pose, None if self._is_free else psi, cycles)

    def _end_pause(self, values: list[float], cycles: int) -> list[list[float]]:
        """Returns the poses on the path over a pause, for the filter if it is on; none without a pause."""
        if self._before_pause is None:
            return []
        self._stream, self._before_pause = self._before_pause, None
        between = self._stream.bridge(values, cycles)
        return between if self._filter.is_on else []

    @property
    def is_off_commands(self) -> bool:
        """Whether the joints still respond to commands that were missing."""
        return self._reference.is_off_commands

    def settle(self) -> GeneratorOutput | None:
        """Continues the response to a pause after the last command; None without one."""
        return self._reference.settle()

    def _begin(self, values: list[float], command: ArmCommand | None) -> None:
        """Processes the first command; filter and prediction start there if the motion does."""
        self._has_begun = True
        try:
            pose = _pose(values)
        except InvalidValueError:
            return  # `step` refuses it.
        if self._reference.begin(pose, values[7], 0.0 if command is None else _distortion(command, pose)):
            self._stream = CommandExtrapolator(values)
            self._filter = PoseLowPass(self._bounds.parameters.cartesian_filter, pose, values[7])

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
        if not self._reference.has_psi:
            return 0.0
        if command.has_psi:
            return command.psi
        # The vendor's client marks an arm angle of exactly zero as not valid.
        passes_zero = self._had_psi and command.psi == 0.0 and abs(self._psi) <= self._smallest_psi
        return 0.0 if passes_zero else self._psi


def _distortion(command: ArmCommand, pose: Pose) -> float:
    """Returns how far the numbers of a commanded orientation are from those of the rotation that is taken for it."""
    m, rotation = command.T_base_tool, pose.parts[0]
    return dist((m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]), rotation)


def _pose(values: Sequence[float]) -> Pose:
    return Pose.from_parts(rotation_from_wxyz(values[3:7]), (values[0], values[1], values[2]))
