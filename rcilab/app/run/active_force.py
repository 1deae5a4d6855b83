"""Forces on the arm from the page: the settings, the current push, the spring between arm and mouse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.arrays import JointVector, Vector3
from rcilab.i18n.translator import Message, message

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.makers.driver import GuideKind, GuideSpace
    from rcilab.model.robot_model import RobotModel

STRONGEST = 60.0  # [N] About what one hand exerts without effort.
SPRING = 200.0  # [N/m] between the grabbed point and the mouse: a pull of 0.3 m gives the largest force.
TOOL = 0  # The tool, in the place of a link's number.
GUIDING_KINDS: Mapping[str, tuple[GuideSpace, GuideKind]] = MappingProxyType(
    {
        "joint.free": ("joint", "free"),
        "cartesian.free": ("cartesian", "free"),
        "cartesian.translation": ("cartesian", "translation"),
        "cartesian.rotation": ("cartesian", "rotation"),
    }
)
DIRECTIONS = MappingProxyType(
    {
        "+x": (1.0, 0.0, 0.0),
        "-x": (-1.0, 0.0, 0.0),
        "+y": (0.0, 1.0, 0.0),
        "-y": (0.0, -1.0, 0.0),
        "+z": (0.0, 0.0, 1.0),
        "-z": (0.0, 0.0, -1.0),
    }
)
"""Unit vectors, base axes."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ActiveForce:
    """The force on the arm now."""

    link: int
    """From 1; `TOOL`: the tool."""
    start: Vector3
    """Point of application, base axes, shape (3,), [m]."""
    force: Vector3
    """Base axes, shape (3,), [N]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PushState:
    """Settings of pushes and hand guiding."""

    link: int = TOOL
    direction: str = "+y"
    newtons: float = 20.0
    grab: bool = True
    """Whether the mouse can grab the arm in the scene."""
    guiding_kind: str = "joint.free"
    """Key of `GUIDING_KINDS`."""
    acting: ActiveForce | None = None

    @property
    def force(self) -> Vector3:
        """The force of the button, base axes, shape (3,), [N]."""
        return self.newtons * np.array(DIRECTIONS[self.direction])


def spring_force(grabbed: Vector3, hand: Vector3) -> Vector3:
    """Returns the force of the spring between a point of the arm and the mouse, up to `STRONGEST`, shape (3,), [N]."""
    force = SPRING * (hand - grabbed)
    size = float(np.linalg.norm(force))
    return force if size <= STRONGEST else force * (STRONGEST / size)


def place_of(model: RobotModel, q: JointVector, link: int, point: Vector3) -> Vector3:
    """Returns the position of a point of a link in base, shape (3,), [m].

    Args:
        model: The arm.
        q: Joint angles, shape (n,), [rad].
        link: Number of the link, from 1; `TOOL`: the tool.
        point: In the frame of the link or the tool, shape (3,), [m].
    """
    T = model.forward(q) if link == TOOL else model.rigid_body.link_pose(q, link)
    return T.rotation @ point + T.position


def no_push(status: SupervisorStatus) -> Message | None:
    """Returns why this page cannot push the arm, or None if it can."""
    if status.world_address is not None:
        return None
    if status.target == "virtual":
        return message("ready.starting")
    return message("push.no_world", address=status.target)


def is_guided(status: SupervisorStatus) -> bool:
    """Returns whether the arm can be guided by hand."""
    return status.code == "moving.guided"


def gives_way(status: SupervisorStatus) -> bool:
    """Returns whether forces move the arm: hand guiding, or a motion with torques or impedance."""
    is_soft = status.mode in ("joint_impedance", "cartesian_impedance", "torque")
    return is_guided(status) or (status.code in ("moving", "moving.held") and is_soft)


def can_grab(state: UiState, status: SupervisorStatus) -> bool:
    """Returns whether a drag on the arm pulls it; otherwise it turns the camera."""
    return state.push.grab and status.world_address is not None and (state.plant == "mujoco" or gives_way(status))
