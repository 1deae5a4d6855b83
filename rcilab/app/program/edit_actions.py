"""Requests that edit the program: its list, a step of it, its name. Owned by the dispatcher's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.program.new_steps import new_steps
from rcilab.app.program.program_draft import MOST_ROUNDS, TYPES, Draft, placed, target_in_base, target_of, time_at
from rcilab.app.program.program_history import ProgramHistory
from rcilab.app.program.selection_actions import SelectionActions
from rcilab.app.program.waypoint_fields import arm_angle_of, as_pose, default_via, proposed
from rcilab.app.request import Handlers, Request, TypeField
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import Message, message
from rcilab.motion.waypoint import Waypoint
from rcilab.motion.waypoint_types import ALLOWED, CHOICES

LONGEST_NAME = 80
COMMON = ("speed", "blend", "dwell", "approach", "timeout")
"""Fields that are typed for all selected steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EditProgram(Request):
    """Change the program of the Program tab, or its selection."""

    what: Literal[
        "select", "add", "teach", "via", "type", "frame", "delete", "duplicate", "up", "down", "move", "start", "aim",
        "undo", "redo", "clear", "script", "tool", "insert", "choose", "toggle", "extend", "all", "copy", "cut",
        "paste",
    ]  # fmt: skip
    key: int | None = None
    """Key of a step; None is the selected one."""
    source: Literal["here", "target"] = "here"
    """Source of a waypoint, or its via point: the arm, or the goal."""
    type: str = ""
    frame: str | None = None
    """Name of a frame of the cell; None is base."""
    name: str = ""
    """Name of a field of a step that has a fixed set of values."""
    value: str = ""
    """Its value; "on" or "off" for a level."""
    index: int = 0
    """New index of a step, from 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowRows(Request):
    """The list was scrolled to rows that it did not have."""

    is_silent: ClassVar[bool] = True

    index: int
    """Index of the row in the middle, from 0."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"ShowRows.{self.page}"


class EditActions:
    """Edits, each of which can be undone.

    Args:
        store: The state.
        connection: The robot; it reports the arm's position.
        goal: Set to a step's target, or the source of a step.
        history: The programs.
    """

    def __init__(self, store: Store, connection: PageConnection, goal: GoalActions, history: ProgramHistory) -> None:
        self._store, self._connection, self._goal, self._history = store, connection, goal, history
        self.selection = SelectionActions(store, history)
        self._edits: dict[str, Callable[[EditProgram, int], None]] = {
            "select": self._select, "teach": self._teach, "via": self._via, "type": self._retype,
            "frame": self._reframe, "aim": self._aim, "move": self._move_to, "choose": self._choose,
        }  # fmt: skip

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            EditProgram: self.edit,
            ShowRows: self.show_rows,
        }

    def edit(self, request: EditProgram) -> None:
        """Changes the program, or its selection; what is not possible now is reported."""
        self._history.open()
        whole = {
            "add": lambda: self._add(request), "start": self._start_here, "insert": lambda: self._insert(request),
            "undo": self._history.undo, "redo": self._history.redo,
            "clear": lambda: self._history.change(Draft(model=self._draft.model), None),
            "tool": self._take_setup,
            "script": lambda: self._history.set(is_script_shown=not self._history.state.is_script_shown),
        }  # fmt: skip
        if request.what in whole:
            whole[request.what]()
            return
        if request.what in self.selection.edits:
            self._edit_selection(request)
            return
        key = self._history.state.selected if request.key is None else request.key
        if key is None or self._draft.index(key) is None:
            self._store.notify("warn", message("program.select"))
            return
        self._edits[request.what](request, key)

    def show_rows(self, request: ShowRows) -> None:
        """Shows other rows of a long program."""
        self._history.set(scrolled=min(max(request.index, 0), max(len(self._draft.steps) - 1, 0)))

    def type_field(self, request: TypeField) -> None:
        """Takes a typed value of a step, the rounds or the name, or shows the problem next to its field."""
        self._history.open()
        _, key, name = (*request.field.split("."), "", "")[:3]
        waypoint = self._draft.waypoint(int(key)) if key.isdecimal() else None
        if name == "name":
            self._rename(request)
        elif name == "rounds":
            parsed = parse_number(request.text, 1, MOST_ROUNDS, "")
            if parsed.value is not None and parsed.value != round(parsed.value):
                self._history.answer(request.field, message("program.whole", typed=request.text[:40]))
            elif self._history.answer(request.field, parsed.problem) and parsed.value is not None:
                self._history.interrupt()
                self._history.set(rounds=int(parsed.value), planned=None, answer=None)
        elif name == "find":
            is_found = not request.text.strip() or self.selection.find(request.text)
            self._history.answer(
                request.field, None if is_found else message("program.not_found", typed=request.text[:40])
            )
        elif waypoint is not None and name in COMMON and int(key) == self._history.state.selected:
            self._type_common(request, name)
        elif waypoint is not None:
            made = proposed(waypoint, name, request.text, self._draft.arm(self._store.state.model))
            if made is not None and self._history.answer(request.field, made if isinstance(made, Message) else None):
                assert isinstance(made, Waypoint)
                if made == waypoint:  # Its plan stays valid.
                    return
                self._history.change(self._draft.changed(int(key), made), int(key), typed=True)

    def _type_common(self, request: TypeField, name: str) -> None:
        """Takes a typed value for all selected steps that have this field."""
        draft, arm = self._draft, self._draft.arm(self._store.state.model)
        for key in self.selection.keys:
            waypoint = draft.waypoint(key)
            assert waypoint is not None
            if name not in ALLOWED[waypoint.type]:
                continue
            made = proposed(waypoint, name, request.text, arm)
            if isinstance(made, Message):
                self._history.answer(request.field, made)
                return
            if made is not None and made != waypoint:
                draft = draft.changed(key, made)
        self._history.answer(request.field, None)
        if draft is not self._draft:
            marked = self._history.state.marked
            self._history.change(draft, self._history.state.selected, typed=True)
            self._history.set(marked=marked)

    @property
    def _draft(self) -> Draft:
        return self._history.draft

    @property
    def _frames(self) -> dict[str, Pose]:
        """Pose in base of each frame of the cell."""
        cell = self._store.state.cell.cell
        return {} if cell is None else cell.frame_poses

    def _in_base(self, key: int) -> Waypoint | None:
        """Returns the waypoint of a step in base; reports why that is not possible."""
        waypoint, frames = self._draft.waypoint(key), self._frames
        if waypoint is None or waypoint.frame is None:
            return waypoint
        if waypoint.frame not in frames:
            self._store.notify("warn", message("program.frame_missing", frame=waypoint.frame))
            return None
        try:
            return waypoint.in_base(frames[waypoint.frame])
        except InvalidValueError as error:
            self._store.notify("warn", explain_error(error))
            return None

    def _change_in_base(self, key: int, waypoint: Waypoint, frame: str | None) -> None:
        """Replaces a waypoint by one that is in base, and expresses it in a frame."""
        if frame is not None:
            try:
                arm = self._draft.arm(self._store.state.model)
                waypoint = as_pose(waypoint, arm).in_frame(self._frames[frame], frame)
            except InvalidValueError as error:
                self._store.notify("warn", explain_error(error))
                return
        self._history.change(self._draft.changed(key, waypoint), key)

    def _reframe(self, request: EditProgram, key: int) -> None:
        """Expresses a waypoint in another frame; one whose frame is missing keeps its numbers."""
        waypoint, frames = self._draft.waypoint(key), self._frames
        if waypoint is None or request.frame == waypoint.frame or request.frame not in (None, *frames):
            return
        if waypoint.frame is not None and waypoint.frame not in frames:
            self._history.change(self._draft.changed(key, replace(waypoint, frame=request.frame)), key)
        elif (in_base := self._in_base(key)) is not None:
            self._change_in_base(key, in_base, request.frame)

    def _take_setup(self) -> None:
        """Makes the program one for tool, load and safety box of the page."""
        draft = replace(self._draft, tool=None, payload=None, box=None)
        self._history.change(draft, self._history.state.selected)

    def _rename(self, request: TypeField) -> None:
        name = request.text.strip()
        good = name.isprintable() and len(name) <= LONGEST_NAME
        if self._history.answer(request.field, None if good else message("program.name_bad", most=LONGEST_NAME)):
            self._history.rename(name)

    def _configuration(self, source: str) -> JointVector | None:
        """Returns the joint angles of the arm or of the goal; reports why they are unknown."""
        state, here = self._store.state, self._connection.status().q_c
        if source == "target":
            if state.goal.reach.missed_by is not None:
                self._store.notify("warn", message("program.short", short=state.goal.reach.missed_by))
            return state.goal.q
        if here is None:
            self._store.notify("warn", message("plan.no_arm"))
        return here

    def _add(self, request: EditProgram) -> None:
        q = self._configuration(request.source)
        if q is None:
            return
        draft, chosen = self._draft, self._draft.waypoint(self._history.state.selected)
        if draft.start is None:
            here = self._connection.status().q_c
            draft = replace(draft, start=tuple((q if here is None else here).tolist()))
        waypoint = Waypoint(type="joint", q=tuple(q.tolist()))
        if chosen is not None and not chosen.is_instruction:
            waypoint = replace(waypoint, speed=chosen.speed, blend=chosen.blend)
            waypoint = replace(waypoint, type="line" if chosen.type not in ("joint", "free") else "joint")
        self._history.change(*draft.inserted(waypoint, self._history.state.selected))

    def _insert(self, request: EditProgram) -> None:
        """Inserts a step after the selected one, or a block around it."""
        draft, selected = self._draft, self._history.state.selected
        if draft.start is None:
            q = self._configuration("here")
            if q is None:
                return
            draft = replace(draft, start=tuple(q.tolist()))
        T, psi = self._place_before(draft, selected)
        made = new_steps(request.type, T, psi, self._store.state.cell.cell)
        if len(made) == 1:
            self._history.change(*draft.inserted(made[0], selected))
        elif len(made) == 2:
            begin, end = made
            keys = self.selection.keys or (None,)
            self._history.change(*draft.wrapped(begin, end, keys[0], keys[-1]))

    def _place_before(self, draft: Draft, key: int | None) -> tuple[Pose, float | None]:
        """Returns pose and arm angle at the last step with a target up to a step, or at the start."""
        arm = draft.arm(self._store.state.model)
        in_base = placed(draft, self._store.state.cell.cell)
        index = in_base.index(key)
        for step in reversed(in_base.steps[: len(in_base.steps) if index is None else index + 1]):
            target = target_in_base(step.waypoint, arm)
            if target is not None:
                return target, arm_angle_of(step.waypoint, arm) or (0.0 if arm.redundancy else None)
        assert draft.start is not None  # It has just been set.
        start = Waypoint(type="joint", q=draft.start)
        return arm.forward(draft.start), arm_angle_of(start, arm)

    def _choose(self, request: EditProgram, key: int) -> None:
        """Sets a field that has a fixed set of values."""
        waypoint = self._draft.waypoint(key)
        if waypoint is None or request.name not in ALLOWED[waypoint.type] or request.name not in ("level", *CHOICES):
            return
        value = request.value == "on" if request.name == "level" else request.value
        try:
            changed = replace(waypoint, **{request.name: value})
        except InvalidValueError as error:
            self._store.notify("warn", explain_error(error))
            return
        if changed != waypoint:
            self._history.change(self._draft.changed(key, changed), key)

    def _start_here(self) -> None:
        q = self._configuration("here")
        if q is not None and self._draft.steps:
            self._history.change(replace(self._draft, start=tuple(q.tolist())), self._history.state.selected)

    def _select(self, request: EditProgram, key: int) -> None:
        """Selects a step; if the plan is that of the program, the preview moves there."""
        if key != self._history.state.selected:
            self._store.clear_problems("program.")
        self._history.set(selected=key, marked=frozenset(), scrolled=None)
        state, index = self._store.state, self._draft.index(key)
        plan = state.plan
        if plan is None or plan.program is None or index is None or self._history.state.planned is not self._draft:
            return
        if index < len(plan.program.waypoints):
            self._store.update(playhead=time_at(plan, index + 1) / max(plan.motion.duration, 1e-3), playing=False)

    def _teach(self, request: EditProgram, key: int) -> None:
        q, waypoint = self._configuration(request.source), self._draft.waypoint(key)
        if q is None or waypoint is None:
            return
        if waypoint.type not in TYPES:
            self._store.notify("warn", message("program.no_target"))
            return
        in_base = self._in_base(key)
        if in_base is not None:
            taught = replace(in_base, q=tuple(q.tolist()), position=None, wxyz=None, psi=None)
            self._change_in_base(key, taught, waypoint.frame)

    def _via(self, request: EditProgram, key: int) -> None:
        q, waypoint = self._configuration(request.source), self._draft.waypoint(key)
        if q is None or waypoint is None or waypoint.type != "arc":
            return
        pose = self._draft.arm(self._store.state.model).forward(q)
        in_base = self._in_base(key)
        if in_base is not None:
            via = replace(in_base, via=tuple(pose.position.tolist()), via_wxyz=tuple(pose.wxyz.tolist()))
            self._change_in_base(key, via, waypoint.frame)

    def _retype(self, request: EditProgram, key: int) -> None:
        waypoint = self._draft.waypoint(key)
        if waypoint is None or request.type == waypoint.type or request.type not in TYPES:
            return
        if request.type == "free" and not self._draft_has_cell():
            self._store.notify("warn", message("program.free_cell"))
            return
        if waypoint.type not in TYPES:
            self._store.notify("warn", message("program.no_target"))
            return
        in_base, via = self._in_base(key), None
        if in_base is None:
            return
        if request.type == "arc":
            draft = placed(self._draft, self._store.state.cell.cell)
            via = default_via(draft, key, draft.arm(self._store.state.model))
            if via is None:
                self._store.notify("warn", message("program.no_way"))
                return
            self._store.notify("good", message("program.via_made"))
        self._change_in_base(key, in_base.retyped(request.type, via), waypoint.frame)

    def _draft_has_cell(self) -> bool:
        return self._store.state.cell.cell is not None

    def _edit_selection(self, request: EditProgram) -> None:
        """Edits the selected steps; one that is named and not among them becomes the selection."""
        needs = request.what in ("delete", "duplicate", "up", "down", "copy", "cut")
        if needs and request.key is not None and request.key not in self.selection.keys:
            self._history.set(selected=request.key, marked=frozenset())
        if needs and not self.selection.keys:
            self._store.notify("warn", message("program.select"))
            return
        self.selection.edits[request.what](request)

    def _move_to(self, request: EditProgram, key: int) -> None:
        if self._draft.index(key) != request.index:
            self._history.change(self._draft.moved(key, request.index), key)

    def _aim(self, request: EditProgram, key: int) -> None:
        waypoint = self._in_base(key)
        if waypoint is None:
            return
        model = self._store.state.model
        arm = self._draft.arm(model)
        target = target_of(waypoint, arm)
        if target is None:
            self._store.notify("warn", message("program.no_target"))
            return
        if arm is not model:
            target = target @ arm.T_flange_tool.inverse() @ model.T_flange_tool
        self._goal.set_waypoint_target(target, waypoint.psi, None if waypoint.q is None else readonly_copy(waypoint.q))
