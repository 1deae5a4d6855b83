"""Tolerance of a motion's start relative to the controller's reference, and absorption of the offset.

Section 4.2 of the manual recommends that a motion begins at T = T_c; it does not require it. A client begins at the
measured or the commanded state, or at its own last command. For a position-controlled arm these agree up to rounding
and the servo error. After a motion of a compliant arm they differ by the deflection of its springs under a few newtons.

An offset inside the tolerance is not differentiated. The reference begins at the arm and approaches the client's
commands on a quintic that uses `SHARE` of the joints' limits. Beyond the tolerance the first command is a jump, which
raises the fault of the manual.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, sqrt
from typing import Any, Generic, Protocol, TypeVar

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import JointLimits
from rcilab.i18n.translator import Remark
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.violations import ArmCondition, ArmViolation

SERVO_ERROR = 1e-3  # [rad] Static error of a joint on its servo, and rounding; the MuJoCo plant's stays below 0.2 mrad.
SERVO_LENGTH = 1e-3  # [m] The same at the tool, at a lever of 1 m.
FORCE = 5.0  # [N] At the tool: the effect of friction and an imperfect load model on a compliant arm.
LEVER = 0.5  # [m] From a joint to the tool, about half of the arms' reach: FORCE becomes a torque of 2.5 N m.
TURNING_LEVER = 0.1  # [m] From the tool's axes to the point of FORCE: a torque of 0.5 N m.
WIDEST_ANGLE = 0.05  # [rad] For any stiffness: an arm with a larger deviation has been moved.
WIDEST_LENGTH = 0.02  # [m] The same for the tool.
SHARE = 0.1  # Of the joints' acceleration and jerk limits, for absorbing an offset; the rest is for the motion.


@dataclass(frozen=True, slots=True)
class StartTolerance:
    """Largest difference of a motion's first command from the controller's reference."""

    joint: tuple[float, ...]
    """Of each joint, n numbers, [rad]."""
    translation: float = SERVO_LENGTH
    """Of the tool's position, [m]."""
    rotation: float = SERVO_ERROR
    """Of the tool's orientation, [rad]."""
    arm_angle: float = 2.0 * SERVO_ERROR
    """Of the arm angle, [rad]: shoulder and wrist both contribute."""

    def widened(self, other: StartTolerance) -> StartTolerance:
        """Returns the element-wise maximum of two tolerances."""
        return StartTolerance(
            tuple(map(max, self.joint, other.joint)),
            max(self.translation, other.translation),
            max(self.rotation, other.rotation),
            max(self.arm_angle, other.arm_angle),
        )


def start_tolerance(law: ControlLaw, parameters: ArmParameters) -> StartTolerance:
    """Returns the tolerance for a motion under a control law, or directly after one.

    Args:
        law: Of the motion.
        parameters: With the stiffness of both impedances.
    """
    n = len(parameters.joint_lower)
    if not law.is_compliant:
        return StartTolerance((SERVO_ERROR,) * n)
    if law is ControlLaw.JOINT_IMPEDANCE:
        joint = tuple(_deflection(FORCE * LEVER, k, SERVO_ERROR, WIDEST_ANGLE) for k in parameters.joint_stiffness)
        widest = max(joint)
        return StartTolerance(joint, min(widest * LEVER, WIDEST_LENGTH), widest, widest)
    if law is ControlLaw.CARTESIAN_IMPEDANCE:
        *translations, a, b, c = parameters.cartesian_stiffness
        translation = max(_deflection(FORCE, k, SERVO_LENGTH, WIDEST_LENGTH) for k in translations)
        rotation = max(_deflection(FORCE * TURNING_LEVER, k, SERVO_ERROR, WIDEST_ANGLE) for k in (a, b, c))
        return StartTolerance((WIDEST_ANGLE,) * n, translation, rotation, WIDEST_ANGLE)
    return StartTolerance((WIDEST_ANGLE,) * n, WIDEST_LENGTH, WIDEST_ANGLE, WIDEST_ANGLE)


def _deflection(load: float, stiffness: float, least: float, most: float) -> float:
    return most if stiffness * most <= load else max(least, load / stiffness)


def find_joint_jump(q: Sequence[float], reference: Sequence[float], tolerance: StartTolerance) -> ArmViolation | None:
    """Returns the violation of the first joint whose start is outside the tolerance, or None.

    Args:
        q: First commanded angles, n numbers, [rad].
        reference: The controller's reference, [rad].
        tolerance: Largest difference.
    """
    for number, (angle, here, bound) in enumerate(zip(q, reference, tolerance.joint, strict=True), 1):
        if not abs(angle - here) <= bound:
            return ArmViolation(ArmCondition.START_TOLERANCE, _jump(angle, here, bound, number))
    return None


def find_tool_jump(
    translation: float, rotation: float, arm_angle: float, tolerance: StartTolerance
) -> ArmViolation | None:
    """Returns the violation of the first quantity of the tool whose start is outside the tolerance, or None.

    Args:
        translation: From the controller's reference to the first commanded position, [m].
        rotation: To the first commanded orientation, [rad].
        arm_angle: To the first commanded arm angle, [rad].
        tolerance: Largest difference.
    """
    if not translation <= tolerance.translation:
        jump = _tool_jump("start_position", "position", translation, tolerance.translation)
        return ArmViolation(ArmCondition.START_TOLERANCE, jump)
    if not rotation <= tolerance.rotation:
        jump = _tool_jump("start_orientation", "orientation", rotation, tolerance.rotation)
        return ArmViolation(ArmCondition.START_TOLERANCE, jump)
    if not abs(arm_angle) <= tolerance.arm_angle:
        jump = _tool_jump("start_arm_angle", "arm angle", arm_angle, tolerance.arm_angle)
        return ArmViolation(ArmCondition.START_ARM_ANGLE, jump)
    return None


def _jump(start: float, reference: float, bound: float, joint: int) -> Remark:
    off = abs(start - reference)
    sentence = (
        f"joint {joint}: the first command of the motion is {degrees(start):.4f}° and the arm's reference is "
        f"{degrees(reference):.4f}°, {degrees(off):.3g}° apart, more than {degrees(bound):.3g}°; "
        "begin at the commanded joint angles in the state"
    )
    return Remark(sentence, "start_joint", joint=joint, begins=start, stands=reference, off=off, bound=bound)


def _tool_jump(code: str, what: str, off: float, bound: float) -> Remark:
    scale, unit = (1e3, " mm") if what == "position" else (degrees(1.0), "°")
    sentence = (
        f"the first commanded {what} of the motion is {scale * off:.4g}{unit} from the arm's reference, more than "
        f"{scale * bound:.3g}{unit}; begin at the commanded pose and arm angle in the state"
    )
    return Remark(sentence, code, off=off, bound=bound)


class Stepping(Protocol):
    """A per-cycle monitor."""

    @property
    def step(self) -> Callable[..., Sequence[LimitViolation]]:
        """Returns the violations of this cycle's commands."""
        ...


_M = TypeVar("_M", bound=Stepping)
_AMBIGUOUS = 4  # Commands after which a third difference no longer reaches the reference that the motion began from.


class StartMonitor(Generic[_M]):
    """Checks commands with an ambiguous start; a violation counts if both interpretations have one.

    A first command within one cycle's jerk of the reference is either the first step of a motion from the reference or
    the start of a motion at this command. Owned by a motion generator.

    Attributes:
        monitor: The valid interpretation.

    Args:
        monitor: Monitor of commands that continue from the reference.
        alternative: Monitor of commands that begin at the first one.
    """

    def __init__(self, monitor: _M, alternative: _M) -> None:
        self.monitor = monitor
        self._alternative: _M | None = alternative
        self._left = _AMBIGUOUS

    @property
    def is_decided(self) -> bool:
        """Whether only one interpretation is left: `monitor`."""
        return self._alternative is None

    def step(self, *signals: Any) -> Sequence[LimitViolation]:
        """Returns the violations of this cycle's commands."""
        violations = self.monitor.step(*signals)
        if self._alternative is not None:
            other = self._alternative.step(*signals)
            if violations and not other:
                self.monitor, violations = self._alternative, ()
            self._left -= 1
            if self._left == 0 or other or self.monitor is self._alternative:
                self._alternative = None
        return violations


class StartOffset:
    """Offset of the reference from the client's commands, from the start of a motion until it is absorbed.

    Owned by a motion generator.

    Args:
        limits: Of the joints.
        offset: Reference minus first command, n numbers, [rad].
    """

    def __init__(self, limits: JointLimits, offset: Sequence[float]) -> None:
        self._offset = list(offset)
        # A quintic over a distance d in a time T has the largest acceleration 10/sqrt(3) d/T^2 and jerk 60 d/T^3.
        times = [
            max(
                sqrt(10.0 / sqrt(3.0) * abs(d) / (SHARE * acceleration)),
                (60.0 * abs(d) / (SHARE * jerk)) ** (1.0 / 3.0),
            )
            for d, acceleration, jerk in zip(offset, limits.acceleration.tolist(), limits.jerk.tolist(), strict=True)
        ]
        self._cycles = max(times) / CYCLE_TIME
        self._cycle = 0

    @property
    def is_absorbed(self) -> bool:
        """Whether the offset is zero."""
        return self._cycle >= self._cycles

    def step(self, q: Sequence[float]) -> list[float]:
        """Returns the reference for the commanded angles of this cycle, [rad]; the first call is the first command."""
        u = min(1.0, self._cycle / self._cycles)
        left = 1.0 - u * u * u * (10.0 + u * (6.0 * u - 15.0))
        self._cycle += 1
        return [angle + left * d for angle, d in zip(q, self._offset, strict=True)]
