"""The conditions of the RCI: rows of RCI manual V1.3.1, each with its section and the fault that it raises.

4.1 is on joint motions, 4.2 on tool poses, 4.3 on torques, 4.4 has the numbers, 4.6 the faults. The manual gives one
number for the three components of the tool's velocity, acceleration and jerk; it is taken for their norm. Each of the
twenty faults is raised by at least one row.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from rcilab.conformance.clearance_conditions import CLEARANCE_CONDITIONS
from rcilab.conformance.common_conditions import (
    ACCELERATION_ALLOWANCE,
    ACCELERATION_CUTOFF,
    ANGLE_ALLOWANCE,
    BOX_ALLOWANCE,
    CARTESIAN_FRAME,
    EXTERNAL_TORQUE,
    JOINT_CONDITIONS,
    JOINT_END_CONDITIONS,
    LOST_COMMANDS,
    MEASURED_CONDITIONS,
    MOTION_TORQUE_CONDITIONS,
    START_POSE,
    TOOL_CONDITIONS,
    TOOL_STANDSTILL_CONDITIONS,
    TORQUE_RANGE,
    TORQUE_RATE,
    VELOCITY_ALLOWANCE,
)
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import Condition, ConditionTable
from rcilab.makers.rokae.faults import Fault

MANUAL = "RCI manual V1.3.1"

_JOINT_FAULTS = (
    Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,
    Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
    Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
    Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY,
)
"""By order of the derivative."""


def _tool_row(row: Condition) -> Condition:
    if row.signal == "position":
        fault, source = Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION, "3.1.4 and 4.6"
    elif row.signal == "arm_angle":
        fault = Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION
        source = "4.6 (elbow); bound: the arm angle's definition, a full turn"
        if row.order:
            source = "4.6 (elbow); bound: the vendor SDK's rate limiter, the manual gives none"
    elif row.order == 1:
        fault, source = Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION, "4.2 and 4.4 (norm: rcilab)"
    else:
        fault, source = Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION, "4.2 and 4.4 (norm: rcilab)"
    if row.order == 3 and row.signal != "arm_angle":
        source += ": the acceleration's bit, because a Cartesian jerk has no bit of its own"
    return replace(row, fault=fault, source=f"{MANUAL}, {source}")


_MEASURED_FAULTS = {
    ("joint", 0): Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION,
    ("position", 0): Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION,
    ("arm_angle", 1): Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
    ("joint", 1): Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION,
    ("translation", 1): Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION,
    ("rotation", 1): Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION,
    ("joint", 2): Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION,
    ("translation", 2): Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION,
    ("rotation", 2): Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION,
}


def _measured_row(row: Condition) -> Condition:
    bound = "4.6; bound: the commanded one"
    if row.signal == "position":
        source = f"3.1.4 and 4.6; bound: the box and {BOX_ALLOWANCE:g} m (rcilab's allowance)"
    elif row.order == 0:
        source = f"{bound} and {math.degrees(ANGLE_ALLOWANCE):g} deg (rcilab's allowance)"
    elif row.order == 1:
        source = f"{bound} x {VELOCITY_ALLOWANCE:g} (rcilab's allowance)"
    else:
        source = f"{bound} x {ACCELERATION_ALLOWANCE:g} (rcilab's allowance), low-passed at {ACCELERATION_CUTOFF:g} Hz"
    return replace(row, fault=_MEASURED_FAULTS[row.signal, row.order], source=f"{MANUAL}, {source}")


RCI_JOINT_CONDITIONS: tuple[Condition, ...] = tuple(
    replace(row, fault=fault, source=f"{MANUAL}, 4.1 and 4.4")
    for row, fault in zip(JOINT_CONDITIONS, _JOINT_FAULTS, strict=True)
)
"""On commanded joint angles in every cycle, in wire order of the faults."""

_TORQUES = tuple(replace(row, source=f"{MANUAL}, 4.1 and 4.4 (gravity excepted)") for row in MOTION_TORQUE_CONDITIONS)
_MOTION = (
    *RCI_JOINT_CONDITIONS,
    *_TORQUES,
    *(replace(row, source=f"{MANUAL}, 4.1 (tolerance: rcilab)") for row in JOINT_END_CONDITIONS),
)

RCI_TOOL_CONDITIONS: tuple[Condition, ...] = tuple(_tool_row(row) for row in TOOL_CONDITIONS)
"""On commanded tool poses in every cycle, in wire order of the faults."""

_FRAME = replace(
    CARTESIAN_FRAME, fault=Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME, source=f"{MANUAL}, 4.2 and 4.6"
)
_TOOL_ENDS = tuple(
    replace(row, source=f"{MANUAL}, 4.2 (tolerance: rcilab)") for row in (START_POSE, *TOOL_STANDSTILL_CONDITIONS)
)

RCI_TORQUE_CONDITIONS: tuple[Condition, ...] = (
    replace(TORQUE_RATE, fault=Fault.COMMAND_TORQUE_DISCONTINUITY, source=f"{MANUAL}, 4.3 and 4.4"),
    replace(TORQUE_RANGE, fault=Fault.COMMAND_TORQUE_RANGE_VIOLATION, source=f"{MANUAL}, 4.3 and 4.4"),
)
"""On commanded torques in every cycle, in wire order of the faults."""

RCI_MEASURED_CONDITIONS: tuple[Condition, ...] = tuple(_measured_row(row) for row in MEASURED_CONDITIONS)
"""On the moving arm in every cycle, in wire order of the faults."""

RCI_CONDITIONS = ConditionTable(
    name="RCI",
    motion=_MOTION,
    cartesian=(_FRAME, *RCI_TOOL_CONDITIONS[1:], *RCI_JOINT_CONDITIONS, *_TORQUES, *_TOOL_ENDS),
    torque=(
        *RCI_TORQUE_CONDITIONS,
        *(row for row in RCI_MEASURED_CONDITIONS if row.signal == "joint" and row.order < 2),
    ),
    measured=RCI_MEASURED_CONDITIONS,
    box=RCI_TOOL_CONDITIONS[0],
    conditions=(
        *_MOTION,
        *CLEARANCE_CONDITIONS,
        *RCI_TOOL_CONDITIONS,
        _FRAME,
        *_TOOL_ENDS,
        *RCI_TORQUE_CONDITIONS,
        *RCI_MEASURED_CONDITIONS,
        replace(
            EXTERNAL_TORQUE,
            fault=Fault.COLLISION,
            source=f"{MANUAL}, 3.1.3 and 4.6; bound: the largest threshold, setCollisionBehavior lowers it",
        ),
        replace(
            LOST_COMMANDS,
            fault=Fault.INSTABILITY_DETECTION,
            source=f"{MANUAL}, 4.6 (threshold usually 10 to 20)",
        ),
    ),
)
"""The rows for `check` and the monitors of the xMate arms, and for the virtual controller."""

_FAULTS = {row.id: row.fault for row in RCI_CONDITIONS.conditions if isinstance(row.fault, Fault)}


def rci_faults(violations: Iterable[LimitViolation]) -> tuple[Fault, ...]:
    """Returns the faults that violations raise, by the ids of their conditions, in wire order and once each."""
    return tuple(sorted({_FAULTS[row.id] for row, *_ in violations if row.id in _FAULTS}))


def rci_conditions() -> ConditionTable:
    """Returns the conditions of the RCI."""
    return RCI_CONDITIONS
