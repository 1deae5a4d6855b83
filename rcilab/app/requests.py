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
class Moving(Request):
    """Something that may set the robot in motion. A stop that comes before it has done so undoes it."""

    stops: int | None = None
    """How many stops the robot side had heard of when the page asked; None: as many as when it is carried out."""


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

    name: Literal["zero", "home", "here", "start", "undo"]
    """"start" is where the plan begins, or its program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetJog(Request):
    """How to jog; what is None stays."""

    robot: bool | None = None
    """Whether the buttons move the robot, not the goal."""
    agreed: bool = False
    """Whether this is the second yes for a foreign robot."""
    step: float | None = None
    """[mm, deg]; 0: as long as a button is held."""
    frame: str | None = None
    speed: float | None = None
    """Share of the fastest jog, 0 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JogButton(Moving):
    """One of the buttons of the Jog tab."""

    axis: str
    """"joint.0" ... "joint.6", or "x", "y", "z", "roll", "pitch", "yaw"."""
    sign: int
    """1 or -1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldJog(JogButton):
    """It is held; said ten times a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PressJog(JogButton):
    """It was pressed and released."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedPose(Request):
    """Something with a stored pose."""

    what: Literal["store", "recall", "delete", "choose"]
    name: str


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
    """joint.0 ..., pose.x ..., psi, speed, program.KEY.speed ..., setup.PART.NAME (see `setup.fields`)."""
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
class DragElbow(Request):
    """The handle on the elbow's circle was dragged."""

    eye: tuple[float, ...]
    """Where the page's camera is, base axes, [m]."""
    hand: tuple[float, ...]
    """A point under the mouse, base axes, [m]."""
    phase: Literal["start", "update", "end"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CommitField(Request):
    """Enter was pressed in a field that was typed in, or the field was left: what is typed is complete."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawInSoftware(Request):
    """The browser has no graphics card to draw with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenTab(Request):
    """Another tab was opened."""

    name: str
    """Key of its label, such as "tab.setup"; "" for one that does not exist."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HighlightBranch(Request):
    """A branch of the list is under the mouse or has the focus."""

    index: int | None
    """From 0, in the order of the list; None when it is left."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPathType(Request):
    """How the tool is to go to the goal; what is None stays."""

    kind: str | None = None
    """"joint", "line" or "arc"."""
    via: bool = False
    """Whether the arc shall lead over where the target is now."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan(Request):
    """Plan from where the arm is to the goal, and check it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRecovery(Request):
    """Plan from where the arm is, outside a joint's range, back inside."""


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
class RobotCommand(Moving):
    """Something for the robot: what the buttons of the Run tab say."""

    what: Literal[
        "execute", "confirm", "cancel", "stop", "recover", "power_on", "power_off", "reconnect", "guide", "unguide",
        "pause", "resume", "disconnect",
    ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class SetDrive(Request):
    """How to drive the arm; what is None stays."""

    mode: str | None = None
    """One of `rcilab.core.state.MODES`."""
    pace: float | None = None
    """Part of the planned speed, 0.1 to 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PressControl(Request):
    """A button of the modes' parameters."""

    what: Literal["send", "reset"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetNetwork(Request):
    """The network of our own controller; what is None stays."""

    name: str | None = None
    """One of `NETWORK_LAB`."""
    value: float = 0.0
    """[1] or [s]."""
    direction: str | None = None
    pulled: bool | None = None
    """Whether the cable is out."""
    clear: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSafety(Request):
    """A safety button of our own controller."""

    button: Literal["none", "estop", "gstop"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOutput(Request):
    """A digital output, 0 to 5, on or off."""

    signal: int
    level: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSignals(Request):
    """Reads the digital inputs; or restarts the controller, once that is confirmed."""

    what: Literal["read", "reboot", "confirm", "cancel"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetWiring(Request):
    """Has our own controller's outputs wired to its inputs, or commands led to rest inside the soft limits."""

    name: Literal["loop_back", "auto_limit"]
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseDestination(Request):
    """Where motions go; an address is asked for once more."""

    where: str
    """One of `DESTINATIONS`."""
    address: str = ""
    answer: Literal["", "yes", "no"] = ""


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
class DragLink(Request):
    """The mouse drags a link of the arm."""

    link: int
    """From 1."""
    grabbed: tuple[float, ...]
    """Where it was taken hold of, base axes, [m]."""
    hand: tuple[float, ...]
    """Where the mouse is, base axes, [m]."""
    phase: Literal["start", "update", "end"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveSetup(Request):
    """The handles of a part of the set-up were moved."""

    part: Literal["box", "tool", "load", "force"]
    position: tuple[float, ...]
    """Of the box in base; of the others in the flange frame, [m]."""
    wxyz: tuple[float, ...]
    ended: bool = False
    """Whether the mouse was released."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResizeBox(Request):
    """A handle on a face of the safety box was dragged."""

    face: int
    """0 to 2: the low faces along x, y, z of the box; 3 to 5: the high ones."""
    hand: tuple[float, ...]
    """Where the mouse is, base axes, [m]."""
    ended: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSetup(Request):
    """A switch of the set-up."""

    name: Literal["edited", "box", "tool", "load", "force", "active", "axes"]
    """What has handles; whether a part is drawn; whether the box bounds; what the force-control frame follows."""
    value: str | bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSetup(Request):
    """A button of the set-up."""

    what: Literal["whole", "undo", "send", "confirm", "cancel"]


@dataclass(frozen=True, slots=True, kw_only=True)
class EditProgram(Request):
    """Change the program of the Program tab, or what of it is selected."""

    what: Literal[
        "select", "add", "teach", "via", "type", "delete", "duplicate", "up", "down", "move", "start", "aim", "undo",
        "redo", "clear", "script", "tool",
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
class Check(Request):
    """Something for the Check tab."""

    what: Literal["row", "slow", "undo", "explain", "again", "cancel"]
    row: str = ""
    """Id of a condition."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Learn(Request):
    """Something for the Learn tab."""

    what: Literal["provoke", "cancel", "close", "moment", "script", "lesson", "skip", "leave"]
    fault: int = -1
    """Number of a fault."""
    name: str = ""
    """Of a lesson."""


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

    name: Literal["language", "angle", "length", "theme", "quality", "plot_joint", "rate", "height", "loop"]
    value: str | float | int


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowPlot(Request):
    """Show or hide one of the plots."""

    name: str
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowViolation(Request):
    """Go to a violation on the path and say what it is."""

    number: int
    """From 0, worst first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowExtra(Request):
    """Show or hide one of the things that the scene has switches for."""

    name: str
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Export(Request):
    """The last run as a file, through the browser."""

    ending: str
    """.csv, .parquet, .mcap, .html or .rcirun."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelExport(Request):
    """Drop the export that is under way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetRecording(Request):
    """Whether every cycle of a motion is written to a file."""

    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearRuns(Request):
    """Delete recorded runs but for the newest ones."""

    what: Literal["choose", "ask", "confirm", "cancel"]
    keep: int
    """How many stay."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeControls(Request):
    """This page wants the controls."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Refuse(Request):
    """A page without the controls has tried to use one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerControls(Request):
    """The page that holds the controls was asked for them."""

    yes: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PageOpened(Request):
    """A page has opened."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PageClosed(Request):
    """A page has gone."""


Harmless: TypeAlias = PageOpened | PageClosed | Refuse | TakeControls | AnswerControls | CommitField
"""What a watching page may ask for as well: nothing of it changes what other pages show."""

Silent: TypeAlias = OpenTab | DrawInSoftware | HighlightBranch
"""What a watching page does without pressing anything: it is not told that this does not count."""
