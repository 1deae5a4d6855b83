"""The conditions on what the arm does, and the controller's own: rows for the table in `conditions.py`.

The manual names the faults of measured quantities (4.6) and gives them no bounds of their own. We take those of the
commanded ones and an allowance, because a servo overshoots and a compliant arm is pushed; every allowance here is a
choice. Accelerations are differences of measured velocities over one cycle after a first-order low pass, because a
bare difference of measurements is mostly noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from rcilab.conformance.condition import MANUAL, AnyLimits, Bounds, Condition, joint_limits, same
from rcilab.conformance.tool_conditions import arm_angle_bounds, tool_bounds
from rcilab.core.arrays import readonly_copy
from rcilab.core.faults import Fault
from rcilab.core.limits import Limits

ANGLE_ALLOWANCE = math.radians(1.0)  # [rad] A choice: what a servo may overshoot at the end of a joint's range.
BOX_ALLOWANCE = 0.01  # [m] A choice: about what that angle is at the tool, and what a soft spring gives.
VELOCITY_ALLOWANCE = 1.1  # A choice, on the commanded bound.
ACCELERATION_ALLOWANCE = 1.5  # A choice, on the commanded bound.
ACCELERATION_CUTOFF = (
    30.0  # [Hz] A choice: below the first resonances of arms of this size, above any motion of theirs.
)
YIELDING_ALLOWANCE = 8.0
"""How much more acceleration than under the position servo a yielding arm may have. A choice: the light last joints of
an arm that is pushed with 30 N, or told a torque of a few N m, are thrown harder than any command could ask for."""
LOST_IN_ROW = 20  # [cycles] Manual 4.6: the packet-loss threshold is usually 10 to 20.

_CHOICE = f"{MANUAL}, 4.6; bound: the commanded one"
_FASTER = f"{_CHOICE} x {VELOCITY_ALLOWANCE:g} (our allowance)"
_HARDER = f"{_CHOICE} x {ACCELERATION_ALLOWANCE:g} (our allowance), low-passed at {ACCELERATION_CUTOFF:g} Hz"


def yielding_limits(limits: Limits) -> Limits:
    """Returns the bounds of an arm that forces move, as under impedance: more acceleration, the rest as it is."""
    joint, cartesian = limits.joint, limits.cartesian
    return replace(
        limits,
        joint=replace(joint, acceleration=readonly_copy(YIELDING_ALLOWANCE * joint.acceleration)),
        cartesian=replace(
            cartesian,
            translation_acceleration=YIELDING_ALLOWANCE * cartesian.translation_acceleration,
            rotation_acceleration=YIELDING_ALLOWANCE * cartesian.rotation_acceleration,
        ),
    )


def _joint_range(limits: AnyLimits) -> Bounds:
    joint = joint_limits(limits)
    return joint.lower - ANGLE_ALLOWANCE, joint.upper + ANGLE_ALLOWANCE


def _joint_velocity(limits: AnyLimits) -> Bounds:
    bound = VELOCITY_ALLOWANCE * joint_limits(limits).velocity
    return -bound, bound


def _joint_acceleration(limits: AnyLimits) -> Bounds:
    bound = ACCELERATION_ALLOWANCE * joint_limits(limits).acceleration
    return -bound, bound


def _collision_thresholds(limits: AnyLimits) -> Bounds:
    bound = joint_limits(limits).collision_threshold
    return -bound, bound


def _joint(order: int, fault: Fault, source: str, bounds: Callable[[AnyLimits], Bounds]) -> Condition:
    name, unit, formula = (
        ("position", "rad", "q_min < q < q_max"),
        ("velocity", "rad/s", "-dq_max < dq < dq_max"),
        ("acceleration", "rad/s^2", "-ddq_max < ddq < ddq_max"),
    )[order]
    return Condition(
        id=f"measured.joint.{name}",
        quantity=f"measured {name}",
        formula=formula,
        necessity="necessary",
        unit=unit,
        source=source,
        fault=fault,
        stage="throughout",
        signal="joint",
        order=order,
        bounds=bounds,
    )


def _tool(signal: Literal["translation", "rotation"], order: int, fault: Fault) -> Condition:
    name, factor, source = (
        ("velocity", VELOCITY_ALLOWANCE, _FASTER),
        ("acceleration", ACCELERATION_ALLOWANCE, _HARDER),
    )[order - 1]
    symbol = "d" * (order - 1) + {"translation": "v", "rotation": "omega"}[signal]
    unit = {"translation": "m", "rotation": "rad"}[signal]
    return Condition(
        id=f"measured.cartesian.{name}.{signal}",
        quantity=f"measured {signal}al {name}",
        formula=f"|{symbol}| < {symbol}_max",
        necessity="necessary",
        unit=f"{unit}/s" if order == 1 else f"{unit}/s^2",
        source=source,
        fault=fault,
        stage="throughout",
        signal=signal,
        order=order,
        bounds=tool_bounds(f"{signal}_{name}", factor),
    )


MEASURED_CONDITIONS: tuple[Condition, ...] = (
    _joint(
        0,
        Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION,
        f"{_CHOICE} and {math.degrees(ANGLE_ALLOWANCE):g} deg (our allowance)",
        _joint_range,
    ),
    Condition(
        id="measured.cartesian.position",
        quantity="measured position",
        formula="x in box",
        necessity="necessary",
        unit="m",
        source=f"{MANUAL}, 3.1.4 and 4.6; bound: the box and {BOX_ALLOWANCE:g} m (our allowance)",
        fault=Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION,
        stage="throughout",
        signal="position",
        order=0,
        bounds=lambda limits: (np.array([-math.inf]), np.array([BOX_ALLOWANCE])),
    ),
    Condition(
        id="measured.arm_angle.velocity",
        quantity="measured arm angle velocity",
        formula="|dpsi| < dpsi_max",
        necessity="necessary",
        unit="rad/s",
        source=_FASTER,
        fault=Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
        stage="throughout",
        signal="arm_angle",
        order=1,
        bounds=arm_angle_bounds("velocity", VELOCITY_ALLOWANCE),
    ),
    _joint(1, Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION, _FASTER, _joint_velocity),
    _tool("translation", 1, Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION),
    _tool("rotation", 1, Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION),
    _joint(2, Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION, _HARDER, _joint_acceleration),
    _tool("translation", 2, Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION),
    _tool("rotation", 2, Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION),
)
"""What the moving arm has to keep in every cycle, in wire order of the faults."""

EXTERNAL_TORQUE = Condition(
    id="external.torque",
    quantity="external torque",
    formula="|tau_ext| < threshold",
    necessity="necessary",
    unit="N m",
    source=f"{MANUAL}, 3.1.3 and 4.6; bound: the largest threshold, setCollisionBehavior lowers it",
    fault=Fault.COLLISION,
    stage="throughout",
    signal="external_torque",
    order=0,
    bounds=_collision_thresholds,
)

LOST_COMMANDS = Condition(
    id="lost.commands",
    quantity="lost commands in a row",
    formula="lost < threshold",
    necessity="necessary",
    unit="cycles",
    source=f"{MANUAL}, 4.6 (threshold usually 10 to 20)",
    fault=Fault.INSTABILITY_DETECTION,
    stage="throughout",
    signal="lost_commands",
    order=0,
    bounds=lambda limits: same(LOST_IN_ROW),
)
