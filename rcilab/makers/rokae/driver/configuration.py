"""What is fixed to the arm, where its tool may be, and how it follows: the settings of the RCI that stay for a while.

Tool (`setCoor`), load (`setLoad`), safety box (`setCartesianLimit`), force-control frame (`setFcCoor`), soft joint
limits (`setJointLimit`), and the parameters of the modes (`ControllerParameters`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.makers.rokae.driver.controller_parameters import ControllerParameters, give_control
from rcilab.makers.rokae.wire import ForceFrame
from rcilab.model.dynamics.payload import Payload

if TYPE_CHECKING:
    from rcilab.makers.rokae.driver.settings import RciSettings
    from rcilab.model.robot_model import RobotModel

SetupPart: TypeAlias = Literal["box", "tool", "load", "force", "joints", "control"]

SETUP_PARTS: tuple[SetupPart, ...] = ("box", "tool", "load", "force")
"""The parts that have a place in space."""
_ALL_PARTS: tuple[SetupPart, ...] = (*SETUP_PARTS, "joints", "control")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ForceControlFrame:
    """The frame in which the controller reports forces, and in which it controls them."""

    T_flange_force: Pose = IDENTITY
    type: ForceFrame = ForceFrame.WORLD
    """What its axes follow."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SoftJointLimits:
    """Bounds of the joint angles inside the arm's own, n numbers each, [rad]."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RobotConfiguration:
    """A set-up, or a part of one: what is None is left as the controller has it."""

    box: SafetyBox | None = None
    tool: Pose | None = None
    """Pose of the tool in the flange frame."""
    load: Payload | None = None
    force: ForceControlFrame | None = None
    joints: SoftJointLimits | None = None
    control: ControllerParameters | None = None
    """Parameters of the modes."""

    @property
    def parts(self) -> tuple[SetupPart, ...]:
        """Names of what is not None."""
        return tuple(part for part in _ALL_PARTS if getattr(self, part) is not None)

    def only(self, parts: Iterable[str]) -> RobotConfiguration:
        """Returns a set-up of these parts alone."""
        return RobotConfiguration(**{part: getattr(self, part) for part in _ALL_PARTS if part in parts})

    def without(self, parts: Iterable[str]) -> RobotConfiguration:
        """Returns a set-up that leaves these parts alone."""
        return self.only(set(_ALL_PARTS) - set(parts))

    def updated(self, newer: RobotConfiguration) -> RobotConfiguration:
        """Returns this set-up with the parts of a newer one in it."""
        return replace(self, **{part: getattr(newer, part) for part in newer.parts})

    def applied_to(self, model: RobotModel) -> RobotModel:
        """Returns the arm with this tool, this load and these soft limits.

        Raises:
            InvalidValueError: The load is heavier than the arm is rated for.
        """
        changed = model if self.tool is None else model.with_tool(self.tool)
        changed = changed if self.load is None else changed.with_load(self.load)
        return changed if self.joints is None else changed.with_joint_limits(self.joints.lower, self.joints.upper)


def require_setup(setup: object) -> RobotConfiguration:
    """Returns `setup` if it is one.

    Raises:
        InvalidValueError: It is something else.
    """
    if isinstance(setup, RobotConfiguration):
        return setup
    raise InvalidValueError("setup", setup, "is no RobotConfiguration; RobotConfiguration(tool=..., box=...) makes one")


def give_setup(settings: RciSettings, setup: RobotConfiguration) -> None:
    """Tells a controller; nothing may move meanwhile. A refusal leaves the parts before it in force.

    Args:
        settings: The commands of a connection, or a session.
        setup: What to tell.

    Raises:
        CommandRejectedError: The controller refused a part; the error names it.
    """
    if setup.tool is not None:
        settings.set_coor(setup.tool)
    if setup.load is not None:
        settings.set_load(setup.load.mass, setup.load.center_of_mass, setup.load.inertia)
    if setup.box is not None:
        settings.set_cartesian_limit(setup.box)
    if setup.force is not None:
        settings.set_fc_coor(setup.force.T_flange_force, setup.force.type)
    if setup.joints is not None:
        settings.set_joint_limit(setup.joints.lower, setup.joints.upper)
    if setup.control is not None:
        give_control(settings, setup.control)
