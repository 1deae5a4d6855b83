"""Velocities of the tool commanded one by one; their integral is the reference.

The commanded twists pass the twist filter. A twist turns and shifts the tool by the exponential map in the axes of the
base, so that the difference of two poses is the twist again. Poses pass the conditions and the inverse kinematics of
commanded poses. A lost cycle continues with the acceleration of the last commands, or, if a later command is already
known, on the way to it.

The arm angle of a 7-axis arm is the commanded one if it is valid; otherwise it is held.
"""

from __future__ import annotations

from math import cos, hypot, isfinite, remainder, sin, tau

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Pose, rotation_from_wxyz
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.command_extrapolator import CommandExtrapolator
from rcilab.sim.filters import LowPass
from rcilab.sim.generators.generator import GeneratorOutput, MissedCycles, not_finite
from rcilab.sim.generators.motion_limits import MotionLimits
from rcilab.sim.generators.pose_reference import PoseReference
from rcilab.sim.generators.rate_extrapolator import RateExtrapolator
from rcilab.sim.jitter_buffer import Playback
from rcilab.sim.violations import ArmCondition

_ORIGIN = (0.0, 0.0, 0.0)


class CartesianVelocityGenerator:
    """Follows commanded velocities of the tool, and arm angles.

    Args:
        bounds: Limits of the motion.
        q: Joint angles of the stationary arm, n plain floats, [rad]; not at a singularity.
    """

    def __init__(self, bounds: MotionLimits, q: list[float]) -> None:
        self._reference = reference = PoseReference(bounds, q)
        self._pose = reference.pose
        self._is_free = self._has_free_elbow = bounds.has_free_elbow
        self._stream = RateExtrapolator(6)
        self._filter = LowPass(bounds.parameters.twist_filter, [0.0] * 6)
        self._psi = CommandExtrapolator([reference.psi])
        self._has_begun = False
        self._gap = MissedCycles(bounds)

    def is_next(self, command: ArmCommand, steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the motion by one cycle rather than by `steps`."""
        return self._stream.is_next(command.twist, steps, in_doubt)

    def step(self, playback: Playback) -> GeneratorOutput:
        """Processes the twist of this cycle, or bridges a cycle without one."""
        command = playback.command
        cycles = self._gap.step(playback._replace(skipped=0))  # A skipped velocity has moved nothing.
        if command is not None and (violation := self._reference.find_elbow_error(command)):
            return GeneratorOutput(violations=(violation,))
        twist = self._stream.step(None if command is None else command.twist, playback.steps)
        if not isfinite(sum(twist)):
            return not_finite(ArmCondition.FINITE_TWIST, "velocities of the tool", twist, "m/s, rad/s")
        psi = self._next_psi(playback)
        if not self._has_begun:
            self._has_begun = True
            if self._reference.begin(self._pose, psi):
                self._psi = CommandExtrapolator([psi])
        self._psi.take([psi])
        self._pose = _moved(self._pose, self._filter.step(twist))
        if command is not None:
            self._is_free = self._has_free_elbow and not command.has_psi
        return self._reference.step(self._pose, None if self._is_free else remainder(psi, tau), cycles)

    def _next_psi(self, playback: Playback) -> float:
        """Returns the arm angle of this cycle, [rad], continuous with the last one."""
        command, (last,) = playback.command, self._psi.last
        if command is None or not (command.has_psi and self._reference.has_psi):
            return last if command is not None else self._psi.predict(1)[0]
        psi = last + remainder(command.psi - last, tau)
        return self._psi.predict(1, [psi], playback.steps)[0] if playback.is_lost else psi

    @property
    def is_off_commands(self) -> bool:
        """Returns False: velocities are bridged, not held."""
        return False

    def settle(self) -> GeneratorOutput | None:
        """Returns None: the arm stops after the last velocity."""
        return None


def _moved(pose: Pose, twist: list[float]) -> Pose:
    """Returns a pose after one cycle of a twist in the axes of the base."""
    rotation, (x, y, z) = pose.parts
    vx, vy, vz, wx, wy, wz = (CYCLE_TIME * rate for rate in twist)
    angle = hypot(wx, wy, wz)
    scale = sin(angle / 2.0) / angle if angle > 0.0 else 0.0
    turn = Pose.from_parts(rotation_from_wxyz((cos(angle / 2.0), scale * wx, scale * wy, scale * wz)), _ORIGIN)
    return Pose.from_parts((turn @ Pose.from_parts(rotation, _ORIGIN)).parts[0], (x + vx, y + vy, z + vz))
