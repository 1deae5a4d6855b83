"""The conditions of UFACTORY controllers: the common rows with the maker's bounds and error codes.

The rows are those of targets of mode 1 (servo); the controller itself plans the motions of the other modes within the
same bounds. The manual publishes ranges, speeds, accelerations and jerks. Targets of mode 1 beyond a speed, an
acceleration or a jerk are no error: the controller follows them later, as fast as it may. Their rows are therefore
recommended. Errors are a joint out of its range (C23), a pose without joint angles (C21) or a step away (C24), and a
tool that is too fast (C60).

The interface has no arm angle and takes no torques, so there are no rows on them. A reduced mode sets ranges and
speeds within these, and a safety boundary is the box of `cartesian.position`.
"""

from __future__ import annotations

from dataclasses import replace

from rcilab.conformance.common_conditions import (
    CARTESIAN_FRAME,
    CARTESIAN_POSITION,
    EXTERNAL_TORQUE,
    JOINT_CONDITIONS,
    JOINT_END_CONDITIONS,
    JOINT_POSITION,
    LINK_DISTANCE,
    MEASURED_CONDITIONS,
    MOTION_TORQUE_CONDITIONS,
    START_POSE,
    TOOL_CONDITIONS,
    TOOL_STANDSTILL_CONDITIONS,
)
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import ConditionTable, all_limits, symmetric_bounds
from rcilab.makers.ufactory.bounds import REPORT_PERIOD, SERVO_STEP
from rcilab.makers.ufactory.errors import UfactoryError

_MANUAL = "user manual of UFACTORY Studio"
_LATER = f"{_MANUAL}, 9 and 10; the controller follows faster targets later"

_JOINTS = (
    replace(JOINT_POSITION, fault=UfactoryError.JOINT_RANGE, source=f"{_MANUAL}, 10 and 12"),
    *(replace(row, necessity="recommended", source=_LATER) for row in JOINT_CONDITIONS if row is not JOINT_POSITION),
)
_TORQUE = replace(MOTION_TORQUE_CONDITIONS[0], source="maker's description package, effort (gravity excepted)")
_ENDS = tuple(
    replace(row, source=f"{_MANUAL}, 9, servo mode: continuous targets (tolerance: rcilab)")
    for row in JOINT_END_CONDITIONS
)
_TOOL_RATES = tuple(
    replace(row, necessity="recommended", source=f"{_LATER} (norm: rcilab)")
    for row in TOOL_CONDITIONS
    if row.signal in ("translation", "rotation")
)
_SERVO_SPEED = replace(
    _TOOL_RATES[0],
    id="servo.velocity.translation",
    necessity="necessary",
    fault=UfactoryError.SERVO_LINEAR_SPEED,
    source="client library, table of codes, 60, and default of set_linear_spd_limit_factor",
    bounds=lambda limits: symmetric_bounds(all_limits(limits).joint_tool_velocity),
)
"""On the tool of a motion that is sent as joint angles."""

_BOX = replace(CARTESIAN_POSITION, fault=UfactoryError.SAFETY_BOUNDARY, source=f"{_MANUAL}, 6.3.1 and 12")
_FRAME = replace(CARTESIAN_FRAME, fault=UfactoryError.KINEMATICS, source=f"{_MANUAL}, 12 (singular: rcilab)")
_FIRST_STEP = replace(
    START_POSE,
    formula=f"|p_c - p| < {1e3 * SERVO_STEP:g} mm",
    necessity="necessary",
    fault=UfactoryError.SPEED,
    source=f"{_MANUAL}, 9, servo mode: steps of at most {1e3 * SERVO_STEP:g} mm (code: rcilab)",
    bounds=lambda limits: symmetric_bounds(SERVO_STEP),
)
_TOOL_ENDS = tuple(
    replace(row, source=f"{_MANUAL}, 9, servo mode: continuous targets (tolerance: rcilab)")
    for row in TOOL_STANDSTILL_CONDITIONS
)

_MEASURED_ERRORS = {
    ("joint", 0): UfactoryError.JOINT_RANGE,
    ("position", 0): UfactoryError.SAFETY_BOUNDARY,
    ("joint", 1): UfactoryError.MEASURED_SPEED,
    ("translation", 1): UfactoryError.MEASURED_SPEED,
    ("rotation", 1): UfactoryError.MEASURED_SPEED,
}
_MEASURED = tuple(
    replace(
        row,
        fault=_MEASURED_ERRORS[row.signal, row.order],
        source=f"{_MANUAL}, 12; bound: the commanded one with rcilab's allowance",
    )
    for row in MEASURED_CONDITIONS
    if (row.signal, row.order) in _MEASURED_ERRORS
)
_BEHAVIOUR = (
    *_MEASURED,
    replace(
        EXTERNAL_TORQUE,
        fault=UfactoryError.COLLISION,
        source=f"{_MANUAL}, 12; the threshold follows from the collision sensitivity, the maker gives no figure",
    ),
    replace(
        LINK_DISTANCE,
        fault=UfactoryError.SELF_COLLISION,
        source=f"{_MANUAL}, 6.4.3 and 12; bound: rcilab, the manual has no distance",
    ),
)

_MOTION = (*_JOINTS, _SERVO_SPEED, _TORQUE, *_ENDS)
_CARTESIAN = (_FRAME, *_TOOL_RATES, *_JOINTS, _TORQUE, _FIRST_STEP, *_TOOL_ENDS)

UFACTORY_CONDITIONS = ConditionTable(
    name="xArm interface",
    motion=_MOTION,
    cartesian=_CARTESIAN,
    torque=(),
    measured=_MEASURED,
    box=_BOX,
    modes=("joint_position",),
    conditions=tuple({row.id: row for row in (*_MOTION, _BOX, *_CARTESIAN, *_BEHAVIOUR)}.values()),
    command_cycles=round(REPORT_PERIOD / CYCLE_TIME),
)
"""The rows for `check` and the monitors."""


def ufactory_conditions() -> ConditionTable:
    """Returns the conditions of the interface."""
    return UFACTORY_CONDITIONS
