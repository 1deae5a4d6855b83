"""The conditions of RealMan's interface: the common rows with its sources and errors.

The maker publishes no list of conditions. Ranges, speeds and accelerations are those of a controller's joints and of
its tool, which a client can change; the page "Appendix: error codes" names the error of each. Jerks have no error.
"""

from __future__ import annotations

from dataclasses import replace

from rcilab.conformance.common_conditions import (
    CARTESIAN_FRAME,
    CARTESIAN_POSITION,
    JOINT_ACCELERATION,
    JOINT_CONDITIONS,
    JOINT_END_CONDITIONS,
    JOINT_POSITION,
    JOINT_VELOCITY,
    LINK_DISTANCE,
    MEASURED_CONDITIONS,
    MOTION_TORQUE_CONDITIONS,
    START_POSE,
    TOOL_CONDITIONS,
    TOOL_STANDSTILL_CONDITIONS,
    TORQUE_CONDITIONS,
)
from rcilab.core.condition import Condition, ConditionTable
from rcilab.makers.realman.errors import RealManError

_ERRORS = "RealMan's page Appendix: error codes"
_OURS = "rcilab; the controller has no error for it"

_JOINT_ERRORS = {
    JOINT_POSITION.id: RealManError.TARGET_OVER_LIMIT,
    JOINT_VELOCITY.id: RealManError.JOINT_OVERSPEED,
    JOINT_ACCELERATION.id: RealManError.OVERACCELERATION,
}
_TOOL_ERRORS = {1: RealManError.OVERSPEED, 2: RealManError.OVERACCELERATION}
_MEASURED_ERRORS = {
    ("joint", 0): RealManError.JOINT_POSITION_LIMIT,
    ("position", 0): RealManError.FENCE,
    ("joint", 1): RealManError.JOINT_OVERSPEED,
    ("translation", 1): RealManError.OVERSPEED,
    ("rotation", 1): RealManError.OVERSPEED,
}


def _recommended(row: Condition) -> Condition:
    return replace(row, necessity="recommended", source=_OURS)


def _joint_row(row: Condition) -> Condition:
    fault = _JOINT_ERRORS.get(row.id)
    return _recommended(row) if fault is None else replace(row, fault=fault, source=_ERRORS)


def _tool_row(row: Condition) -> Condition:
    if row.signal == "arm_angle" or row.order not in _TOOL_ERRORS:
        return _recommended(row)
    return replace(row, fault=_TOOL_ERRORS[row.order], source=f"{_ERRORS}; norm: rcilab")


_MOTION = tuple(_joint_row(row) for row in (*JOINT_CONDITIONS, *MOTION_TORQUE_CONDITIONS, *JOINT_END_CONDITIONS))
_BOX = replace(CARTESIAN_POSITION, fault=RealManError.FENCE, source=f"{_ERRORS}; the box is the electronic fence")
_TOOL = (
    replace(CARTESIAN_FRAME, fault=RealManError.UNREACHABLE, source=f"{_ERRORS} (how close is singular: rcilab)"),
    *(_tool_row(row) for row in TOOL_CONDITIONS if row is not CARTESIAN_POSITION),
    replace(START_POSE, source=_OURS),
    *(_recommended(row) for row in TOOL_STANDSTILL_CONDITIONS),
)
_TORQUES = tuple(_recommended(row) for row in TORQUE_CONDITIONS)
_MEASURED = tuple(
    replace(
        row,
        fault=_MEASURED_ERRORS[row.signal, row.order],
        source=f"{_ERRORS}; bound: the commanded one with rcilab's allowance",
    )
    for row in MEASURED_CONDITIONS
    if (row.signal, row.order) in _MEASURED_ERRORS
)
_LINKS = replace(
    LINK_DISTANCE,
    fault=RealManError.SELF_COLLISION,
    source=f"{_ERRORS}, self-collision; bound: rcilab, the page has no distance",
)

REALMAN_CONDITIONS = ConditionTable(
    name="RealMan",
    motion=_MOTION,
    cartesian=(*_TOOL, *(row for row in _MOTION if row.stage == "throughout")),
    torque=_TORQUES,
    measured=_MEASURED,
    box=_BOX,
    conditions=(*_MOTION, _BOX, *_TOOL, *_TORQUES, *_MEASURED, _LINKS),
)
"""The rows for `check` and the monitors."""


def realman_conditions() -> ConditionTable:
    """Returns the conditions of every arm."""
    return REALMAN_CONDITIONS
