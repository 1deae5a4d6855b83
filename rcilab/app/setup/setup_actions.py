"""Requests that edit the configuration: accept, send, undo. Owned by the dispatcher's thread."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias, cast

import numpy as np

from rcilab.app.arm_features import explain_missing_part
from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal import Goal, evaluate_joints, evaluate_pose, reevaluated
from rcilab.app.planning import Plan, tool_path
from rcilab.app.request import Handlers, Request, TypeField
from rcilab.app.setup.configuration_sender import ConfigurationSender
from rcilab.app.setup.configuration_state import (
    FORCE_AXES,
    LISTED,
    SetupState,
    drawn_parts,
    name_parts,
    own_limits,
    pending_parts,
    soft_limits,
)
from rcilab.app.setup.setup_fields import (
    FARTHEST_FACE,
    FIELD_NAMES,
    INERTIA_NAMES,
    JOINT_ENDS,
    THINNEST,
    box_between,
    exact_end,
    faces,
    field_names,
    field_range,
    joint_limits_between,
    with_field,
    with_inertia,
    with_pose,
)
from rcilab.app.state_store import UNDO_DEPTH
from rcilab.app.store import Store, UiState
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import SETUP_PARTS, RobotConfiguration, SetupPart, SoftJointLimits
from rcilab.makers.maker import capabilities_of
from rcilab.model.dynamics.payload import Payload
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus

_SAME_TOOL = 1e-9  # [m], elements of a rotation.
_HAND_GONE = 1.0  # [s] A drag without an event for this time has ended, whether or not its page is open.


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenTab(Request):
    """Another tab was opened."""

    is_silent: ClassVar[bool] = True

    name: str
    """Key of its label, such as "tab.setup"; "" for one that does not exist."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveSetup(Request):
    """The handle of a part of the configuration was moved."""

    part: Literal["box", "tool", "load", "force"]
    position: tuple[float, ...]
    """Position of the box in base; of the others in the flange frame, [m]."""
    wxyz: tuple[float, ...]
    ended: bool = False
    """Whether the mouse was released."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return None if self.ended else f"MoveSetup.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ResizeBox(Request):
    """A handle on a face of the safety box was dragged."""

    face: int
    """0 to 2: the low faces along x, y, z of the box; 3 to 5: the high ones."""
    hand: tuple[float, ...]
    """Position of the mouse, base axes, [m]."""
    ended: bool = False

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return None if self.ended else f"ResizeBox.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSetup(Request):
    """A switch of the configuration."""

    name: Literal["edited", "box", "tool", "load", "force", "active", "axes"]
    """The part with handles; whether a part is drawn; whether the box is on; the frame of force control."""
    value: str | bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSetup(Request):
    """A button of the configuration."""

    what: Literal["whole", "undo", "redo", "send", "confirm", "cancel"]


_Edited: TypeAlias = tuple[RobotConfiguration, frozenset[SetupPart]]
"""The configuration, and its edited parts."""


class SetupActions:
    """Handles in the scene, typed numbers, switches; each edit is sent to a virtual controller at once."""

    def __init__(self, store: Store, connection: PageConnection) -> None:
        self._store, self._connection = store, connection
        self._past: list[_Edited] = []
        self._future: list[_Edited] = []
        self._arm = store.state.model.name
        self._drag: tuple[int | None, str] | None = None  # The page that drags, and the part.
        self._dragged = -math.inf  # Time of the last drag event, [s].
        self._sender = ConfigurationSender(connection, self._refuse)
        self._reported_for: object = None  # The program of the last notice about another tool.
        self._is_back = False  # The configuration was restored and reported.
        self._announced = 0  # Number of connections at which an accepted configuration was reported.

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            OpenTab: self.open_tab,
            MoveSetup: self.move,
            ResizeBox: self.resize,
            SetSetup: self.set_setup,
            PressSetup: self.press,
        }

    def type_field(self, request: TypeField) -> None:
        """Takes a typed number, or shows the problem next to its field."""
        _, _, place = request.field.partition(".")
        part, _, name = place.partition(".")
        state = self._store.state
        missing = explain_missing_part(state.model, cast("SetupPart", part)) if part in LISTED else None
        if missing is not None:
            self._store.set_problem(request.field, missing)
            return
        if part == "joints":
            self._type_joint_limit(request, name)
            return
        capabilities = capabilities_of(state.model)
        if part not in FIELD_NAMES or name not in field_names(part, turns_box=capabilities.turns_box):
            return
        longest = capabilities.longest_tool
        bounds = field_range(part, name, state.model.description.rated_payload, longest)
        parsed = parse_number(request.text, bounds.low, bounds.high, bounds.unit)
        if parsed.value is None:
            assert parsed.problem is not None
            self._store.set_problem(request.field, parsed.problem)
            return
        changed = with_field(state.setup, part, name, parsed.value, longest)
        if isinstance(changed, SetupState) and name in INERTIA_NAMES:
            self._store.update(setup=changed)  # Typed moments stay, even if no body can have them.
            changed = with_inertia(changed)
        untaken = None
        if isinstance(changed, SetupState) and name == "mass":
            made = with_inertia(changed)
            changed, untaken = (changed, made) if isinstance(made, Message) else (made, None)
        if isinstance(changed, Message):
            self._store.set_problem(request.field, changed)
            return
        related = {name, *INERTIA_NAMES} if name in (*INERTIA_NAMES, "mass") else {name}
        self._store.clear_problems(*(f"setup.{part}.{other}" for other in related))
        self._edit(changed, cast("SetupPart", part))
        if untaken is not None:
            self._store.set_problem("setup.load.ixx", untaken)

    def _type_joint_limit(self, request: TypeField, name: str) -> None:
        end, _, number = name.partition(".")
        model = self._store.state.model
        if end not in JOINT_ENDS or number not in map(str, range(model.n)):
            return
        joint, own = int(number), describe_robot(model.name).limits.joint
        least, largest = np.degrees((own.lower[joint], own.upper[joint])).tolist()
        parsed = parse_number(request.text, least, largest, "deg")
        if parsed.value is None:
            assert parsed.problem is not None
            self._store.set_problem(request.field, parsed.problem)
            return
        now = soft_limits(self._store.state)
        bounds = {"lower": list(now.lower), "upper": list(now.upper)}
        bounds[end][joint] = exact_end(own, end, joint, math.radians(parsed.value))
        joints = joint_limits_between(**bounds)
        if isinstance(joints, Message):
            self._store.set_problem(request.field, joints)
            return
        self._store.clear_problems(*(f"setup.joints.{name}.{joint}" for name in JOINT_ENDS))
        self._limit_joints(joints)

    def _limit_joints(self, joints: SoftJointLimits) -> None:
        setup = self._store.state.setup
        if setup.wanted.joints is None:  # The state after an undo has to be sent, too.
            setup = replace(
                setup, wanted=setup.wanted.updated(RobotConfiguration(joints=own_limits(self._store.state)))
            )
            self._store.update(setup=setup)
        self._edit(replace(setup, wanted=setup.wanted.updated(RobotConfiguration(joints=joints))), "joints")

    def move(self, request: MoveSetup) -> None:
        """Moves a part with its handle."""
        numbers = (*request.position, *request.wxyz)
        if request.part != self._store.state.setup.edited or len(numbers) != 7 or not all(map(math.isfinite, numbers)):
            return  # A drag that ends after its edit, or of another part.
        if math.hypot(*request.wxyz) < 1e-6:
            return
        state = self._store.state
        capabilities = capabilities_of(state.model)
        is_straight = request.part == "box" and not capabilities.turns_box
        pose = Pose(request.position) if is_straight else Pose(request.position, request.wxyz)
        changed = with_pose(state.setup, request.part, pose, capabilities.longest_tool)
        if isinstance(changed, Message):
            self._store.notify("warn", changed)
        else:
            self._edit(changed, request.part, drag=(request.page, request.part))
            self._store.clear_problems(f"setup.{request.part}.")
        self._hear_drag(request.ended)

    def resize(self, request: ResizeBox) -> None:
        """Moves a face of the safety box with its handle; the other faces stay."""
        setup = self._store.state.setup
        box = setup.wanted.box
        if box is None or setup.edited != "box" or request.face not in range(6) or not np.isfinite(request.hand).all():
            return
        bounds = faces(box)
        axis, opposite = request.face % 3, (request.face + 3) % 6
        low, high = -FARTHEST_FACE, FARTHEST_FACE
        if request.face < 3:
            high = bounds[opposite] - THINNEST
        else:
            low = bounds[opposite] + THINNEST
        hand = box.T_base_box.rotation.T @ np.array(request.hand)
        bounds[request.face] = min(max(float(hand[axis]), low), high)
        wanted = setup.wanted.updated(RobotConfiguration(box=box_between(box, bounds)))
        self._edit(replace(setup, wanted=wanted), "box", drag=(request.page, "box"))
        self._hear_drag(request.ended)

    def set_setup(self, request: SetSetup) -> None:
        """Changes a switch; invalid values are ignored."""
        setup, value = self._store.state.setup, request.value
        box, force = setup.wanted.box, setup.wanted.force
        assert box is not None
        assert force is not None
        model = self._store.state.model
        if request.name == "edited" and value in ("", *SETUP_PARTS):
            shown = {part for part in SETUP_PARTS if part == value and explain_missing_part(model, part) is None}
            self._store.update(setup=replace(setup, edited=value, seen=setup.seen | shown))
        elif request.name in SETUP_PARTS and isinstance(value, bool):
            seen = setup.seen | {request.name} if value else setup.seen - {request.name}
            if explain_missing_part(model, request.name) is None:
                self._store.update(setup=replace(setup, seen=seen))
        elif request.name == "active" and isinstance(value, bool):
            switched = SafetyBox(size=box.size, T_base_box=box.T_base_box, active=value)
            self._edit(replace(setup, wanted=setup.wanted.updated(RobotConfiguration(box=switched))), "box")
        elif request.name == "axes" and value in FORCE_AXES:
            turned = replace(force, type=FORCE_AXES[str(value)])
            self._edit(replace(setup, wanted=setup.wanted.updated(RobotConfiguration(force=turned))), "force")

    def open_tab(self, request: OpenTab) -> None:
        """Ends the edit when its tab is left: only the open tab has handles in the scene."""
        setup = self._store.state.setup
        if request.name != "tab.setup" and setup.edited:
            self._store.update(setup=replace(setup, edited=""))

    def press(self, request: PressSetup) -> None:
        """Handles one of the buttons."""
        state = self._store.state
        setup = state.setup
        if request.what in ("undo", "redo"):
            self._turn_back("undo" if request.what == "undo" else "redo")
        elif request.what == "whole":
            self._store.clear_problems("setup.joints.")
            self._limit_joints(own_limits(self._store.state))
        elif request.what == "cancel":
            self._store.update(setup=replace(setup, asked=None))
        elif request.what == "send" and state.target != "virtual":
            self._store.update(setup=replace(setup, asked=setup.wanted, refusal=None))
        elif request.what == "send":
            self._store.update(setup=replace(setup, refusal=None))
        elif request.what == "confirm" and setup.asked is setup.wanted:
            self._store.update(setup=replace(setup, asked=None))
            self._send(self._connection.status())

    def mount(self, tool: Pose, load: Payload) -> None:
        """Sets tool and load, as one step for undo; what the arm cannot be given stays."""
        model, setup = self._store.state.model, self._store.state.setup
        wanted = RobotConfiguration(tool=tool, load=load)
        differing: dict[SetupPart, bool] = {
            "tool": not model.T_flange_tool.is_close(tool, _SAME_TOOL),
            "load": model.load != load,
        }
        parts: set[SetupPart] = {
            part for part, differs in differing.items() if differs and explain_missing_part(model, part) is None
        }
        if parts:
            self._push_undo(setup)
            wanted = setup.wanted.updated(wanted.only(parts))
            self._take(replace(setup, wanted=wanted, touched=setup.touched | parts, inertia=None), parts)

    def restore(self, setup: RobotConfiguration) -> None:
        """Restores and draws an edited configuration; a real robot gets it only after a question."""
        now = self._store.state.setup
        model = self._store.state.model
        parts: set[SetupPart] = {part for part in setup.parts if explain_missing_part(model, part) is None}
        if parts:
            self._is_back = True
            wanted, touched = now.wanted.updated(setup.only(parts)), now.touched | parts
            self._take(replace(now, wanted=wanted, touched=touched, seen=now.seen | drawn_parts(parts)), parts)

    def tick(self, status: SupervisorStatus) -> None:
        """Follows a request, and sends changes to a virtual controller."""
        name = self._store.state.model.name
        if name != self._arm:
            self._arm, self._past, self._future, self._announced = name, [], [], 0
            self._store.order.forget("setup", name)
            self._sender.forget()
        if self._sender.is_underway:
            self._sender.collect()
            status = self._connection.status()  # Values that were acknowledged meanwhile are not sent again.
        state = self._store.state
        announced, self._announced = self._announced, status.setup_times  # Another supervisor counts from 0.
        if self._announced > announced:
            if not self._is_back:
                self._store.notify("good", message("setup.sent_again", what=name_parts(status.setup.parts)))
            self._is_back = False
        is_held = time.monotonic() - self._dragged < _HAND_GONE
        if state.target == "virtual" and not is_held and state.setup.refusal is None and status.phase == "idle":
            self._send(status)

    def _send(self, status: SupervisorStatus) -> None:
        """Sends every part that the controller has not accepted yet."""
        state = self._store.state
        parts = pending_parts(state, status)
        if parts and not self._sender.is_underway:
            self._is_back = False
            self._sender.send(state.setup.wanted.only(parts))

    def _refuse(self, why: Message) -> None:
        self._store.update(setup=replace(self._store.state.setup, refusal=why))

    def _hear_drag(self, has_ended: bool) -> None:
        self._dragged = -math.inf if has_ended else time.monotonic()
        if has_ended:
            self._drag = None

    def _edit(self, changed: SetupState, part: SetupPart, *, drag: tuple[int | None, str] | None = None) -> None:
        """Applies an edit, unless the arm lacks the part or is only watched; a drag is one step for undo."""
        if self._store.state.watched:
            self._store.notify("warn", message("ready.watched", address=self._store.state.watched))
            return
        missing = explain_missing_part(self._store.state.model, part)
        if missing is not None:
            self._store.notify("warn", missing)
            return
        if drag is None or drag != self._drag:
            self._push_undo(self._store.state.setup)
        self._drag = drag
        self._take(replace(changed, touched=changed.touched | {part}), {part})

    def _push_undo(self, setup: SetupState) -> None:
        self._past, self._future = [*self._past[-UNDO_DEPTH:], (setup.wanted, setup.touched)], []
        self._store.order.add("setup", self._store.state.model.name)

    def _turn_back(self, what: Literal["undo", "redo"]) -> None:
        """Undoes the last edit, or repeats the one that was undone last."""
        setup, order, name = self._store.state.setup, self._store.order, self._store.state.model.name
        here, there = (self._past, self._future) if what == "undo" else (self._future, self._past)
        if not here:
            return
        there.append((setup.wanted, setup.touched))
        order.undone("setup", name) if what == "undo" else order.repeated("setup", name)
        before, touched = here.pop()
        touched |= frozenset(self._connection.status().setup.parts)  # Parts that were sent have to be reset there.
        if self._sender.is_underway:
            touched |= setup.touched
        if before.joints is None and "joints" in touched:  # The controller knows soft limits, but not their absence.
            before = before.updated(RobotConfiguration(joints=own_limits(self._store.state)))
        parts: set[SetupPart] = {p for p in LISTED if getattr(before, p) is not getattr(setup.wanted, p)}
        self._store.clear_problems(*(f"setup.{part}." for part in parts))
        self._take(replace(setup, wanted=before, touched=touched, inertia=None), parts)

    def _report_program(self, state: UiState) -> None:
        """Reports once, for a program with the tool of the page, the effect of another tool."""
        draft = state.program.draft
        is_here = draft.model == state.model.name and bool(draft.steps) and draft.tool is None
        if is_here and draft is not self._reported_for:
            self._reported_for = draft
            self._store.notify("warn", message("setup.program_moves"))

    def _take(self, setup: SetupState, parts: set[SetupPart]) -> None:
        """Replaces the configuration and what depends on it: tool, load, goal, path. The plan may become outdated."""
        state = self._store.state
        changes: dict[str, object] = {}
        if parts & {"tool", "load", "joints"}:
            changes["model"] = model = setup.wanted.only(parts).applied_to(state.model)
            if "tool" in parts:
                self._report_program(state)
                self._store.clear_undo()  # Its goals are those of another tool.
                target = model.forward(state.goal.q)
                reach = evaluate_joints(model, state.goal.q)
                if state.goal.reach.solutions is not None:
                    reach = replace(evaluate_pose(model, target, state.goal.q, state.goal.psi), q=state.goal.q)
                changes["goal"] = Goal(q=state.goal.q, target=target, reach=reach, psi=state.goal.psi)
                if isinstance(state.plan, Plan):
                    changes["plan"] = replace(state.plan, path=tool_path(model, state.plan.motion), missed_by=None)
            elif "joints" in parts:
                changes["goal"] = reevaluated(model, state.goal)
        changes["setup"] = replace(setup, asked=None, refusal=None, can_undo=bool(self._past))
        self._store.update(**changes)


def is_setup_field(field: str) -> bool:
    """Returns whether a field belongs to the configuration."""
    return field.startswith("setup.")
