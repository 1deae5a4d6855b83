"""What friction does to a compliant arm: whether it holds the arm off its command, and whether a joint rings.

Both are seen on the moving arm, not predicted. A stationary compliant arm is held by friction if the torques of its
springs are not zero, but smaller than the friction. A joint rings if its velocity swings many times in a row, quickly.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, dist, hypot

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import rotation_between
from rcilab.i18n.translator import Remark
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.plant import Measurement, Setpoint
from rcilab.sim.tool_kinematics import ToolKinematics
from rcilab.sim.violations import ArmCondition, ArmViolation, Violations

_STILL = 0.01  # [rad/s] Below it a joint that friction holds is stationary; a tuning value.
_SLACK = 1.1  # Between the friction and the torque that it holds; noise and the creep of simulated friction.
_SMALLEST_ANGLE = 5e-4  # [rad] Smaller deviations are not worth a warning.
_SMALLEST_DISTANCE = 5e-4  # [m]
_SWING = 0.04  # [rad/s] The smallest change of the velocity between two turning points; a tuning value.
_HALF_PERIOD = 150  # [cycles] The longest time between them: 3.3 Hz, faster than an arm is swung on purpose.
_SWINGS = 6  # Swings in a row that are ringing.


class FrictionWatch:
    """Observes an arm with known friction in its compliant motions. Owned by the virtual arm.

    Attributes:
        has_held: Whether friction held the arm off the commands at the end of the last compliant motion.

    Args:
        friction: Coulomb friction of the joints, n numbers, [N m].
    """

    def __init__(self, friction: Sequence[float]) -> None:
        self._friction = list(friction)
        self.has_held = False
        self.begin()

    def begin(self) -> None:
        """Forgets the last motion."""
        self._law: ControlLaw | None = None
        self._joints = [_Swings() for _ in self._friction]

    def observe(
        self, law: ControlLaw, setpoint: Setpoint, measured: Measurement, tool_c: ToolKinematics, tool: ToolKinematics
    ) -> None:
        """Processes a cycle of a compliant motion."""
        self._law, self._setpoint, self._measured, self._tools = law, setpoint, measured, (tool_c.pose, tool.pose)
        for joint, dq in zip(self._joints, measured.dq.tolist(), strict=True):
            joint.step(dq)

    def conclude(self, parameters: ArmParameters) -> list[str]:
        """Returns the findings about the motion that has ended, as sentences, and drops its data."""
        law = self._law
        if law is None:
            return []
        self.has_held = False
        ringing = [(number, joint) for number, joint in enumerate(self._joints, 1) if joint.amplitude > 0.0]
        found = [_describe_ringing(number, joint, law) for number, joint in ringing]
        if not ringing and law is not ControlLaw.TORQUE and self._is_held():
            is_joint = law is ControlLaw.JOINT_IMPEDANCE
            held = self._describe_joint(parameters) if is_joint else self._describe_tool()
            self.has_held = held is not None
            found += [] if held is None else [held]
        self.begin()
        return found

    def _is_held(self) -> bool:
        tau = np.abs(self._setpoint.tau if self._setpoint.tau is not None else 0.0)
        is_still = float(np.abs(self._measured.dq).max()) < _STILL
        return is_still and bool((tau <= _SLACK * np.array(self._friction)).all())

    def _describe_joint(self, parameters: ArmParameters) -> str | None:
        off = np.abs(np.array(self._setpoint.q) - self._measured.q)
        joint = int(off.argmax())
        if off[joint] < _SMALLEST_ANGLE:
            return None
        friction, stiffness = self._friction[joint], parameters.joint_stiffness[joint]
        bound = f"up to {degrees(friction / stiffness):.2g} deg off" if stiffness > 0.0 else "anywhere"
        return (
            f"joint {joint + 1} ended {degrees(off[joint]):.2g} deg off its command: with friction of {friction:g} N m "
            f"a stiffness of {stiffness:g} N m/rad ends {bound}"
        )

    def _describe_tool(self) -> str | None:
        (R_c, p_c), (R, p) = (pose.parts for pose in self._tools)
        distance, turn = dist(p_c, p), hypot(*rotation_between(R, R_c))
        if distance < _SMALLEST_DISTANCE and turn < _SMALLEST_ANGLE:
            return None
        return (
            f"the tool ended {1e3 * distance:.2g} mm and {degrees(turn):.2g} deg off its command: this stiffness does "
            f"not overcome the friction of the joints, {min(self._friction):g} to {max(self._friction):g} N m"
        )


def blame_friction(violations: Violations) -> Violations:
    """Returns the violations of a first command after a compliant motion, with friction as the cause of the offset."""
    return tuple(
        ArmViolation(violation.condition, _held_off(violation.remark))
        if violation.condition in (ArmCondition.START_TOLERANCE, ArmCondition.START_ARM_ANGLE)
        else violation
        for violation in violations
    )


def _held_off(jump: Remark) -> Remark:
    sentence = f"{jump} (friction held the compliant arm off the commands of its last motion)"
    return Remark(sentence, "held_by_friction", reason=jump)


class _Swings:
    """The turning points of a joint's velocity.

    Attributes:
        amplitude: Largest amplitude while it rang, [rad/s]; 0 if it did not.
        frequency: Its frequency then, [Hz].
    """

    def __init__(self) -> None:
        self.amplitude = self.frequency = 0.0
        self._sign = 1.0  # Of the acceleration.
        self._extreme = self._last_extreme = 0.0  # [rad/s]
        self._age = self._time = 0  # [cycles] From the last turning point to the extreme, and since it.
        self._count = self._duration = 0  # Swings in a row, and their cycles.

    def step(self, dq: float) -> None:
        """Processes the velocity of a cycle, [rad/s]."""
        self._time += 1
        if self._sign * (dq - self._extreme) >= 0.0:
            self._extreme, self._age = dq, self._time
            return
        if abs(dq - self._extreme) < _SWING:
            return
        is_quick = self._age <= _HALF_PERIOD
        self._count = self._count + 1 if is_quick else 0
        self._duration = self._duration + self._age if is_quick else 0
        if self._count >= _SWINGS:
            self.amplitude = max(self.amplitude, abs(self._extreme - self._last_extreme) / 2.0)
            self.frequency = self._count / (2.0 * self._duration * CYCLE_TIME)
        self._time -= self._age
        self._sign, self._last_extreme, self._extreme, self._age = -self._sign, self._extreme, dq, self._time


def _describe_ringing(number: int, joint: _Swings, law: ControlLaw) -> str:
    cause = "change the gains of your control law" if law is ControlLaw.TORQUE else "lower the stiffness"
    return (
        f"joint {number} rings at {joint.frequency:.0f} Hz with {joint.amplitude:.2g} rad/s, with the friction of a "
        f"real arm: {cause}"
    )
