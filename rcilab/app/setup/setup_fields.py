"""The numbers of a configuration by field, in mm, deg, kg and kg m^2, and the configuration with one changed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rcilab.app.goal.goal import POSE_FIELDS, with_pose_field
from rcilab.app.setup.configuration_state import SetupState
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.model.dynamics.payload import LARGEST_INERTIA, Payload

FACE_NAMES = ("xmin", "ymin", "zmin", "xmax", "ymax", "zmax")
INERTIA_NAMES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
FIELD_NAMES = {
    "box": (*FACE_NAMES, *POSE_FIELDS[3:]),
    "tool": POSE_FIELDS,
    "load": ("mass", *POSE_FIELDS[:3], *INERTIA_NAMES),
    "force": POSE_FIELDS,
}
JOINT_ENDS = ("lower", "upper")
"""In addition to FIELD_NAMES: setup.joints.lower.0 and so on."""
_ROUNDED = 1e-5  # [rad] Smaller than the resolution of an angle field.
THINNEST = 0.02  # [m] Smallest thickness of a box that is dragged.
FARTHEST_FACE = 5.0  # [m] More than three times the reach of any arm: a larger value is a mistake of units.

_PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Range:
    """The range of a field."""

    low: float
    high: float
    unit: str


def field_range(part: str, name: str, rated_payload: float, longest_tool: float) -> Range:
    """Returns the range of a field, in the unit of the field.

    Args:
        part: A key of `FIELD_NAMES`.
        name: One of its names.
        rated_payload: Payload of the arm, [kg].
        longest_tool: See `Capabilities.longest_tool`, [m].
    """
    if name in POSE_FIELDS[3:]:
        return Range(-360.0, 360.0, "deg")
    if name == "mass":
        return Range(0.0, rated_payload, "kg")
    if name in INERTIA_NAMES:
        return Range(0.0 if name in INERTIA_NAMES[:3] else -LARGEST_INERTIA, LARGEST_INERTIA, "kg·m²")
    farthest = 1000.0 * (FARTHEST_FACE if part == "box" else longest_tool)
    return Range(-farthest, farthest, "mm")


def field_names(part: str, *, turns_box: bool) -> tuple[str, ...]:
    """Returns the fields of a part.

    Args:
        part: A key of `FIELD_NAMES`.
        turns_box: See `Capabilities.turns_box`.
    """
    return FACE_NAMES if part == "box" and not turns_box else FIELD_NAMES[part]


def read_field(setup: SetupState, part: str, name: str) -> float:
    """Returns the number of a field, in its unit."""
    wanted = setup.wanted
    assert wanted.box is not None
    assert wanted.tool is not None
    assert wanted.load is not None
    assert wanted.force is not None
    if part == "box" and name in FACE_NAMES:
        return 1000.0 * float(faces(wanted.box)[FACE_NAMES.index(name)])
    if name == "mass":
        return wanted.load.mass
    if name in INERTIA_NAMES:
        return moments(setup)[INERTIA_NAMES.index(name)]
    if part == "load":
        return 1000.0 * float(wanted.load.center_of_mass[POSE_FIELDS.index(name)])
    pose = {"box": wanted.box.T_base_box, "tool": wanted.tool, "force": wanted.force.T_flange_force}[part]
    index = POSE_FIELDS.index(name)
    return 1000.0 * float(pose.position[index]) if index < 3 else math.degrees(float(pose.rpy[index - 3]))


def with_field(setup: SetupState, part: str, name: str, value: float, longest_tool: float) -> SetupState | Message:
    """Returns the configuration with one number changed, or the problem of the number.

    Args:
        setup: The configuration.
        part: A key of `FIELD_NAMES`.
        name: One of its names.
        value: In the unit of the field.
        longest_tool: See `Capabilities.longest_tool`, [m].
    """
    wanted = setup.wanted
    assert wanted.box is not None
    assert wanted.tool is not None
    assert wanted.load is not None
    assert wanted.force is not None
    if part == "box" and name in FACE_NAMES:
        bounds = faces(wanted.box)
        bounds[FACE_NAMES.index(name)] = value / 1000.0
        axis = FACE_NAMES.index(name) % 3
        if not bounds[axis] < bounds[axis + 3]:
            low, high = (float(bounds[i]) for i in (axis, axis + 3))
            return message("setup.faces", axis="xyz"[axis], low=low, high=high)
        return _with(setup, box=box_between(wanted.box, bounds))
    if part == "box":
        box = wanted.box
        return _with(setup, box=replace(box, T_base_box=with_pose_field(box.T_base_box, name, value)))
    if part == "tool":
        return with_pose(setup, "tool", with_pose_field(wanted.tool, name, value), longest_tool)
    if part == "force":
        return with_pose(setup, "force", with_pose_field(wanted.force.T_flange_force, name, value), longest_tool)
    return _with_load_field(setup, wanted.load, name, value)


def with_pose(setup: SetupState, part: str, pose: Pose, longest_tool: float) -> SetupState | Message:
    """Returns the configuration with a part moved, or why that is not possible."""
    wanted = setup.wanted
    length = math.hypot(*pose.parts[1])
    if part != "box" and length > longest_tool:
        return message("setup.far", length=length, bound=longest_tool)
    if part == "box":
        assert wanted.box is not None
        if float(np.abs(pose.position).max()) > FARTHEST_FACE:
            return message("setup.far", length=length, bound=FARTHEST_FACE)
        return _with(setup, box=replace(wanted.box, T_base_box=pose))
    if part == "tool":
        return _with(setup, tool=pose)
    if part == "force":
        assert wanted.force is not None
        return _with(setup, force=replace(wanted.force, T_flange_force=pose))
    assert wanted.load is not None
    return _with(setup, load=replace(wanted.load, center_of_mass=pose.position))


def faces(box: SafetyBox) -> np.ndarray:
    """Returns the positions of the faces along the axes of the box: low x, y, z, high x, y, z, [m]."""
    centre = box.T_base_box.rotation.T @ box.T_base_box.position
    half = 0.5 * np.array(box.size)
    return np.concatenate((centre - half, centre + half))


def box_between(box: SafetyBox, bounds: np.ndarray) -> SafetyBox:
    """Returns a box of the same orientation with other faces, in the order of `faces`."""
    low, high = bounds[:3], bounds[3:]
    centre = box.T_base_box.rotation @ (0.5 * (low + high))
    pose = Pose.from_parts(box.T_base_box.parts[0], (float(centre[0]), float(centre[1]), float(centre[2])))
    return replace(box, size=tuple((high - low).tolist()), T_base_box=pose)


def moments(setup: SetupState) -> tuple[float, ...]:
    """Returns the six moments of inertia as typed, or those of the load, [kg m^2]."""
    if setup.inertia is not None:
        return setup.inertia
    assert setup.wanted.load is not None
    return tuple(float(setup.wanted.load.inertia[place]) for place in _PLACES)


def _with_load_field(setup: SetupState, load: Payload, name: str, value: float) -> SetupState | Message:
    if name == "mass":
        if value == 0.0:
            return _with(replace(setup, inertia=None), load=Payload(center_of_mass=load.center_of_mass))
        return _with(setup, load=replace(load, mass=value))
    if name in INERTIA_NAMES:
        typed = list(moments(setup))
        typed[INERTIA_NAMES.index(name)] = value
        return replace(setup, inertia=tuple(typed))
    center = np.array(load.center_of_mass)
    center[POSE_FIELDS.index(name)] = value / 1000.0
    return _with(setup, load=replace(load, center_of_mass=center))


def with_inertia(setup: SetupState) -> SetupState | Message:
    """Returns the configuration with the typed moments of inertia in the load, or why no body can have them."""
    load = setup.wanted.load
    assert load is not None
    if setup.inertia is None:
        return setup
    if load.mass == 0.0 and any(setup.inertia):
        return message("setup.massless")
    inertia = np.zeros((3, 3))
    for (row, column), value in zip(_PLACES, setup.inertia, strict=True):
        inertia[row, column] = inertia[column, row] = value
    try:
        heavier = replace(load, inertia=inertia)
    except InvalidValueError:
        principal = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(inertia).tolist())
        return message("setup.no_body", moments=principal)
    return _with(replace(setup, inertia=None), load=heavier)


def _with(setup: SetupState, **parts: object) -> SetupState:
    return replace(setup, wanted=setup.wanted.updated(RobotConfiguration(**parts)))  # type: ignore[arg-type]  # By their names.


def exact_end(own: JointLimits, end: str, joint: int, angle: float) -> float:
    """Returns a typed end of a soft joint limit, [rad]: the arm's own limit, unrounded, if the field shows that.

    Args:
        own: Limits of the arm.
        end: "lower" or "upper".
        joint: Index of the joint.
        angle: The typed angle, [rad].
    """
    exact = float(getattr(own, end)[joint])
    return exact if abs(angle - exact) < _ROUNDED else angle


def joint_limits_between(lower: Sequence[float], upper: Sequence[float]) -> SoftJointLimits | Message:
    """Returns soft joint limits from their ends, [rad], or the joints whose ends leave no range."""
    for low, high in zip(lower, upper, strict=True):
        if not low < high:
            return message("setup.joint_ends", low=low, high=high)
    return SoftJointLimits(lower=tuple(lower), upper=tuple(upper))
