"""The manual's conditions, and our own on distances, as one table: check, monitors, report and lessons read these rows.

A condition is a quantity between two bounds, strictly, as the manual prints it (4.1 to 4.3): `lower < value < upper`.
The necessary ones are judged on backward differences at 1 ms, as the controller does it, and breaking one stops the
robot with the fault of its row; the recommended ones ask for a motion that starts and ends at rest and for torques that
the arm can give. Every one of the twenty faults has a row that explains it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from rcilab.conformance.clearance_conditions import CLEARANCE_CONDITIONS
from rcilab.conformance.condition import MANUAL, AnyLimits, Bounds, Condition, joint_limits
from rcilab.conformance.measured_conditions import EXTERNAL_TORQUE, LOST_COMMANDS, MEASURED_CONDITIONS
from rcilab.conformance.start_end_conditions import (
    REST_ACCELERATION_TOLERANCE,
    REST_VELOCITY_TOLERANCE,
    start_pose,
    tool_rest,
)
from rcilab.conformance.tool_conditions import CARTESIAN_FRAME, CARTESIAN_POSITION, TOOL_CONDITIONS, TORQUE_CONDITIONS
from rcilab.core.arrays import JointVector
from rcilab.core.errors import InvalidValueError
from rcilab.core.faults import Fault

START_POSITION_TOLERANCE = 1e-9  # [rad]
"""How far from the arm a motion may start, in [m] too. A step of 1 nrad is a jerk of 2 rad/s^3: inside the planner's
margin."""


def _symmetric(name: str) -> Callable[[AnyLimits], Bounds]:
    def bounds(limits: AnyLimits) -> Bounds:
        bound: JointVector = getattr(joint_limits(limits), name)
        return -bound, bound

    return bounds


def _tolerance(value: float) -> Callable[[AnyLimits], Bounds]:
    def bounds(limits: AnyLimits) -> Bounds:
        bound = np.full(len(joint_limits(limits).velocity), value)
        return -bound, bound

    return bounds


def _range(limits: AnyLimits) -> Bounds:
    joint = joint_limits(limits)
    return joint.lower, joint.upper


JOINT_POSITION = Condition(
    id="joint.position",
    quantity="commanded position",
    formula="q_min < q_c < q_max",
    necessity="necessary",
    unit="rad",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,
    stage="throughout",
    order=0,
    bounds=_range,
)
JOINT_VELOCITY = Condition(
    id="joint.velocity",
    quantity="commanded velocity",
    formula="-dq_max < dq_c < dq_max",
    necessity="necessary",
    unit="rad/s",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
    stage="throughout",
    order=1,
    bounds=_symmetric("velocity"),
)
JOINT_ACCELERATION = Condition(
    id="joint.acceleration",
    quantity="commanded acceleration",
    formula="-ddq_max < ddq_c < ddq_max",
    necessity="necessary",
    unit="rad/s^2",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
    stage="throughout",
    order=2,
    bounds=_symmetric("acceleration"),
)
JOINT_JERK = Condition(
    id="joint.jerk",
    quantity="commanded jerk",
    formula="-dddq_max < dddq_c < dddq_max",
    necessity="necessary",
    unit="rad/s^3",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY,
    stage="throughout",
    order=3,
    bounds=_symmetric("jerk"),
)


def _recommended(
    stage: Literal["start", "end"], quantity: str, formula: str, order: int, tolerance: float
) -> Condition:
    kind = ("position", "velocity", "acceleration")[order]
    return Condition(
        id=f"{stage}.{kind}",
        quantity=quantity,
        formula=formula,
        necessity="recommended",
        unit=("rad", "rad/s", "rad/s^2")[order],
        source=f"{MANUAL}, 4.1 (tolerance: ours)",
        fault=None,
        stage=stage,
        order=order,
        bounds=_tolerance(tolerance),
    )


def _torque(quantity: str, limit: str, order: int) -> Condition:
    """Returns a recommended row on torques; 4.4 bounds them for direct control, where the arm adds gravity itself."""
    dots = "d" * order
    return Condition(
        id=f"joint.{limit}",
        quantity=f"{quantity} of the motion",
        formula=f"-{dots}tau_max < {dots}tau_c < {dots}tau_max",
        necessity="recommended",
        unit="N m/s" if order else "N m",
        source=f"{MANUAL}, 4.1 and 4.4 (gravity excepted)",
        fault=None,
        stage="throughout",
        signal="torque",
        order=order,
        bounds=_symmetric(limit),
    )


JOINT_CONDITIONS: tuple[Condition, ...] = (JOINT_POSITION, JOINT_VELOCITY, JOINT_ACCELERATION, JOINT_JERK)
"""What commanded joint angles have to keep in every cycle, in wire order of the faults."""

JOINT_TORQUE = _torque("torque", "torque", 0)
JOINT_TORQUE_RATE = _torque("torque rate", "torque_rate", 1)

MOTION_CONDITIONS: tuple[Condition, ...] = (
    *JOINT_CONDITIONS,
    JOINT_TORQUE,
    JOINT_TORQUE_RATE,
    _recommended("start", "distance of the start from the arm", "q_c = q", 0, START_POSITION_TOLERANCE),
    _recommended("start", "velocity at the start", "dq_c = 0", 1, REST_VELOCITY_TOLERANCE),
    _recommended("start", "acceleration at the start", "ddq_c = 0", 2, REST_ACCELERATION_TOLERANCE),
    _recommended("end", "velocity at the end", "dq_c = 0", 1, REST_VELOCITY_TOLERANCE),
    _recommended("end", "acceleration at the end", "ddq_c = 0", 2, REST_ACCELERATION_TOLERANCE),
)
"""What `check` judges of every joint motion, in the manual's order; there may be the box and distances, too."""

TOOL_END_CONDITIONS: tuple[Condition, ...] = (
    start_pose(START_POSITION_TOLERANCE, f"{MANUAL}, 4.2 (tolerance: ours)"),
    *tool_rest(f"{MANUAL}, 4.2 (tolerance: ours)"),
)
"""What the manual recommends for the start and the end of a motion of the tool."""

CARTESIAN_MOTION_CONDITIONS: tuple[Condition, ...] = (
    CARTESIAN_FRAME,
    *(row for row in TOOL_CONDITIONS if row is not CARTESIAN_POSITION),
    *JOINT_CONDITIONS,
    JOINT_TORQUE,
    JOINT_TORQUE_RATE,
    *TOOL_END_CONDITIONS,
)
"""What `check` judges of a motion that is sent as tool poses; those on joints hold for what follows from the poses."""

TORQUE_MOTION_CONDITIONS: tuple[Condition, ...] = (
    *TORQUE_CONDITIONS,
    *(row for row in MEASURED_CONDITIONS if row.signal == "joint" and row.order < 2),
)
"""What `check` judges of a motion that is sent as torques: these, and range and speed of the arm that follows them."""

CYCLE_CONDITIONS = JOINT_CONDITIONS
"""What curves of joint angles are drawn against."""

CONDITIONS: tuple[Condition, ...] = (
    *MOTION_CONDITIONS,
    *CLEARANCE_CONDITIONS,
    *TOOL_CONDITIONS,
    CARTESIAN_FRAME,
    *TOOL_END_CONDITIONS,
    *TORQUE_CONDITIONS,
    *MEASURED_CONDITIONS,
    EXTERNAL_TORQUE,
    LOST_COMMANDS,
)
"""Every condition: on joint motion (4.1), on distances (ours), on tool poses (4.2), on torques (4.3), on what the arm
does (4.6)."""


def find_condition(name: str) -> Condition:
    """Returns a condition by id.

    Raises:
        InvalidValueError: There is no such condition; the message lists those that exist.
    """
    for row in CONDITIONS:
        if row.id == name:
            return row
    known = ", ".join(row.id for row in CONDITIONS)
    raise InvalidValueError("condition", name, f"is unknown; known: {known}")


def explain_fault(fault: Fault) -> tuple[Condition, ...]:
    """Returns the manual's conditions that raise a fault, at least one for each of the twenty."""
    return tuple(row for row in CONDITIONS if row.fault is fault)
