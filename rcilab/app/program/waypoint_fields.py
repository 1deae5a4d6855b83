"""Typed numbers of a waypoint: the range of each field, and the waypoint with the number."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.goal.goal_actions import FURTHEST
from rcilab.app.program.program_draft import Draft, target_in_base, target_of
from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import Message, message
from rcilab.model.robot_model import RobotModel
from rcilab.motion.joint import MIN_SPEED
from rcilab.motion.waypoint import Waypoint
from rcilab.motion.waypoint_types import ALLOWED, LARGEST_BLEND, LARGEST_OFFSET, LONGEST_DWELL, MOST_REPEATS

VIA_FIELDS = ("via_x", "via_y", "via_z")
_BULGE = 0.25  # Distance of a new via point from the straight line, as a part of the line's length.
_NO_WAY = 1e-3  # [m] A shorter line gets no arc.


_Take = Callable[[Waypoint, float], Waypoint]
_PLAIN: dict[str, tuple[float, float, str, _Take]] = {
    "speed": (100.0 * MIN_SPEED, 100.0, "%", lambda waypoint, value: replace(waypoint, speed=value / 100.0)),
    "blend": (0.0, 1000.0 * LARGEST_BLEND, "mm", lambda waypoint, value: replace(waypoint, blend=value / 1000.0)),
    "dwell": (0.0, LONGEST_DWELL, "s", lambda waypoint, value: replace(waypoint, dwell=value)),
    "approach": (
        0.0, 1000.0 * LARGEST_OFFSET, "mm",
        lambda waypoint, value: replace(waypoint, approach=value / 1000.0 if value else None),
    ),
    "distance": (
        0.1, 1000.0 * LARGEST_OFFSET, "mm", lambda waypoint, value: replace(waypoint, distance=value / 1000.0)
    ),
    "timeout": (0.0, LONGEST_DWELL, "s", lambda waypoint, value: replace(waypoint, timeout=value)),
    "angle": (0.1, 360.0, "deg", lambda waypoint, value: replace(waypoint, angle=min(math.radians(value), math.tau))),
}  # fmt: skip
_TEXTS = ("signal", "text")
_POINTS = {f"{name}_{axis}": (name, index) for name in ("center", "axis") for index, axis in enumerate("xyz")}
CIRCLE_FIELDS = tuple(_POINTS)
"""Centre and axis of a circle."""
WAYPOINT_FIELDS = (*_PLAIN, "count", *_TEXTS, "psi", *POSE_FIELDS, *VIA_FIELDS, *CIRCLE_FIELDS)
"""The numbers and texts of a step that can be typed."""


def proposed(waypoint: Waypoint, field: str, typed: str, arm: RobotModel) -> Waypoint | Message | None:
    """Returns the waypoint with a typed number, the problem of that number, or None for a field that it lacks.

    Numbers of the pose and the arm angle replace joint angles by a pose: both cannot be kept.

    Args:
        waypoint: The waypoint.
        field: One of `WAYPOINT_FIELDS`.
        typed: The text of the field.
        arm: The arm with the program's tool.
    """
    try:
        return _proposed(waypoint, field, typed, arm)
    except InvalidValueError as error:
        return message("program.bad", why=describe_error(error))


def _proposed(waypoint: Waypoint, field: str, typed: str, arm: RobotModel) -> Waypoint | Message | None:
    if field in _POINTS:
        return _with_coordinate(waypoint, field, typed)
    if field in ALLOWED["joint"] and field not in ALLOWED[waypoint.type] and field != "psi":
        return None
    if field == "count":
        parsed = parse_number(typed, 1, MOST_REPEATS, "")
        if parsed.value is not None and parsed.value != round(parsed.value):
            return message("program.whole", typed=typed[:40])
        return parsed.problem if parsed.value is None else replace(waypoint, count=int(parsed.value))
    if field == "text":
        return replace(waypoint, text=typed.strip())
    if field == "signal":
        return _with_signal(waypoint, typed.strip())
    if field in _PLAIN:
        low, high, unit, take = _PLAIN[field]
        parsed = (
            parse_number(typed or "0", low, high, unit) if field == "approach" else parse_number(typed, low, high, unit)
        )
        return parsed.problem if parsed.value is None else take(waypoint, parsed.value)
    if field == "psi" and arm.redundancy:
        if not typed.strip() and waypoint.type != "nullspace":
            return replace(as_pose(waypoint, arm), psi=None)
        parsed = parse_number(typed, -180.0, 180.0, "deg")
        if parsed.value is None:
            return parsed.problem
        return replace(as_pose(waypoint, arm), psi=math.radians(parsed.value))
    if field in VIA_FIELDS and waypoint.via is not None:
        parsed = parse_number(typed, -1000.0 * FURTHEST, 1000.0 * FURTHEST, "mm")
        if parsed.value is None:
            return parsed.problem
        via = list(waypoint.via)
        via[VIA_FIELDS.index(field)] = parsed.value / 1000.0
        return replace(waypoint, via=tuple(via))
    target = target_of(waypoint, arm)
    if field not in POSE_FIELDS or target is None:
        return None
    index = POSE_FIELDS.index(field)
    bound, unit = (1000.0 * FURTHEST, "mm") if index < 3 else (360.0, "deg")
    parsed = parse_number(typed, -bound, bound, unit)
    if parsed.value is None:
        return parsed.problem
    position, rpy = target.position, target.rpy
    if index < 3:
        position[index] = parsed.value / 1000.0
    else:
        rpy[index - 3] = math.radians(parsed.value)
    pose = Pose.from_rpy(position, rpy)
    wxyz = target.wxyz if index < 3 else pose.wxyz
    return replace(as_pose(waypoint, arm), position=tuple(position.tolist()), wxyz=tuple(wxyz.tolist()))


def _with_signal(waypoint: Waypoint, typed: str) -> Waypoint | Message:
    """Returns a step with the number or name of a signal; a block, and the jaws, may have none."""
    if not typed and waypoint.type in ("repeat", "tool"):
        return replace(waypoint, signal=None, level=None)
    return replace(waypoint, signal=int(typed) if typed.isascii() and typed.isdecimal() else typed)


def _with_coordinate(waypoint: Waypoint, field: str, typed: str) -> Waypoint | Message | None:
    """Returns a circle with a coordinate of its centre, or a component of its axis."""
    name, index = _POINTS[field]
    before = getattr(waypoint, name)
    if before is None:
        return None
    scale, bound, unit = (1000.0, 1000.0 * FURTHEST, "mm") if name == "center" else (1.0, 1.0, "")
    parsed = parse_number(typed, -bound, bound, unit)
    if parsed.value is None:
        return parsed.problem
    numbers = list(before)
    numbers[index] = parsed.value / scale
    return replace(waypoint, **{name: tuple(numbers)})


def as_pose(waypoint: Waypoint, arm: RobotModel) -> Waypoint:
    """Returns a waypoint whose joint angles are replaced by their pose and arm angle."""
    if waypoint.q is None:
        return waypoint
    T = arm.forward(waypoint.q)
    return replace(
        waypoint,
        q=None,
        position=tuple(T.position.tolist()),
        wxyz=tuple(T.wxyz.tolist()),
        psi=arm_angle_of(waypoint, arm),
    )


def arm_angle_of(waypoint: Waypoint, arm: RobotModel) -> float | None:
    """Returns the arm angle of a waypoint, [rad]; None if it has no arm angle, or leaves it open."""
    if waypoint.q is None or not arm.redundancy:
        return waypoint.psi
    try:
        return arm.arm_angle(waypoint.q)
    except KinematicsError:
        return None


def default_via(draft: Draft, key: int, arm: RobotModel) -> Array | None:
    """Returns a point next to the straight line to a step, for an arc over it, [m]; None if there is no line.

    Args:
        draft: The program, placed in base.
        key: Key of the step.
        arm: The arm with the program's tool.
    """
    index = draft.index(key)
    if index is None or draft.start is None:
        return None
    goal = target_in_base(draft.steps[index].waypoint, arm)
    start = target_in_base(draft.steps[index - 1].waypoint, arm) if index else arm.forward(draft.start)
    if goal is None or start is None:
        return None
    way = goal.position - start.position
    if float(np.linalg.norm(way)) < _NO_WAY:
        return None
    aside = np.cross((0.0, 0.0, 1.0), way)
    if float(np.linalg.norm(aside)) < 0.1 * float(np.linalg.norm(way)):
        aside = np.cross((0.0, 1.0, 0.0), way)
    aside *= np.linalg.norm(way) / np.linalg.norm(aside)
    return start.position + 0.5 * way + _BULGE * aside
