"""The FR3's limits for commands, which allow the rounding of its states.

The state has single precision. A client whose rate limiter starts from the commanded values in it, as libfranka's does,
is off by their rounding: by up to 0.2 urad, which is 0.2 rad/s^2 over one cycle and 240 rad/s^3. Its limiter keeps
0.001 inside each limit, which is enough for velocities alone. The Panda's states have double precision.
"""

from __future__ import annotations

from dataclasses import replace

from rcilab.core.arrays import readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import JointLimits, Limits

# Half a unit in the last place of a float, and up to 1 % more for that of velocities.
ANGLE_ROUNDING = readonly_copy([1.2e-7, 6e-8, 1.2e-7, 1.2e-7, 1.2e-7, 2.4e-7, 1.2e-7])
"""[rad] Below 4; joint 2: 2, joint 6: 8."""
_ELBOW = float(ANGLE_ROUNDING[2])  # [rad] It is joint 3.
_TOOL = 1.1e-7  # [m], [rad] Norm of the roundings of a position below 2 m, or of an orientation.
_TORQUE = 3.9e-6  # [N m] Below 128.


def with_state_rounding(limits: Limits) -> Limits:
    """Returns the limits of an FR3 with larger accelerations, jerks and torque rates, for commands."""
    cartesian, arm_angle = limits.cartesian, limits.arm_angle
    assert arm_angle is not None  # The arm has an elbow.
    return replace(
        limits,
        joint=joint_limits_with_state_rounding(limits.joint),
        cartesian=replace(
            cartesian,
            translation_acceleration=_widened(cartesian.translation_acceleration, _TOOL, 2),
            translation_jerk=_widened(cartesian.translation_jerk, _TOOL, 3),
            rotation_acceleration=_widened(cartesian.rotation_acceleration, _TOOL, 2),
            rotation_jerk=_widened(cartesian.rotation_jerk, _TOOL, 3),
        ),
        arm_angle=replace(
            arm_angle,
            acceleration=_widened(arm_angle.acceleration, _ELBOW, 2),
            jerk=_widened(arm_angle.jerk, _ELBOW, 3),
        ),
    )


def joint_limits_with_state_rounding(joint: JointLimits) -> JointLimits:
    """Returns the limits of the joints; see `with_state_rounding`."""
    return replace(
        joint,
        acceleration=readonly_copy(joint.acceleration + ANGLE_ROUNDING / CYCLE_TIME**2),
        jerk=readonly_copy(joint.jerk + ANGLE_ROUNDING / CYCLE_TIME**3),
        torque_rate=readonly_copy(joint.torque_rate + _TORQUE / CYCLE_TIME),
    )


def _widened(bound: float, rounding: float, order: int) -> float:
    return bound + rounding / CYCLE_TIME**order
