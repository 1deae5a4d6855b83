"""What the controller checks of a moving arm by itself, besides the conditions of the virtual arm."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from rcilab.conformance.common_conditions import VELOCITY_ALLOWANCE
from rcilab.i18n.rounding import format_pair
from rcilab.i18n.translator import Remark
from rcilab.makers.ufactory.bounds import JOINT_VELOCITY
from rcilab.makers.ufactory.controller.settings import MILLIMETRE, Settings
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.sim.self_collision import SelfCollisionWatch
from rcilab.sim.virtual_arm import VirtualArm

_OVERLOAD_CYCLES = 100  # That a drive may be at its largest torque; a tuning value.
_DETECTION_CYCLES = 300  # After the start of mode 2, before a hand reaches the arm; a tuning value.
_DETECTION_SPEED = 0.2  # [rad/s] Which an arm with half a kilogram more than its load exceeds in this time.
_SPEED_MARGIN = 1.001  # Rounding of the planner's differences.
_ROUNDING = 0.01  # [mm] By which targets of single precision, at most 2.4e-7 rad off, may move a tool outwards.


class Finding(NamedTuple):
    """An error and its reason, as a sentence with numbers."""

    error: UfactoryError
    reason: Remark


class MotionWatch:
    """Checks the motions that the controller plans: boundary, speed in servo mode, self-collision, drives.

    Args:
        arm: The arm.
    """

    def __init__(self, arm: VirtualArm) -> None:
        self._arm = arm
        self._links = SelfCollisionWatch(arm.model)
        self._farthest = 0.0  # [mm] That the tool may be outside the boundary.
        self._overload = 0

    def configure(self) -> None:
        """Takes the tool of the arm, which has changed."""
        self._links = SelfCollisionWatch(self._arm.model)

    def begin(self, settings: Settings) -> None:
        """Begins with a motion."""
        self._links.begin(self._arm.signals.measured.q)
        self._farthest = self._excess(settings) + _ROUNDING
        self._overload = 0

    def step(self, settings: Settings, *, is_servo: bool) -> Finding | None:
        """Returns what is wrong in this cycle of a motion, or None.

        Args:
            settings: Those of the controller.
            is_servo: Whether its mode is that of servo targets.
        """
        return (
            self._find_outside(settings)
            or (self._find_fast(settings) if is_servo else None)
            or (self._find_touching() if settings.self_collision else None)
            or self._find_overload()
        )

    def _excess(self, settings: Settings) -> float:
        """Returns how far the commanded tool is outside the boundary, [mm]; 0 inside, or without one."""
        if not settings.fence:
            return 0.0
        bounds, position = settings.boundary, self._arm.tool_c.position
        return max(
            0.0,
            *(max(x / MILLIMETRE - bounds[2 * k], bounds[2 * k + 1] - x / MILLIMETRE) for k, x in enumerate(position)),
        )

    def _find_outside(self, settings: Settings) -> Finding | None:
        """Finds a tool that leaves the boundary, or moves farther out than it has been in this motion."""
        excess = self._excess(settings)
        if excess <= self._farthest:
            self._farthest = min(self._farthest, excess + _ROUNDING)
            return None
        text = f"the tool is {excess:.2g} mm outside the safety boundary"
        remark = Remark(text, "outside_boundary", away=MILLIMETRE * excess)
        return Finding(UfactoryError.SAFETY_BOUNDARY, remark)

    def _find_fast(self, settings: Settings) -> Finding | None:
        speed = hypot(*self._arm.tool_c.twist[:3])
        bound = settings.servo_tool_speed(self._arm.model.limits)
        if speed <= bound * _SPEED_MARGIN:
            return None
        fast, most = format_pair(speed, bound)
        text = f"the tool would move with {fast} m/s, faster than {most} m/s"
        remark = Remark(text, "servo_speed", value=speed, bound=bound, unit="m/s")
        return Finding(UfactoryError.SERVO_LINEAR_SPEED, remark)

    def _find_touching(self) -> Finding | None:
        touching = self._links.step(self._arm.signals.measured.q)
        return None if touching is None else Finding(UfactoryError.SELF_COLLISION, touching)

    def _find_overload(self) -> Finding | None:
        """Finds a joint whose drive has been at its largest torque for a while."""
        torque = np.abs(self._arm.signals.measured.tau) >= self._arm.model.limits.joint.torque
        self._overload = self._overload + 1 if torque.any() else 0
        if self._overload < _OVERLOAD_CYCLES:
            return None
        joint = int(torque.argmax()) + 1
        text = f"joint {joint}: the drive was at its largest torque for {_OVERLOAD_CYCLES} ms"
        remark = Remark(text, "overload", joint=joint, milliseconds=_OVERLOAD_CYCLES)
        return Finding(UfactoryError(10 + joint), remark)


class GuidingWatch:
    """Checks the speed of guided joints, which is small before a hand reaches the arm.

    Attributes:
        detects_motion: Whether an arm that moves at the start of mode 2 is an error.

    Args:
        arm: The arm.
    """

    def __init__(self, arm: VirtualArm) -> None:
        self._arm = arm
        self.detects_motion = True
        self._cycles = 0

    def begin(self) -> None:
        """Begins with hand guiding."""
        self._cycles = 0

    def step(self) -> Finding | None:
        """Returns what is wrong in this cycle, or None."""
        self._cycles += 1
        dq = np.abs(self._arm.signals.measured.dq)
        joint, speed = int(dq.argmax()) + 1, float(dq.max())
        error, bound = UfactoryError.MEASURED_SPEED, VELOCITY_ALLOWANCE * JOINT_VELOCITY
        if self.detects_motion and self._cycles <= _DETECTION_CYCLES:
            error, bound = UfactoryError.MANUAL_MODE, _DETECTION_SPEED
        if speed <= bound:
            return None
        fast, most = format_pair(speed, bound)
        text = f"joint {joint}: its speed of {fast} rad/s in mode 2 is above {most} rad/s"
        return Finding(error, Remark(text, "guided_speed", joint=joint, value=speed, bound=bound, unit="rad/s"))
