"""Franka's conditions for the Panda, as rows of a table like the manual's: the same ids where they judge the same.

The page "Robot and interface specifications" prints three lists: for joint trajectories, for Cartesian ones with what
follows from them for the joints, and for torques. What it recommends for the start and the end of a motion stands in
the list of Cartesian ones; it is taken to hold for joints alike. Which error a broken condition raises is told on the
page "Errors". Differences are taken backward over 1 ms there as well.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rcilab.conformance.condition import AnyLimits, Bounds, Condition, joint_limits, same
from rcilab.conformance.conditions import (
    JOINT_ACCELERATION,
    JOINT_CONDITIONS,
    JOINT_JERK,
    JOINT_POSITION,
    JOINT_VELOCITY,
    MOTION_CONDITIONS,
)
from rcilab.conformance.measured_conditions import EXTERNAL_TORQUE, LOST_COMMANDS, MEASURED_CONDITIONS
from rcilab.conformance.start_end_conditions import start_pose, tool_rest
from rcilab.conformance.tool_conditions import (
    CARTESIAN_FRAME,
    CARTESIAN_POSITION,
    TOOL_CONDITIONS,
    TORQUE_RANGE,
    TORQUE_RATE,
)
from rcilab.core.franka_errors import FrankaError

_PAGE = "Franka's page Robot and interface specifications"
_ERRORS = "Franka's page Errors"
_ELBOW_JOINT = 2  # From 0: Franka's elbow is the angle of joint 3.

START_TOLERANCE = 1e-6  # [rad] or [m]
"""How far from the arm a motion may start. A choice, the page gives no figure: less is a jerk inside every bound."""

_JOINT_ERRORS = {
    JOINT_POSITION.id: FrankaError.JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION,
    JOINT_VELOCITY.id: FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION,
    JOINT_ACCELERATION.id: FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY,
    JOINT_JERK.id: FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY,
}
_INVERSE_ERRORS = {
    JOINT_POSITION.id: FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_POSITION_LIMITS_VIOLATION,
    JOINT_VELOCITY.id: FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_LIMITS_VIOLATION,
    JOINT_ACCELERATION.id: FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_DISCONTINUITY,
    JOINT_JERK.id: FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_ACCELERATION_DISCONTINUITY,
}
_TOOL_ERRORS = {
    1: FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION,
    2: FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_DISCONTINUITY,
    3: FrankaError.CARTESIAN_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY,
}
_MEASURED_ERRORS = {
    ("joint", 0): FrankaError.JOINT_POSITION_LIMITS_VIOLATION,
    ("position", 0): FrankaError.CARTESIAN_POSITION_LIMITS_VIOLATION,
    ("joint", 1): FrankaError.JOINT_VELOCITY_VIOLATION,
    ("translation", 1): FrankaError.CARTESIAN_VELOCITY_VIOLATION,
    ("rotation", 1): FrankaError.CARTESIAN_VELOCITY_VIOLATION,
}


def _motion_row(row: Condition) -> Condition:
    """Returns a row of the manual's on joint motions as Franka has it."""
    if row.id in _JOINT_ERRORS:
        return replace(row, fault=_JOINT_ERRORS[row.id], source=f"{_PAGE}, joint trajectory, necessary; {_ERRORS}")
    if row.id == "start.position":
        return replace(
            row,
            necessity="necessary",
            fault=FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID,
            source=f"{_PAGE}, necessary by its example; {_ERRORS} (tolerance: ours)",
            bounds=_start_bounds,
        )
    ours = "" if row.signal == "torque" else "; tolerance: ours"
    return replace(row, source=f"{_PAGE}, recommended (printed for Cartesian trajectories{ours})")


def _start_bounds(limits: AnyLimits) -> Bounds:
    bound = np.full(len(joint_limits(limits).velocity), START_TOLERANCE)
    return -bound, bound


def _inverse_row(row: Condition) -> Condition:
    place = _ERRORS if row.order == 3 else f"{_PAGE}, Cartesian trajectory, from the inverse; {_ERRORS}"
    return replace(
        row,
        id=f"inverse.{row.id}",
        quantity=row.quantity.replace("commanded", "resulting"),
        fault=_INVERSE_ERRORS[row.id],
        source=place,
    )


def _tool_row(row: Condition) -> Condition:
    source = f"{_PAGE}, Cartesian trajectory, necessary; {_ERRORS}"
    if row.signal != "arm_angle":
        return replace(row, fault=_TOOL_ERRORS[row.order], source=f"{source} (norm: ours)")
    elbow = replace(
        row,
        quantity=row.quantity.replace("arm angle", "elbow"),
        formula=row.formula.replace("psi", "q_3"),
        fault=FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
        source=f"{_PAGE}, Cartesian limits, Elbow; {_ERRORS}",
        id=row.id.replace("arm_angle", "elbow"),
    )
    if row.order:
        return elbow
    return replace(elbow, formula="q_3,min < q_3,c < q_3,max", bounds=_elbow_range)


def _elbow_range(limits: AnyLimits) -> Bounds:
    joint = joint_limits(limits)
    one = slice(_ELBOW_JOINT, _ELBOW_JOINT + 1)
    return joint.lower[one], joint.upper[one]


FRANKA_MOTION_CONDITIONS: tuple[Condition, ...] = tuple(_motion_row(row) for row in MOTION_CONDITIONS)
"""What `check` judges of every joint motion of a Panda, in the order of the manual's."""

FRANKA_BOX = replace(
    CARTESIAN_POSITION,
    fault=FrankaError.CARTESIAN_POSITION_LIMITS_VIOLATION,
    source=f"{_ERRORS}; the box is ours: no command of this interface sets one",
)

FRANKA_ELBOW_SIGN = Condition(
    id="elbow.sign",
    quantity="side of the elbow against that at the start",
    formula="sign(q_4 - q_flip) = sign(q_4,start - q_flip)",
    necessity="necessary",
    unit="",
    source=f"{_PAGE}, the flip of the elbow; {_ERRORS}",
    fault=FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_SIGN_INCONSISTENT,
    stage="throughout",
    signal="elbow_sign",
    order=0,
    bounds=lambda limits: (np.array([0.0]), np.array([2.0])),
)
"""+1 on the side of the start, -1 beyond the angle of joint 4 at which the arm is stretched."""

FRANKA_TOOL_CONDITIONS: tuple[Condition, ...] = (
    replace(
        CARTESIAN_FRAME,
        formula="T_c proper, reachable, not singular at q_3",
        fault=FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG,
        source=f"{_PAGE}, Cartesian trajectory, necessary (singular: ours)",
    ),
    *(_tool_row(row) for row in TOOL_CONDITIONS if row is not CARTESIAN_POSITION),
    FRANKA_ELBOW_SIGN,
    *(_inverse_row(row) for row in JOINT_CONDITIONS),
    replace(
        start_pose(START_TOLERANCE, f"{_ERRORS} ({_PAGE}: recommended; tolerance: ours)"),
        necessity="necessary",
        fault=FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_START_POSE_INVALID,
    ),
    Condition(
        id="start.elbow",
        quantity="distance of the first elbow from the arm's",
        formula="q_3,c = q_3",
        necessity="necessary",
        unit="rad",
        source=f"{_ERRORS} (tolerance: ours)",
        fault=FrankaError.CARTESIAN_MOTION_GENERATOR_START_ELBOW_INVALID,
        stage="start",
        signal="arm_angle",
        order=0,
        bounds=lambda limits: same(START_TOLERANCE),
    ),
    *tool_rest(f"{_PAGE}, Cartesian trajectory, recommended (tolerance: ours)"),
)
"""What a commanded tool pose has to keep, and the joints that follow from it."""

FRANKA_TORQUE_CONDITIONS: tuple[Condition, ...] = (
    replace(
        TORQUE_RATE,
        fault=FrankaError.CONTROLLER_TORQUE_DISCONTINUITY,
        source=f"{_PAGE}, controller, necessary; {_ERRORS}",
    ),
    replace(TORQUE_RANGE, necessity="recommended", fault=None, source=f"{_PAGE}, controller, recommended"),
    Condition(
        id="start.torque",
        quantity="torque at the start",
        formula="tau_c = 0",
        necessity="recommended",
        unit="N m",
        source=f"{_PAGE}, controller, recommended (tolerance: ours, what one cycle may change)",
        fault=None,
        stage="start",
        signal="torque",
        order=0,
        bounds=lambda limits: (-0.001 * joint_limits(limits).torque_rate, 0.001 * joint_limits(limits).torque_rate),
    ),
)
"""What a commanded torque has to keep."""

FRANKA_BEHAVIOUR_CONDITIONS: tuple[Condition, ...] = (
    *(
        replace(
            row,
            fault=_MEASURED_ERRORS[row.signal, row.order],
            source=f"{_ERRORS}; bound: the commanded one with our allowance",
        )
        for row in MEASURED_CONDITIONS
        if (row.signal, row.order) in _MEASURED_ERRORS
    ),
    replace(
        EXTERNAL_TORQUE,
        fault=FrankaError.JOINT_REFLEX,
        source=f"{_ERRORS}, reflexes; bound: what setCollisionBehavior sets, the maker names no largest one",
    ),
    Condition(
        id="external.force",
        quantity="external force",
        formula="|F_ext| < threshold",
        necessity="necessary",
        unit="N",
        source=f"{_ERRORS}, reflexes; bound: what setCollisionBehavior sets, the maker names no largest one",
        fault=FrankaError.CARTESIAN_REFLEX,
        stage="throughout",
        signal="external_force",
        order=0,
        bounds=lambda limits: same(math.inf),
    ),
    replace(
        LOST_COMMANDS,
        fault=FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION,
        source=f"{_ERRORS}, communication: 20 cycles without a packet",
    ),
)
"""What the arm itself has to keep, and the network."""

FRANKA_CARTESIAN_MOTION_CONDITIONS: tuple[Condition, ...] = (
    *FRANKA_TOOL_CONDITIONS,
    *(row for row in FRANKA_MOTION_CONDITIONS if row.signal == "torque"),
)
"""What `check` judges of a motion that is sent as tool poses."""

FRANKA_TORQUE_MOTION_CONDITIONS: tuple[Condition, ...] = (
    *FRANKA_TORQUE_CONDITIONS,
    *(row for row in FRANKA_BEHAVIOUR_CONDITIONS if row.is_measured and row.signal == "joint"),
)
"""What `check` judges of a motion that is sent as torques: these, and range and speed of the arm that follows them."""

FRANKA_CONDITIONS: tuple[Condition, ...] = (
    *FRANKA_MOTION_CONDITIONS,
    FRANKA_BOX,
    *FRANKA_TOOL_CONDITIONS,
    *FRANKA_TORQUE_CONDITIONS,
    *FRANKA_BEHAVIOUR_CONDITIONS,
)
"""Every condition of the Panda. Errors without a bound on the pages (power, sensor range, self-collision) have none."""
