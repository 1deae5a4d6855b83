"""The conditions of Franka's control interface (FCI) for Panda and FR3: the common rows with its sources and errors.

The page "Robot and interface specifications" has three lists: for joint trajectories, for Cartesian ones with their
consequences for the joints, and for torques. Its recommendations for the start and the end of a motion are in the list
for Cartesian ones; they are applied to joints, too. The page "Errors" names the error of each violated condition.
Differences are backward differences over 1 ms there as well.

The FR3 has the Panda's rows with three differences. Its velocity bounds decrease towards the ends of the joints'
ranges, to zero; they are those at the last commanded angles, which its clients compute from its state, and at least
the velocity that its rounding gives a standing joint. A commanded angle out of
range raises the error of a measured one. And its state has single precision: a client whose rate limiter starts from
the commanded values in it is off by their rounding, which the bounds of accelerations, jerks, torque rates and first
commands allow.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcilab.conformance.common_conditions import (
    CARTESIAN_FRAME,
    CARTESIAN_POSITION,
    EXTERNAL_TORQUE,
    JOINT_ACCELERATION,
    JOINT_CONDITIONS,
    JOINT_END_CONDITIONS,
    JOINT_JERK,
    JOINT_POSITION,
    JOINT_VELOCITY,
    LINK_DISTANCE,
    LOST_COMMANDS,
    MEASURED_CONDITIONS,
    MOTION_TORQUE_CONDITIONS,
    START_POSE,
    TOOL_CONDITIONS,
    TOOL_STANDSTILL_CONDITIONS,
    TORQUE_RANGE,
    TORQUE_RATE,
)
from rcilab.conformance.standstill import resolution
from rcilab.core.condition import (
    AnyLimits,
    Bounds,
    Condition,
    ConditionTable,
    Signal,
    joint_limits,
    symmetric_bounds,
)
from rcilab.core.limits import JointLimits
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.state_rounding import joint_limits_with_state_rounding, with_state_rounding

_PAGE = "Franka's page Robot and interface specifications"
_ERRORS = "Franka's page Errors"
_STEP = "tolerance: what one cycle may change by jerk, rcilab"
_ELBOW_LIMITS = f"{_PAGE}, Cartesian limits, Elbow"
_ELBOW_JOINT = 2  # From 0: Franka's elbow is the angle of joint 3.

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


def _first_step(signal: Signal) -> Callable[[AnyLimits], Bounds]:
    """Returns the bounds of a first command: a larger step from standstill violates the jerk."""

    def bounds(limits: AnyLimits) -> Bounds:
        step = resolution(signal, 0, limits)
        return -step, step

    return bounds


def _motion_row(row: Condition) -> Condition:
    """Returns a common row on joint motions in Franka's form."""
    if row.id in _JOINT_ERRORS:
        return replace(row, fault=_JOINT_ERRORS[row.id], source=f"{_PAGE}, joint trajectory, necessary; {_ERRORS}")
    if row.id == "start.position":
        return replace(
            row,
            necessity="necessary",
            fault=FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID,
            source=f"{_PAGE}, necessary by its example; {_ERRORS} ({_STEP})",
            bounds=_first_step("joint"),
        )
    ours = "" if row.signal == "torque" else "; tolerance: rcilab"
    return replace(row, source=f"{_PAGE}, recommended (printed for Cartesian trajectories{ours})")


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
        is_library = (row.signal, row.order) == ("translation", 1)
        note = _LIBRARY_VELOCITY if is_library else "norm: rcilab"
        return replace(row, fault=_TOOL_ERRORS[row.order], source=f"{source} ({note})")
    elbow = replace(
        row,
        quantity=row.quantity.replace("arm angle", "elbow"),
        formula=row.formula.replace("psi", "q_3"),
        fault=FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
        source=f"{_ELBOW_LIMITS}; {_ERRORS}",
        id=row.id.replace("arm_angle", "elbow"),
    )
    if row.order:
        return elbow
    return replace(elbow, formula="q_3,min < q_3,c < q_3,max", bounds=_elbow_range)


_LIBRARY_VELOCITY = "norm: rcilab; bound: rate limiter of the client library, where the page has 1.7 m/s"


def _elbow_range(limits: AnyLimits) -> Bounds:
    joint = joint_limits(limits)
    one = slice(_ELBOW_JOINT, _ELBOW_JOINT + 1)
    return joint.lower[one], joint.upper[one]


_MOTION = tuple(_motion_row(row) for row in (*JOINT_CONDITIONS, *MOTION_TORQUE_CONDITIONS, *JOINT_END_CONDITIONS))

_BOX = replace(
    CARTESIAN_POSITION,
    fault=FrankaError.CARTESIAN_POSITION_LIMITS_VIOLATION,
    source=f"{_ERRORS}; the box is ours: no command of this interface sets one",
)

_ELBOW_SIGN = Condition(
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

_TOOL = (
    replace(
        CARTESIAN_FRAME,
        formula="T_c proper, reachable, not singular at q_3",
        fault=FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG,
        source=f"{_PAGE}, Cartesian trajectory, necessary (singular: rcilab)",
    ),
    *(_tool_row(row) for row in TOOL_CONDITIONS if row is not CARTESIAN_POSITION),
    _ELBOW_SIGN,
    *(_inverse_row(row) for row in JOINT_CONDITIONS),
    replace(
        START_POSE,
        source=f"{_ERRORS} ({_PAGE}: recommended; {_STEP})",
        bounds=_first_step("translation"),
        necessity="necessary",
        fault=FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_START_POSE_INVALID,
    ),
    Condition(
        id="start.elbow",
        quantity="distance of the first elbow from the arm's",
        formula="q_3,c = q_3",
        necessity="necessary",
        unit="rad",
        source=f"{_ERRORS} ({_STEP})",
        fault=FrankaError.CARTESIAN_MOTION_GENERATOR_START_ELBOW_INVALID,
        stage="start",
        signal="arm_angle",
        order=0,
        bounds=_first_step("arm_angle"),
    ),
    *(
        replace(row, source=f"{_PAGE}, Cartesian trajectory, recommended (tolerance: rcilab)")
        for row in TOOL_STANDSTILL_CONDITIONS
    ),
)
"""On commanded tool poses, and on their joint angles."""

_TORQUES = (
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
        source=f"{_PAGE}, controller, recommended (tolerance: rcilab, what one cycle may change)",
        fault=None,
        stage="start",
        signal="torque",
        order=0,
        bounds=lambda limits: (-0.001 * joint_limits(limits).torque_rate, 0.001 * joint_limits(limits).torque_rate),
    ),
)
"""On commanded torques."""

_BEHAVIOUR = (
    *(
        replace(
            row,
            fault=_MEASURED_ERRORS[row.signal, row.order],
            source=f"{_ERRORS}; bound: the commanded one with rcilab's allowance",
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
        bounds=lambda limits: symmetric_bounds(math.inf),
    ),
    replace(
        LINK_DISTANCE,
        fault=FrankaError.SELF_COLLISION_AVOIDANCE_VIOLATION,
        source=f"{_ERRORS}, self-collision; bound: rcilab, the page has no distance",
    ),
    replace(
        LOST_COMMANDS,
        fault=FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION,
        source=f"{_ERRORS}, communication: 20 cycles without a packet",
    ),
)
"""On the arm itself and the network."""

FCI_CONDITIONS = ConditionTable(
    name="FCI",
    motion=_MOTION,
    cartesian=(*_TOOL, *(row for row in _MOTION if row.signal == "torque")),
    torque=(*_TORQUES, *(row for row in _BEHAVIOUR if row.is_measured and row.signal == "joint")),
    measured=tuple(row for row in _BEHAVIOUR if row.is_measured),
    box=_BOX,
    conditions=(*_MOTION, _BOX, *_TOOL, *_TORQUES, *_BEHAVIOUR),
    has_free_elbow=True,
)
"""The rows for `check` and the monitors of the Panda. Errors without a bound on the pages (power, sensor
range) have no row."""


_FR3_PAGE = "Franka's page Control parameters, limits for Franka Research 3"
_FR3_URDF = "numbers: the URDF of the arm"
_OF_URDF = ("joint.position", "joint.torque", "torque.range", "elbow.position")


def _fr3_row(row: Condition) -> Condition:
    """Returns a row of the Panda in the FR3's form: the rule is that of the same page, its numbers are not."""
    name = row.id.removeprefix("inverse.")
    if name == "joint.velocity":
        source = f"{_FR3_PAGE}; {_FR3_URDF}; {_ERRORS} (at least the rounding of the state: rcilab)"
        return replace(row, formula="dq_min(q) < dq_c < dq_max(q)", source=source)
    if row.is_measured or row.stage != "throughout" or not (row.order or name in _OF_URDF):
        return row
    numbers = _FR3_URDF if name in _OF_URDF else f"numbers: {_FR3_PAGE}"
    source = row.source.replace(_LIBRARY_VELOCITY, "norm: rcilab").replace(_ELBOW_LIMITS, f"{_PAGE}, Elbow")
    fault = FrankaError.JOINT_POSITION_LIMITS_VIOLATION if name == "joint.position" else row.fault
    return replace(row, fault=fault, source=f"{source}; {numbers}")


def _with_rounding(row: Condition) -> Condition:
    """Returns a row with bounds that allow the rounding of the last command in the state, if its value is off by it."""
    is_first_or_torque = row.stage == "start" or row.signal == "torque"
    is_rounded = row.id != "torque.range" if is_first_or_torque else row.order >= 2
    if row.necessity != "necessary" or row.is_measured or not is_rounded:
        return row

    def bounds(limits: AnyLimits) -> Bounds:
        is_joint = isinstance(limits, JointLimits)
        return row.bounds(joint_limits_with_state_rounding(limits) if is_joint else with_state_rounding(limits))

    return replace(row, bounds=bounds, source=f"{row.source} (with the rounding of the state: rcilab)")


_FR3 = {row.id: _with_rounding(_fr3_row(row)) for row in FCI_CONDITIONS.conditions}


def _fr3_rows(rows: tuple[Condition, ...]) -> tuple[Condition, ...]:
    return tuple(_FR3[row.id] for row in rows)


FR3_CONDITIONS = ConditionTable(
    name="FCI",
    motion=_fr3_rows(FCI_CONDITIONS.motion),
    cartesian=_fr3_rows(FCI_CONDITIONS.cartesian),
    torque=_fr3_rows(FCI_CONDITIONS.torque),
    measured=_fr3_rows(FCI_CONDITIONS.measured),
    box=_BOX,
    conditions=tuple(_FR3.values()),
    has_free_elbow=True,
    sends_arm_angle=False,  # The poses of pylibfranka have no elbow.
)
"""The rows of the FR3."""


def fci_conditions() -> ConditionTable:
    """Returns the conditions of the Panda."""
    return FCI_CONDITIONS


def fr3_conditions() -> ConditionTable:
    """Returns the conditions of the FR3."""
    return FR3_CONDITIONS
