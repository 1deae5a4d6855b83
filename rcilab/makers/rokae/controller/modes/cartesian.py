"""Tool poses commanded one by one: Cartesian position and Cartesian impedance.

A commanded pose passes the low pass of setFilters and the conditions of the manual's section 4.2, then the inverse on
the branch that the arm is on, then the fence of auto_limit if it is up, and then the conditions on joint angles too.

The arm angle of a 7-axis arm is the commanded one when it is valid. Otherwise it stays what it was: as it was at the
start of the motion, or as commanded last. The vendor's client cannot command an arm angle of exactly zero (it goes out
as "not valid"); so on its way through zero an arm angle that is not valid is zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, hypot, pi, remainder, tau

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.common_conditions import ARM_ANGLE_TOLERANCE
from rcilab.conformance.limit_violation import LimitViolation, describe_breaches
from rcilab.conformance.pose_validation import find_frame_error
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.core.spatial import Pose, rotation_from_wxyz, turn_between, wxyz_from_rotation
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae.conditions import rci_faults
from rcilab.makers.rokae.controller.jitter_buffer import Playback
from rcilab.makers.rokae.controller.modes.generator import (
    GeneratorOutput,
    JointReference,
    MissedCycles,
    MotionLimits,
    lost_motion,
)
from rcilab.makers.rokae.controller.modes.ik_tracker import IkTracker
from rcilab.makers.rokae.controller.modes.start import StartMonitor, find_tool_jump
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.wire import CommandPacket
from rcilab.sim.command_extrapolator import CommandExtrapolator
from rcilab.sim.filters import PoseLowPass

_INVALID = (Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME,)
_ELBOW = (Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,)


class CartesianGenerator:
    """Follows commanded tool poses and arm angles.

    Args:
        terms: Of the motion.
        q: Where the arm stands, n plain floats, [rad]; not at a singularity.
    """

    def __init__(self, terms: MotionLimits, q: list[float]) -> None:
        model = terms.model
        self._terms = terms
        self._has_begun = False
        self._jump: Remark | None = None
        self._has_psi = bool(model.redundancy)
        self._q = q
        self._psi = model.arm_angle(q) if self._has_psi else 0.0
        limits = terms.limits.arm_angle
        self._is_told = False  # Whether this motion's commands have had an arm angle.
        self._smallest_psi = 2.0 * CYCLE_TIME * limits.velocity if limits is not None else 0.0
        pose = model.forward(q)
        self._follower = IkTracker(model)
        self._stream = CommandExtrapolator([*pose.parts[1], *wxyz_from_rotation(pose.parts[0]), self._psi])
        self._filter = PoseLowPass(terms.settings.cartesian_filter, pose, self._psi)
        self._pose = pose
        self._monitor = self._monitor_from(pose, self._psi)
        self._start: StartMonitor[CartesianMonitor] | None = None
        self._gap = MissedCycles()
        self._reference = JointReference(terms, q, judges_box=False)
        self._reference_has_begun = False

    def is_next(self, packet: CommandPacket, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        if find_frame_error(packet.T_base_tool_c) is not None:
            return True  # It is refused when it is played.
        return self._stream.is_next(self._read(packet), steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Takes this cycle's pose, or bridges a cycle that has none."""
        packet, is_lost = playback.packet, playback.is_lost
        cycles = self._gap.step(playback)
        if packet is None:
            values = self._stream.predict(1)
        else:
            error = find_frame_error(packet.T_base_tool_c)
            if error is not None:
                return GeneratorOutput(faults=_INVALID, reason=Remark(error, "no_pose"))
            if self._has_psi and packet.psi_valid and not abs(packet.psi_c) <= pi + ARM_ANGLE_TOLERANCE:
                said = f"arm angle: commanded position {packet.psi_c} rad passes +-pi rad"
                return GeneratorOutput(faults=_ELBOW, reason=Remark(said, "arm_angle", value=f"{packet.psi_c} rad"))
            values = self._read(packet)
            if is_lost:
                values = self._stream.predict(1, values, playback.steps)
        if not self._has_begun:
            self._begin(values)
        self._stream.take(values)
        self._psi = remainder(values[7], tau) if packet is None or is_lost else self._arm_angle(packet)
        self._is_told |= packet is not None and packet.psi_valid
        try:
            pose = Pose.from_parts(rotation_from_wxyz(values[3:7]), (values[0], values[1], values[2]))
            pose, psi = self._filter.step(pose, self._psi)
        except InvalidValueError as error:  # Numbers so absurd that bridge or filter made no pose of them.
            return GeneratorOutput(faults=_INVALID, reason=Remark(f"commanded pose: {error}", "no_pose"))
        return self._judge(pose, psi, cycles)

    def _judge(self, pose: Pose, psi: float, cycles: int) -> GeneratorOutput:
        if cycles > 0:
            breaches = self._step_monitor(pose, psi if self._has_psi else None, cycles)
            if breaches:
                reason = describe_breaches(breaches)
                return GeneratorOutput(
                    faults=rci_faults(breaches), reason=Remark.all((self._jump, reason)) if self._jump else reason
                )
            self._jump = None
        try:
            q = self._follower.solve(pose, psi, self._q)
        except KinematicsError as error:
            if cycles == 0:
                return lost_motion(Remark(f"no joint angles for a pose on its way: {error}", "no_angles"))
            return GeneratorOutput(faults=_INVALID, reason=Remark(f"commanded pose: {error}", "no_angles"))
        if not self._reference_has_begun:
            self._reference_has_begun = True
            self._reference.begin(q, None)  # Of the tool's, the tolerance has been looked at.
        step = self._reference.step(q, cycles)
        if step.q is not None:
            self._q = q
        return step

    def _begin(self, values: list[float]) -> None:
        """Takes the first command: where the motion begins at rest, or its first step from the reference."""
        self._has_begun = True
        x, y, z, *wxyz, psi = values
        try:
            pose = Pose.from_parts(rotation_from_wxyz(wxyz), (x, y, z))
        except InvalidValueError:
            return  # It is refused like any other command that is no pose.
        rotation, position = self._pose.parts
        translation = dist(position, (x, y, z))
        turn = hypot(*turn_between(rotation, pose.parts[0]))
        lag = remainder(psi - self._psi, tau)
        if not (translation or turn or lag):
            return
        cartesian, arm_angle = self._terms.limits.cartesian, self._terms.limits.arm_angle
        h3 = CYCLE_TIME**3
        is_a_step = translation <= cartesian.translation_jerk * h3 and turn <= cartesian.rotation_jerk * h3
        if is_a_step and (arm_angle is None or abs(lag) <= arm_angle.jerk * h3):
            self._start = StartMonitor(self._monitor, self._monitor_from(pose, psi))
            return
        self._jump = find_tool_jump(translation, turn, lag, self._terms.tolerance)
        if self._jump is None:
            self._stream = CommandExtrapolator(values)
            self._filter = PoseLowPass(self._terms.settings.cartesian_filter, pose, psi)
            self._monitor = self._monitor_from(pose, psi)

    def _monitor_from(self, pose: Pose, psi: float) -> CartesianMonitor:
        terms = self._terms
        monitor = CartesianMonitor(terms.limits, terms.entry_box())
        monitor.reset(pose, psi if self._has_psi else None)
        return monitor

    def _step_monitor(self, pose: Pose, psi: float | None, cycles: int) -> Sequence[LimitViolation]:
        start = self._start
        if start is None:
            return self._monitor.step(pose, psi, cycles)
        breaches = start.step(pose, psi, cycles)
        self._monitor = start.monitor
        if start.is_decided:
            self._start = None
        return breaches

    def _read(self, packet: CommandPacket) -> list[float]:
        """Returns position, quaternion and arm angle of a command, with sign and turn that continue the last one."""
        m = packet.T_base_tool_c
        w, x, y, z = wxyz_from_rotation((m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]))
        _, _, _, last_w, last_x, last_y, last_z, last_psi = self._stream.last
        if w * last_w + x * last_x + y * last_y + z * last_z < 0.0:
            w, x, y, z = -w, -x, -y, -z
        psi = last_psi + remainder(self._arm_angle(packet) - last_psi, tau)
        return [m[3], m[7], m[11], w, x, y, z, psi]

    def _arm_angle(self, packet: CommandPacket) -> float:
        if not self._has_psi:
            return 0.0
        if packet.psi_valid:
            return packet.psi_c
        # The vendor's client marks an arm angle of exactly zero as none: it is meant where one was told before.
        passes_zero = self._is_told and packet.psi_c == 0.0 and abs(self._psi) <= self._smallest_psi
        return 0.0 if passes_zero else self._psi
