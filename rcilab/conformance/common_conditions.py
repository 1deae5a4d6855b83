"""Conditions common to the interfaces of several makers, without the fault and the source of a maker.

A condition is a quantity strictly between two bounds: `lower < value < upper`. Necessary conditions are checked on
backward differences at 1 ms, as by a controller; recommended ones require a motion that starts and ends at standstill,
and torques within the arm's capacity. A maker's table contains these rows with its own faults and sources.

Velocity, acceleration and jerk of the tool are norms of backward differences, in base axes. Rotation velocity is the
rotation vector of one cycle, divided by the cycle time.

Makers publish no bounds for measured quantities. They are the commanded bounds with an allowance, because a servo
overshoots and a compliant arm is pushed. Measured accelerations are low-pass filtered differences of measured
velocities over one cycle, because the unfiltered difference is mostly noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from rcilab.conformance.standstill import standstill_bounds
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.condition import (
    AnyLimits,
    Bounds,
    Condition,
    ConditionTable,
    all_limits,
    joint_limits,
    joint_tolerance,
    symmetric_bounds,
)
from rcilab.core.limits import JointLimits, Limits
from rcilab.robots.description import RobotDescription

START_POSITION_TOLERANCE = 1e-9  # [rad]
"""Largest distance of a motion's start from the arm, also in [m]. A step of 1 nrad is a jerk of 2 rad/s^3, within the
planner's margin."""
STANDSTILL_VELOCITY = 1e-4  # [rad/s] or [m/s]
"""A velocity counts as zero up to this, more than rounding, beyond what one cycle within the limits changes."""
STANDSTILL_ACCELERATION = 1e-2  # [rad/s^2] or [m/s^2]
"""The same for an acceleration: a thousandth of the smallest acceleration limit."""
BOX_TOLERANCE = 1e-9  # [m]
"""A smaller distance outside the safety box counts as inside, so that a tool on its face does not stop the arm."""
ARM_ANGLE_TOLERANCE = 1e-9  # [rad]
"""Tolerance of an arm angle beyond pi: pi itself is valid, and its decimal form is rounded."""

ANGLE_ALLOWANCE = math.radians(1.0)  # [rad] Overshoot of a servo at the end of a joint's range.
BOX_ALLOWANCE = 0.01  # [m] About `ANGLE_ALLOWANCE` at the tool, and the deflection under soft impedance.
VELOCITY_ALLOWANCE = 1.1  # Factor on the commanded bound: servo overshoot.
ACCELERATION_ALLOWANCE = 3.5
"""Factor on the commanded bound: servo overshoot and filtered noise. Joint 5 of a real xMatePro3 reached 2.96 without a
fault, with this filter, when commands came again after they had been missing for 22 cycles (recorded identification
motion; docs/pauses.md). The other joints reached 0.8 to 2.2."""
ACCELERATION_CUTOFF = 20.0  # [Hz] First order. Below the first resonances of arms of this size, above their motions.
COMPLIANT_ALLOWANCE = 3.4
"""Further factor on the acceleration bounds of a compliant arm. Its light last joints, pushed with 30 N or commanded a
torque of some N m, accelerate faster than any position command allows."""
LOST_COMMANDS_THRESHOLD = 20  # [cycles] The largest threshold in the makers' manuals.

_NAMES = ("position", "velocity", "acceleration", "jerk")
_UNITS = {"translation": "m", "rotation": "rad", "arm_angle": "rad"}


def compliant_limits(limits: Limits) -> Limits:
    """Returns the bounds of a compliant arm, as under impedance control: more acceleration, the rest unchanged."""
    joint, cartesian = limits.joint, limits.cartesian
    return replace(
        limits,
        joint=replace(joint, acceleration=readonly_copy(COMPLIANT_ALLOWANCE * joint.acceleration)),
        cartesian=replace(
            cartesian,
            translation_acceleration=COMPLIANT_ALLOWANCE * cartesian.translation_acceleration,
            rotation_acceleration=COMPLIANT_ALLOWANCE * cartesian.rotation_acceleration,
        ),
    )


def unlimited_accelerations(limits: Limits) -> Limits:
    """Returns the bounds without accelerations and the speed of the arm angle, for makers with no error for them."""
    joint, cartesian, arm_angle = limits.joint, limits.cartesian, limits.arm_angle
    return replace(
        limits,
        joint=replace(joint, acceleration=readonly_copy(np.full_like(joint.acceleration, np.inf))),
        cartesian=replace(cartesian, translation_acceleration=np.inf, rotation_acceleration=np.inf),
        arm_angle=None if arm_angle is None else replace(arm_angle, velocity=np.inf),
    )


def _symmetric(name: str, factor: float = 1.0) -> Callable[[AnyLimits], Bounds]:
    """Returns the bounds function of a joint quantity, such as "velocity"."""

    def bounds(limits: AnyLimits) -> Bounds:
        bound: JointVector = getattr(joint_limits(limits), name)
        if factor != 1.0:
            bound = factor * bound
        return -bound, bound

    return bounds


def _joint_range(limits: AnyLimits) -> Bounds:
    joint = joint_limits(limits)
    return joint.lower, joint.upper


def _measured_range(limits: AnyLimits) -> Bounds:
    joint = joint_limits(limits)
    return joint.lower - ANGLE_ALLOWANCE, joint.upper + ANGLE_ALLOWANCE


def _tool_bounds(name: str, factor: float = 1.0) -> Callable[[AnyLimits], Bounds]:
    """Returns the bounds function of a norm of the tool, such as "translation_velocity"."""

    def bounds(limits: AnyLimits) -> Bounds:
        return symmetric_bounds(factor * getattr(all_limits(limits).cartesian, name))

    return bounds


def _arm_angle_bounds(name: str, factor: float = 1.0) -> Callable[[AnyLimits], Bounds]:
    """Returns the bounds function of a derivative of the arm angle; without an arm angle there is no bound."""

    def bounds(limits: AnyLimits) -> Bounds:
        arm_angle = all_limits(limits).arm_angle
        return symmetric_bounds(math.inf if arm_angle is None else factor * getattr(arm_angle, name))

    return bounds


def _joint(order: int) -> Condition:
    dots, name = "d" * order, _NAMES[order]
    return Condition(
        id=f"joint.{name}",
        quantity=f"commanded {name}",
        formula=f"-{dots}q_max < {dots}q_c < {dots}q_max" if order else "q_min < q_c < q_max",
        necessity="necessary",
        unit=("rad", "rad/s", "rad/s^2", "rad/s^3")[order],
        stage="throughout",
        order=order,
        bounds=_symmetric(name) if order else _joint_range,
        bounds_at=JointLimits.checked_velocity_bounds if order == 1 else None,
    )


def _motion_torque(quantity: str, limit: str, order: int) -> Condition:
    """Returns a recommended row on torques without gravity, which the controller compensates."""
    dots = "d" * order
    return Condition(
        id=f"joint.{limit}",
        quantity=f"{quantity} of the motion",
        formula=f"-{dots}tau_max < {dots}tau_c < {dots}tau_max",
        necessity="recommended",
        unit="N m/s" if order else "N m",
        stage="throughout",
        signal="torque",
        order=order,
        bounds=_symmetric(limit),
    )


def _joint_end(stage: Literal["start", "end"], order: int) -> Condition:
    name = _NAMES[order]
    tolerance = STANDSTILL_VELOCITY if order == 1 else STANDSTILL_ACCELERATION
    return Condition(
        id=f"{stage}.{name}",
        quantity=f"{name} at the {stage}" if order else "distance of the start from the arm",
        formula=f"{'d' * order}q_c = 0" if order else "q_c = q",
        necessity="recommended",
        unit=("rad", "rad/s", "rad/s^2")[order],
        stage=stage,
        order=order,
        bounds=standstill_bounds(tolerance, "joint", order) if order else joint_tolerance(START_POSITION_TOLERANCE),
    )


def _tool(signal: Literal["translation", "rotation"], order: int) -> Condition:
    kind = {"translation": "translational", "rotation": "rotational"}[signal]
    symbol = {"translation": "v", "rotation": "omega"}[signal]
    dots = "d" * (order - 1)
    return Condition(
        id=f"cartesian.{_NAMES[order]}.{signal}",
        quantity=f"commanded {kind} {_NAMES[order]}",
        formula=f"|{dots}{symbol}_c| < {dots}{symbol}_max",
        necessity="necessary",
        unit=f"{_UNITS[signal]}/s" + (f"^{order}" if order > 1 else ""),
        stage="throughout",
        signal=signal,
        order=order,
        bounds=_tool_bounds(f"{signal}_{_NAMES[order]}"),
    )


def _arm_angle(order: int) -> Condition:
    dots = "d" * order
    return Condition(
        id=f"arm_angle.{_NAMES[order]}",
        quantity=f"commanded arm angle{' ' + _NAMES[order] if order else ''}",
        formula=f"|{dots}psi_c| < {dots}psi_max" if order else "|psi_c| <= pi",
        necessity="necessary",
        unit="rad" if order == 0 else "rad/s" + (f"^{order}" if order > 1 else ""),
        stage="throughout",
        signal="arm_angle",
        order=order,
        bounds=(
            _arm_angle_bounds(_NAMES[order])
            if order
            else lambda limits: symmetric_bounds(math.pi + ARM_ANGLE_TOLERANCE)
        ),
    )


def _tool_end(stage: Literal["start", "end"], signal: Literal["translation", "rotation"], order: int) -> Condition:
    kind = {"translation": "translational", "rotation": "rotational"}[signal]
    tolerance = STANDSTILL_VELOCITY if order == 1 else STANDSTILL_ACCELERATION
    return Condition(
        id=f"{stage}.cartesian.{_NAMES[order]}.{signal}",
        quantity=f"{kind} {_NAMES[order]} at the {stage}",
        formula="dp_c = 0" if order == 1 else "ddp_c = 0",
        necessity="recommended",
        unit=_UNITS[signal] + ("/s" if order == 1 else "/s^2"),
        stage=stage,
        signal=signal,
        order=order,
        bounds=standstill_bounds(tolerance, signal, order),
    )


def _measured_joint(order: int) -> Condition:
    name, bounds = _NAMES[order], _measured_range
    if order:
        bounds = _symmetric(name, VELOCITY_ALLOWANCE if order == 1 else ACCELERATION_ALLOWANCE)
    dots = "d" * order
    return Condition(
        id=f"measured.joint.{name}",
        quantity=f"measured {name}",
        formula=f"-{dots}q_max < {dots}q < {dots}q_max" if order else "q_min < q < q_max",
        necessity="necessary",
        unit=("rad", "rad/s", "rad/s^2")[order],
        stage="throughout",
        order=order,
        bounds=bounds,
    )


def _measured_tool(signal: Literal["translation", "rotation"], order: int) -> Condition:
    symbol = "d" * (order - 1) + {"translation": "v", "rotation": "omega"}[signal]
    factor = VELOCITY_ALLOWANCE if order == 1 else ACCELERATION_ALLOWANCE
    return Condition(
        id=f"measured.cartesian.{_NAMES[order]}.{signal}",
        quantity=f"measured {signal}al {_NAMES[order]}",
        formula=f"|{symbol}| < {symbol}_max",
        necessity="necessary",
        unit=_UNITS[signal] + ("/s" if order == 1 else "/s^2"),
        stage="throughout",
        signal=signal,
        order=order,
        bounds=_tool_bounds(f"{signal}_{_NAMES[order]}", factor),
    )


JOINT_CONDITIONS: tuple[Condition, ...] = tuple(_joint(order) for order in range(4))
"""Conditions on commanded joint angles in every cycle: position, velocity, acceleration, jerk."""
JOINT_POSITION, JOINT_VELOCITY, JOINT_ACCELERATION, JOINT_JERK = JOINT_CONDITIONS

MOTION_TORQUE_CONDITIONS: tuple[Condition, ...] = (
    _motion_torque("torque", "torque", 0),
    _motion_torque("torque rate", "torque_rate", 1),
)
"""Conditions on the torques of a motion commanded in angles or poses."""

JOINT_END_CONDITIONS: tuple[Condition, ...] = (
    *(_joint_end("start", order) for order in range(3)),
    *(_joint_end("end", order) for order in (1, 2)),
)
"""Conditions on the start and the end of a joint motion."""

CARTESIAN_POSITION = Condition(
    id="cartesian.position",
    quantity="commanded position",
    formula="x_c in box",
    necessity="necessary",
    unit="m",
    stage="throughout",
    signal="position",
    order=0,
    bounds=lambda limits: (np.array([-math.inf]), np.array([BOX_TOLERANCE])),
)
"""Condition on the distance of the tool outside its safety box, [m]; any depth inside is allowed."""

TOOL_CONDITIONS: tuple[Condition, ...] = (
    CARTESIAN_POSITION,
    *(_arm_angle(order) for order in range(4)),
    _tool("translation", 1),
    _tool("rotation", 1),
    _tool("translation", 2),
    _tool("rotation", 2),
    _tool("translation", 3),
    _tool("rotation", 3),
)
"""Conditions on commanded tool poses in every cycle, in the order of the values of `CartesianMonitor`."""

CARTESIAN_FRAME = Condition(
    id="cartesian.frame",
    quantity="commanded pose",
    formula="T_c proper, reachable, not singular",
    necessity="necessary",
    unit="",
    stage="throughout",
    signal="frame",
    order=0,
    bounds=lambda limits: symmetric_bounds(1.0),
)
"""Condition on the closeness to a singularity: singular from 1. Infinite for an invalid pose or one out of reach."""

START_POSE = Condition(
    id="start.cartesian.position",
    quantity="distance of the first pose from the arm's",
    formula="T_c = T",
    necessity="recommended",
    unit="m",
    stage="start",
    signal="translation",
    order=0,
    bounds=lambda limits: symmetric_bounds(START_POSITION_TOLERANCE),
)

TOOL_STANDSTILL_CONDITIONS: tuple[Condition, ...] = (
    _tool_end("start", "translation", 1),
    _tool_end("start", "rotation", 1),
    _tool_end("start", "translation", 2),
    _tool_end("start", "rotation", 2),
    _tool_end("end", "translation", 1),
    _tool_end("end", "rotation", 1),
    _tool_end("end", "translation", 2),
    _tool_end("end", "rotation", 2),
)
"""Conditions on the tool's velocity and acceleration at the start and the end."""

TORQUE_RATE = Condition(
    id="torque.rate",
    quantity="commanded torque rate",
    formula="-dtau_max < dtau_c < dtau_max",
    necessity="necessary",
    unit="N m/s",
    stage="throughout",
    signal="torque",
    order=1,
    bounds=_symmetric("torque_rate"),
)
TORQUE_RANGE = Condition(
    id="torque.range",
    quantity="commanded torque",
    formula="-tau_max < tau_c < tau_max",
    necessity="necessary",
    unit="N m",
    stage="throughout",
    signal="torque",
    order=0,
    bounds=_symmetric("torque"),
)
TORQUE_CONDITIONS: tuple[Condition, ...] = (TORQUE_RATE, TORQUE_RANGE)
"""Conditions on commanded torques in every cycle, in the order of the values of `TorqueMonitor`."""

MEASURED_CONDITIONS: tuple[Condition, ...] = (
    _measured_joint(0),
    Condition(
        id="measured.cartesian.position",
        quantity="measured position",
        formula="x in box",
        necessity="necessary",
        unit="m",
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
        stage="throughout",
        signal="arm_angle",
        order=1,
        bounds=_arm_angle_bounds("velocity", VELOCITY_ALLOWANCE),
    ),
    _measured_joint(1),
    _measured_tool("translation", 1),
    _measured_tool("rotation", 1),
    _measured_joint(2),
    _measured_tool("translation", 2),
    _measured_tool("rotation", 2),
)
"""Conditions on measured values in every cycle, in the order of the values of `MeasuredMonitor`."""

EXTERNAL_TORQUE = Condition(
    id="external.torque",
    quantity="external torque",
    formula="|tau_ext| < threshold",
    necessity="necessary",
    unit="N m",
    stage="throughout",
    signal="external_torque",
    order=0,
    bounds=_symmetric("collision_threshold"),
)

LOST_COMMANDS = Condition(
    id="lost.commands",
    quantity="lost commands in a row",
    formula="lost < threshold",
    necessity="necessary",
    unit="cycles",
    stage="throughout",
    signal="lost_commands",
    order=0,
    bounds=lambda limits: symmetric_bounds(LOST_COMMANDS_THRESHOLD),
)

LINK_DISTANCE = Condition(
    id="links.distance",
    quantity="distance between links",
    formula="d > 0",
    necessity="necessary",
    unit="m",
    stage="throughout",
    signal="link_distance",
    order=0,
    bounds=lambda limits: (np.array([0.0]), np.array([math.inf])),
)
"""Condition of controllers that notice links of their arm that overlap; no maker publishes a distance."""

COMMON_CONDITIONS = ConditionTable(
    name="common table",
    motion=(*JOINT_CONDITIONS, *MOTION_TORQUE_CONDITIONS, *JOINT_END_CONDITIONS),
    cartesian=(
        CARTESIAN_FRAME,
        *TOOL_CONDITIONS[1:],
        *JOINT_CONDITIONS,
        *MOTION_TORQUE_CONDITIONS,
        START_POSE,
        *TOOL_STANDSTILL_CONDITIONS,
    ),
    torque=(*TORQUE_CONDITIONS, *(row for row in MEASURED_CONDITIONS if row.signal == "joint" and row.order < 2)),
    measured=MEASURED_CONDITIONS,
    box=CARTESIAN_POSITION,
    conditions=(
        *JOINT_CONDITIONS,
        *MOTION_TORQUE_CONDITIONS,
        *JOINT_END_CONDITIONS,
        *TOOL_CONDITIONS,
        CARTESIAN_FRAME,
        START_POSE,
        *TOOL_STANDSTILL_CONDITIONS,
        *TORQUE_CONDITIONS,
        *MEASURED_CONDITIONS,
        EXTERNAL_TORQUE,
        LOST_COMMANDS,
    ),
)
"""Conditions for an arm without a maker."""


def condition_table(description: RobotDescription) -> ConditionTable:
    """Returns the conditions for an arm: those of its maker's interface, or the common ones."""
    return COMMON_CONDITIONS if description.conditions is None else description.conditions()
