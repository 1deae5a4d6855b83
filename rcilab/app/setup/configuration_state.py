"""The configuration on the page: what is edited, what the controller has, and the difference."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rcilab.app.run.mode_parameters import is_control_pending
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import (
    SETUP_PARTS,
    ForceControlFrame,
    ForceFrame,
    RobotConfiguration,
    SetupPart,
    SoftJointLimits,
    tool_limits_of,
)
from rcilab.model.dynamics.payload import NO_LOAD, Payload
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.app.goal.goal import Tone
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

LISTED: tuple[SetupPart, ...] = (*SETUP_PARTS, "joints")
"""The parts of the Setup tab."""
ON_FLANGE: tuple[SetupPart, ...] = ("tool", "load", "force")
FORCE_AXES = {"world": ForceFrame.WORLD, "tool": ForceFrame.TOOL, "path": ForceFrame.PATH}

_SAME_PLACE, _SAME_TURN = 1e-4, 1e-3  # [m], elements of a rotation: largest difference of two equal tools.
_SAME_LIMIT, _SAME_ANGLE = 1e-3, 1e-4  # Share, [rad]: more than the rounding of an interface.
_SEEN = 5e-5  # [m] A tool at a smaller distance from a face is on the face: it would be 0.0 mm outside.
_FIRST_SETUP = RobotConfiguration(
    box=SafetyBox(size=(1.6, 1.6, 1.3), T_base_box=Pose((0.0, 0.0, 0.66)), active=False),
    tool=IDENTITY,
    load=NO_LOAD,
    force=ForceControlFrame(),
)
"""The configuration of an arm before any edit; the box is a proposal, and off."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SetupState:
    """Box, tool, load and force-control frame as set by the operator."""

    wanted: RobotConfiguration = field(default_factory=lambda: _FIRST_SETUP)
    """All four parts."""
    touched: frozenset[SetupPart] = frozenset()
    """The parts that were edited here: those to be sent to the controller."""
    inertia: tuple[float, ...] | None = None
    """Six typed moments, xx yy zz xy xz yz, [kg m^2], that no body can have; None: those of the load."""
    edited: str = ""
    """The part with handles in the scene; "" for none."""
    seen: frozenset[str] = frozenset()
    """The parts that are drawn."""
    asked: RobotConfiguration | None = None
    """The configuration for a real robot that awaits a second confirmation."""
    refusal: Message | None = None
    """Why the controller refused it."""
    can_undo: bool = False


def pending_parts(state: UiState, status: SupervisorStatus) -> tuple[SetupPart, ...]:
    """Returns the edited parts that the controller has not accepted yet."""
    setup = state.setup
    return tuple(
        part
        for part in LISTED
        if part in setup.touched and getattr(status.setup, part) is not getattr(setup.wanted, part)
    )


def drawn_parts(parts: Iterable[str]) -> frozenset[str]:
    """Returns those of the parts that the scene can draw."""
    return frozenset(parts) & frozenset(SETUP_PARTS)


def own_limits(state: UiState) -> SoftJointLimits:
    """Returns the whole range of the arm's joints."""
    own = describe_robot(state.model.name).limits.joint
    return SoftJointLimits(lower=tuple(own.lower.tolist()), upper=tuple(own.upper.tolist()))


def soft_limits(state: UiState) -> SoftJointLimits:
    """Returns the soft limits as set; the whole range if none are."""
    return state.setup.wanted.joints or own_limits(state)


def setup_obstacle(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns why no motion may run with this configuration, or None if the controller has it."""
    parts = pending_parts(state, status)
    if not parts:
        return None
    if state.setup.refusal is not None:
        return message("ready.setup_refused", error=state.setup.refusal)
    if state.target == "virtual":
        return message("ready.setup_pending")
    return message("ready.setup_unsent", what=name_parts(parts), address=state.target)


def tool_outside(state: UiState, position: np.ndarray) -> Message | None:
    """Returns how far outside the safety box the tool is, and beyond which face; None inside or without a box.

    Args:
        state: State of the page.
        position: Position of the tool in base, shape (3,), [m].
    """
    box = active_box(state.setup.wanted.box)
    if box is None:
        return None
    face, distance = box.exceeded_face(position)
    return message("ready.outside", distance=distance, face=face) if distance > _SEEN else None


def goal_verdict(state: UiState) -> tuple[Tone, Message]:
    """Returns whether the target is reachable, and why, with the safety box."""
    reach, outside = state.goal.reach, tool_outside(state, state.goal.target.position)
    if outside is None or reach.tone == "bad":
        return reach.tone, reach.reason
    sentence = replace(outside, code="reach.outside")
    return "warn", sentence if reach.tone == "good" else message("joined", first=reach.reason, second=sentence)


def name_parts(parts: tuple[str, ...]) -> Message:
    """Returns names of parts as one message."""
    named = message(f"setup.part.{parts[0]}")
    for part in parts[1:]:
        named = message("setup.and", first=named, second=message(f"setup.part.{part}"))
    return named


def describe_part(setup: RobotConfiguration, part: str) -> Message:
    """Returns one part in a few numbers."""
    value = getattr(setup, part)
    if value is None:
        return message("setup.unset")
    if isinstance(value, SafetyBox):
        x, y, z = map(float, value.size)
        center = _floats(value.T_base_box.position)
        return message("setup.box_on" if value.active else "setup.box_off", x=x, y=y, z=z, center=center)
    if isinstance(value, Payload):
        center = _floats(value.center_of_mass)
        return message("setup.load_is" if value.mass else "setup.load_none", mass=f"{value.mass:.2f}", center=center)
    if isinstance(value, SoftJointLimits):
        return message("setup.joints_are", ranges=tuple(zip(value.lower, value.upper, strict=True)))
    if isinstance(value, ForceControlFrame):
        axes = next(name for name, kind in FORCE_AXES.items() if kind == value.type)
        place = _describe_pose(value.T_flange_force)
        return message("setup.force_is", pose=place, axes=message(f"setup.axes.{axes}"))
    return _describe_pose(value)


def describe_held(status: SupervisorStatus, part: str) -> Message:
    """Returns the controller's values as it reports them, or else as it acknowledged them."""
    if part == "tool" and status.T_flange_tool is not None:
        return _describe_pose(status.T_flange_tool)
    found = next((held for held in (status.reported, status.setup) if getattr(held, part) is not None), None)
    return message("setup.own") if found is None else describe_part(found, part)


def describe_watched(status: SupervisorStatus, part: str) -> Message:
    """Returns the value of a controller that is watched; it reports its force-control frame when a motion begins."""
    if part == "box" and status.setup.box is None:
        return message("setup.box_none")
    if part == "force" and status.setup.force is None:
        return message("setup.force_later")
    return describe_held(status, part)


def differing_tool(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns the tool that the controller reports, if it differs from the one of plans and checks."""
    held = status.T_flange_tool
    if held is None or status.phase != "idle":
        return None
    wanted = state.setup.wanted.tool
    assert wanted is not None
    away = float(np.abs(held.position - wanted.position).max())
    turned = float(np.abs(held.rotation - wanted.rotation).max())
    return _describe_pose(held) if away > _SAME_PLACE or turned > _SAME_TURN else None


def has_other_limits(state: UiState, status: SupervisorStatus) -> bool:
    """Returns whether the controller reports other limits of joints or tool than those of plans and checks."""
    if status.phase != "idle" or is_control_pending(state.drive.control, status.setup.control):
        return False
    limits, reported = state.model.limits, status.reported
    joint, joints, control = limits.joint, reported.joints, reported.control or {}
    pairs: list[tuple[tuple[float, ...] | None, ArrayLike]] = [
        (control.get("joint_velocity"), joint.velocity),
        (control.get("joint_acceleration"), joint.acceleration),
        (control.get("tool_limits"), tool_limits_of(limits)),
    ]
    if joints is not None:
        pairs += [(joints.lower, joint.lower), (joints.upper, joint.upper)]
    known = [
        (held, own) for held, own in pairs if held is not None and len(held) == np.size(own)
    ]  # Not of another arm.
    return any(not np.allclose(held, own, rtol=_SAME_LIMIT, atol=_SAME_ANGLE) for held, own in known)


def _describe_pose(pose: Pose) -> Message:
    place, turns = _floats(pose.position), _floats(pose.rpy)
    if not np.degrees(np.abs(turns).max()) >= 0.05:
        return message("setup.place", place=place)
    return message("setup.pose", place=place, turns=turns)


def _floats(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
