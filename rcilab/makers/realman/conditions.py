"""The conditions of RealMan's interface: the common rows with its sources and errors.

The maker publishes no list of conditions. Ranges, speeds and accelerations are those of a controller's joints and of
its tool, which a client can change; the page "Appendix: error codes" names the error of each. Jerks have no error.
"""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np

from rcilab.conformance.common_conditions import (
    CARTESIAN_FRAME,
    CARTESIAN_POSITION,
    EXTERNAL_TORQUE,
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
from rcilab.core.condition import AnyLimits, Bounds, Condition, ConditionTable, joint_limits
from rcilab.makers.realman.bounds import LARGEST_STREAM_STEP
from rcilab.makers.realman.errors import RealManError

_ERRORS = "RealMan's page Appendix: error codes"
_SET = f"{_ERRORS}; bound: set in the controller, of a new one that of the maker's client library"
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


def _largest_step(limits: AnyLimits) -> Bounds:
    bound = np.full(len(joint_limits(limits).lower), radians(LARGEST_STREAM_STEP))
    return -bound, bound


def _recommended(row: Condition) -> Condition:
    return replace(row, necessity="recommended", source=_OURS)


def _joint_row(row: Condition) -> Condition:
    fault = _JOINT_ERRORS.get(row.id)
    return _recommended(row) if fault is None else replace(row, fault=fault, source=_SET)


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
_STEP = Condition(
    id="stream.step",
    quantity="step of streamed angles",
    formula=f"|q_c - q_c,before| < {LARGEST_STREAM_STEP:g} deg",
    necessity="necessary",
    unit="rad",
    source="RealMan's page on movej_canfd",
    fault=RealManError.JOINT_POSITION_STEP,
    stage="throughout",
    signal="joint_step",
    order=0,
    bounds=_largest_step,
)
_FENCE = replace(
    CARTESIAN_POSITION,
    id="links.fence",
    quantity="distance of a link beyond the fence",
    formula="d < 0",
    part="links",
    fault=RealManError.FENCE,
    source="RealMan's page Electronic fence (links: capsules of rcilab)",
)
_CONTACT = replace(
    EXTERNAL_TORQUE,
    fault=RealManError.COLLISION,
    source=f"{_ERRORS}; the threshold follows from the collision stage, the maker gives no figure",
)

REALMAN_CONDITIONS = ConditionTable(
    name="RealMan",
    motion=_MOTION,
    cartesian=(*_TOOL, *(row for row in _MOTION if row.stage == "throughout")),
    torque=_TORQUES,
    measured=_MEASURED,
    box=_BOX,
    modes=("joint_position",),
    conditions=(*_MOTION, _STEP, _FENCE, _BOX, *_TOOL, *_TORQUES, *_MEASURED, _CONTACT, _LINKS),
)
"""The rows for `check` and the monitors."""


def realman_conditions() -> ConditionTable:
    """Returns the conditions of every arm."""
    return REALMAN_CONDITIONS
