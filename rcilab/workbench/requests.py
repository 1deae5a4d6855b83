"""What a page can ask for. Frozen values: callbacks put them in the mailbox and return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Anything a page asks for."""

    page: int | None = None
    """Client id of the page; None for our own doing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveJoint(Request):
    """Pose one joint of the goal."""

    joint: int
    """From 0."""
    angle: float
    """[rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseGoal(Request):
    """Pose the goal in a named way."""

    name: Literal["zero", "home", "here", "undo"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveTarget(Request):
    """The gizmo was moved."""

    position: tuple[float, ...]
    """[m]."""
    wxyz: tuple[float, ...]
    ended: bool = False
    """Whether the mouse was released."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeField(Request):
    """A number field holds this text now."""

    field: str
    """joint.0 ... joint.6, pose.x ... pose.yaw, psi; program.KEY.speed and so on."""
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SetArmAngle(Request):
    """Turn the elbow of a 7-axis arm."""

    psi: float
    """[rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseBranch(Request):
    """Take another analytic solution for the same pose."""

    index: int
    """From 0, in the order of the list."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan(Request):
    """Plan from where the arm is to the goal, and check it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSpeed(Request):
    """Share of the velocity and acceleration limits to plan with."""

    speed: float
    """0 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetLaw(Request):
    """Which planner."""

    law: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive(Request):
    """Something for the robot: what the buttons of the Run tab say."""

    what: Literal[
        "execute", "confirm", "cancel", "stop", "recover", "power_on", "power_off", "reconnect", "guide", "unguide"
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseRobot(Request):
    """Another arm, another destination, or another plant for the virtual controller."""

    model: str | None = None
    target: str | None = None
    plant: str | None = None
    """"ideal" or "mujoco"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPush(Request):
    """How to push the arm and how to guide it; what is None stays."""

    link: int | None = None
    """From 1; 0: the tool."""
    direction: str | None = None
    newtons: float | None = None
    grab: bool | None = None
    way: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldPush(Request):
    """The push button is held; said ten times a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PullArm(Request):
    """The mouse drags a link of the arm."""

    link: int
    """From 1."""
    grabbed: tuple[float, ...]
    """Where it was taken hold of, base axes, [m]."""
    hand: tuple[float, ...]
    """Where the mouse is, base axes, [m]."""
    phase: Literal["start", "update", "end"]


@dataclass(frozen=True, slots=True, kw_only=True)
class EditProgram(Request):
    """Change the program of the Program tab, or what of it is selected."""

    what: Literal[
        "select", "add", "teach", "via", "type", "delete", "duplicate", "up", "down", "move", "start", "aim", "undo",
        "redo", "clear", "script",
    ]  # fmt: skip
    key: int | None = None
    """Key of a step; None is the selected one."""
    source: Literal["here", "target"] = "here"
    """Where a waypoint, or its via, comes from: the arm, or the goal."""
    type: str = ""
    place: int = 0
    """Where to move a step, from 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanProgram(Request):
    """Plan the program and check it."""

    upto: bool = False
    """Only to the selected waypoint."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelProgram(Request):
    """Drop the planning that is under way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadProgram(Request):
    """A file was chosen in the browser."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Seek(Request):
    """Go to a place in the planned motion."""

    place: float
    """0 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Play(Request):
    """Start or hold the preview."""

    playing: bool | None = None
    """None turns it over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetView(Request):
    """Settings of the page."""

    name: Literal["language", "quality", "plot_joint", "rate", "height", "loop"]
    value: str | float | int


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeControls(Request):
    """This page wants the controls."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PageCame(Request):
    """A page has opened."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PageWent(Request):
    """A page has gone."""


Harmless: TypeAlias = PageCame | PageWent | TakeControls | Seek | Play | SetView
"""What a watching page may ask for as well: nothing of it moves a goal or a robot."""
