"""The conditions on commanded tool poses, arm angles and torques: rows for the table in `conditions.py`.

Velocity, acceleration and jerk of the tool are norms of backward differences at 1 ms, in base axes; the manual gives
one number for the three components, and we take it for their norm. Rotation velocity is the rotation vector of the
turn within one cycle, divided by the cycle time.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rcilab.conformance.condition import MANUAL, AnyLimits, Bounds, Condition, all_limits, joint_limits, same
from rcilab.core.faults import Fault

BOX_TOLERANCE = 1e-9  # [m]
"""How far outside the safety box a tool still counts as inside. A choice: a tool on the wall must not stop the arm."""
ARM_ANGLE_TOLERANCE = 1e-9  # [rad]
"""How far past pi an arm angle may be written. A choice: pi itself is an arm angle, and written digits are rounded."""

_NAMES = ("position", "velocity", "acceleration", "jerk")
_UNITS = {"translation": "m", "rotation": "rad", "arm_angle": "rad"}


def box_bounds(limits: AnyLimits) -> Bounds:
    """Returns the bounds of how far the tool is outside its box, [m]; any depth inside is allowed."""
    del limits  # The box is no limit of the arm.
    return np.array([-math.inf]), np.array([BOX_TOLERANCE])


def tool_bounds(name: str, factor: float = 1.0) -> Callable[[AnyLimits], Bounds]:
    """Returns what gives the bounds of one of the tool's norms, such as "translation_velocity"."""

    def bounds(limits: AnyLimits) -> Bounds:
        return same(factor * getattr(all_limits(limits).cartesian, name))

    return bounds


def arm_angle_bounds(name: str, factor: float = 1.0) -> Callable[[AnyLimits], Bounds]:
    """Returns what gives the bounds of a derivative of the arm angle; an arm without one has no bound."""

    def bounds(limits: AnyLimits) -> Bounds:
        arm_angle = all_limits(limits).arm_angle
        return same(math.inf if arm_angle is None else factor * getattr(arm_angle, name))

    return bounds


def _tool(signal: str, order: int) -> Condition:
    kind = {"translation": "translational", "rotation": "rotational"}[signal]
    symbol = {"translation": "v", "rotation": "omega"}[signal]
    dots = "d" * (order - 1)
    note = ": the acceleration's bit, there is none of its own for a Cartesian jerk" if order == 3 else ""
    return Condition(
        id=f"cartesian.{_NAMES[order]}.{signal}",
        quantity=f"commanded {kind} {_NAMES[order]}",
        formula=f"|{dots}{symbol}_c| < {dots}{symbol}_max",
        necessity="necessary",
        unit=f"{_UNITS[signal]}/s" + (f"^{order}" if order > 1 else ""),
        source=f"{MANUAL}, 4.2 and 4.4 (norm: ours){note}",
        fault=(
            Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION
            if order == 1
            else Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION
        ),
        stage="throughout",
        signal="translation" if signal == "translation" else "rotation",
        order=order,
        bounds=tool_bounds(f"{signal}_{_NAMES[order]}"),
    )


def _arm_angle(order: int) -> Condition:
    dots = "d" * order
    return Condition(
        id=f"arm_angle.{_NAMES[order]}",
        quantity=f"commanded arm angle{' ' + _NAMES[order] if order else ''}",
        formula=f"|{dots}psi_c| < {dots}psi_max" if order else "|psi_c| <= pi",
        necessity="necessary",
        unit="rad" if order == 0 else "rad/s" + (f"^{order}" if order > 1 else ""),
        source=(
            f"{MANUAL}, 4.6 (elbow); bound: the arm angle's definition, a full turn"
            if order == 0
            else f"{MANUAL}, 4.6 (elbow); bound: the vendor SDK's rate limiter, the manual gives none"
        ),
        fault=Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
        stage="throughout",
        signal="arm_angle",
        order=order,
        bounds=(arm_angle_bounds(_NAMES[order]) if order else lambda limits: same(math.pi + ARM_ANGLE_TOLERANCE)),
    )


CARTESIAN_POSITION = Condition(
    id="cartesian.position",
    quantity="commanded position",
    formula="x_c in box",
    necessity="necessary",
    unit="m",
    source=f"{MANUAL}, 3.1.4 and 4.6",
    fault=Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION,
    stage="throughout",
    signal="position",
    order=0,
    bounds=box_bounds,
)

CARTESIAN_FRAME = Condition(
    id="cartesian.frame",
    quantity="commanded pose",
    formula="T_c proper, reachable, not singular",
    necessity="necessary",
    unit="",
    source=f"{MANUAL}, 4.2 and 4.6",
    fault=Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME,
    stage="throughout",
    signal="frame",
    order=0,
    bounds=lambda limits: same(1.0),
)
"""How near the arm is to a singularity: 1 is what counts as on it. Infinite for what is no pose or out of reach."""

TORQUE_RATE = Condition(
    id="torque.rate",
    quantity="commanded torque rate",
    formula="-dtau_max < dtau_c < dtau_max",
    necessity="necessary",
    unit="N m/s",
    source=f"{MANUAL}, 4.3 and 4.4",
    fault=Fault.COMMAND_TORQUE_DISCONTINUITY,
    stage="throughout",
    signal="torque",
    order=1,
    bounds=lambda limits: (-joint_limits(limits).torque_rate, joint_limits(limits).torque_rate),
)
TORQUE_RANGE = Condition(
    id="torque.range",
    quantity="commanded torque",
    formula="-tau_max < tau_c < tau_max",
    necessity="necessary",
    unit="N m",
    source=f"{MANUAL}, 4.3 and 4.4",
    fault=Fault.COMMAND_TORQUE_RANGE_VIOLATION,
    stage="throughout",
    signal="torque",
    order=0,
    bounds=lambda limits: (-joint_limits(limits).torque, joint_limits(limits).torque),
)

TOOL_CONDITIONS: tuple[Condition, ...] = (
    CARTESIAN_POSITION,
    *(_arm_angle(order) for order in range(4)),
    *(_tool(signal, 1) for signal in ("translation", "rotation")),
    *(_tool(signal, order) for order in (2, 3) for signal in ("translation", "rotation")),
)
"""What a commanded tool pose has to keep in every cycle, in wire order of the faults."""

TORQUE_CONDITIONS: tuple[Condition, ...] = (TORQUE_RATE, TORQUE_RANGE)
"""What a commanded torque has to keep in every cycle, in wire order of the faults."""
