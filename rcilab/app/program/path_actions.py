"""Requests that import a path as waypoints, or draw one in the scene. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from rcilab.app.connection import PageConnection
from rcilab.app.program.edit_actions import LONGEST_NAME
from rcilab.app.program.path_state import BLEND_FIELD, PATH_FIELD, frame_of_paths
from rcilab.app.program.program_draft import draft_of
from rcilab.app.program.program_history import ProgramHistory
from rcilab.app.request import Handlers, Request, TypeField
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.cell.ray_cast import cast_ray
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import message
from rcilab.motion.path_import import read_path
from rcilab.motion.program import Program
from rcilab.motion.waypoint import Waypoint, require_count
from rcilab.motion.waypoint_types import LARGEST_BLEND


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportPath(Request):
    """A file with a path was chosen in the browser."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPath(Request):
    """Whether an imported path is added to the program, or replaces it."""

    appends: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawPath(Request):
    """A path is drawn by clicks in the scene."""

    what: Literal["toggle", "point", "end", "cancel"]
    """toggle starts, or ends as end does."""
    eye: tuple[float, ...] = ()
    """Where the page's camera is, base axes, [m]."""
    ray: tuple[float, ...] = ()
    """Direction of the click, base axes."""


class PathActions:
    """Paths that become waypoints, each as one step for undo.

    Args:
        store: The state.
        connection: The robot; it reports the arm's position.
        history: The programs.
    """

    def __init__(self, store: Store, connection: PageConnection, history: ProgramHistory) -> None:
        self._store, self._connection, self._history = store, connection, history

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {ImportPath: self.load, SetPath: self.set_path, DrawPath: self.draw}

    def load(self, request: ImportPath) -> None:
        """Imports a path, or shows the problem next to the button; undo restores the program."""
        self._history.open()
        state = self._store.state
        name, frame = request.name[-LONGEST_NAME:], frame_of_paths(state)
        try:
            path = read_path(request.content, name, state.model, frame=frame, blend=state.paths.blend)
            self._take(path.waypoints, name.rpartition(".")[0], replaces=not state.paths.appends)
        except InvalidValueError as error:
            self._store.set_problem(PATH_FIELD, message("program.file_bad", error=describe_error(error)))
            return
        self._store.clear_problems(PATH_FIELD)
        self._set(notes=path.notes)
        what = message("path.base") if frame is None else message("path.frame", frame=frame)
        self._store.notify("good", message("path.loaded", name=name, count=len(path.waypoints), frame=what))

    def set_path(self, request: SetPath) -> None:
        """Takes the choice."""
        self._set(appends=request.appends)

    def type_field(self, request: TypeField) -> None:
        """Takes the typed blend radius, or shows its problem next to the field."""
        parsed = parse_number(request.text, 0.0, 1000.0 * LARGEST_BLEND, "mm")
        if request.field == BLEND_FIELD and self._history.answer(BLEND_FIELD, parsed.problem):
            assert parsed.value is not None
            self._set(blend=parsed.value / 1000.0)

    def draw(self, request: DrawPath) -> None:
        """Starts, continues or ends the drawing of a path."""
        points = self._store.state.paths.drawing
        if request.what == "toggle" and points is None:
            self._history.open()
            self._set(drawing=())
        elif request.what == "cancel":
            self._set(drawing=None)
        elif request.what == "point" and points is not None:
            self._add_point(request)
        elif points is not None:
            self._set(drawing=None)
            if points:
                self._finish([point.facing_tool() for point in points])

    def tick(self) -> None:
        """Ends the drawing when another arm is chosen."""
        state = self._store.state
        if state.paths.drawing is not None and state.program.draft.model != state.model.name:
            self._set(drawing=None)

    def _add_point(self, request: DrawPath) -> None:
        state = self._store.state
        try:
            point = cast_ray(state.cell.cell, request.eye, request.ray)
        except InvalidValueError:  # From a page that is not ours.
            return
        if point is None:
            self._store.notify("warn", message("path.miss"))
            return
        assert state.paths.drawing is not None
        self._set(drawing=(*state.paths.drawing, point))

    def _finish(self, poses: list[Pose]) -> None:
        """Adds lines to the drawn points, after the selected step."""
        state = self._store.state
        frame, chosen = frame_of_paths(state), state.program.draft.waypoint(state.program.selected)
        cell = state.cell.cell
        values: dict[str, Any] = {} if chosen is None else {"speed": chosen.speed}
        waypoints: list[Waypoint] = []
        try:
            for number, pose in enumerate(poses):
                blend = state.paths.blend if 0 < number < len(poses) - 1 else 0.0
                # A joint move leads to the first waypoint of a program from anywhere.
                build = Waypoint.line if number or state.program.draft.steps else Waypoint.joint
                waypoint = build(pose, blend=blend, **values)
                waypoints.append(
                    waypoint if frame is None or cell is None else waypoint.in_frame(cell.T_base(frame), frame)
                )
            self._take(tuple(waypoints), "", replaces=False)
        except InvalidValueError as error:
            self._store.notify("warn", explain_error(error))
            return
        self._store.notify("good", message("path.drawn", count=len(waypoints)))

    def _take(self, waypoints: tuple[Waypoint, ...], name: str, *, replaces: bool) -> None:
        """Replaces the program, or adds waypoints after the selected step.

        Raises:
            InvalidValueError: It would have too many waypoints.
        """
        state, draft = self._store.state, self._history.draft
        require_count(len(waypoints) + (0 if replaces else len(draft.steps)))
        here = self._connection.status().q_c
        start = draft.start if draft.start is not None and not replaces else here
        q = tuple(np.asarray(state.model.home if start is None else start).tolist())
        made = draft_of(Program(model=state.model.name, start=q, waypoints=waypoints, name=name), state.model)
        if replaces or not draft.steps:
            self._history.change(made, made.steps[0].key)
            return
        index = draft.index(state.program.selected)
        at = len(draft.steps) if index is None else index + 1
        steps = (*draft.steps[:at], *made.steps, *draft.steps[at:])
        self._history.change(replace(draft, steps=steps), made.steps[-1].key)

    def _set(self, **changes: Any) -> None:
        self._store.update(paths=replace(self._store.state.paths, **changes))
