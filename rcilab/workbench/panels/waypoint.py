"""The editor of the selected waypoint: type, numbers, target."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_draft import TYPES, target_of
from rcilab.app.program.waypoint_fields import VIA_FIELDS, arm_angle_of
from rcilab.app.text import Text
from rcilab.motion.waypoint import Waypoint
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown, shown_pose

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel

_PLAIN = ("speed", "blend", "dwell")


class WaypointPanel:
    """Visible while a waypoint is selected."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._fields: dict[str, NumberField] = {}
        self._boxes: dict[str, Any] = {}
        self._folder = gui.add_folder(text("program.selected", number=1))
        with self._folder:
            gui.add_html('<i class="rl-pairs rl-worded"></i>')
            kinds = {text(f"program.type.{kind}"): kind for kind in TYPES}
            self._kinds = {kind: label for label, kind in kinds.items()}
            choice = gui.add_dropdown(text("program.type"), tuple(kinds), hint=text("program.type_hint"))
            self._kind = BoundControl(choice, ask, lambda v, p: EditProgram(page=p, what="type", type=kinds.get(v, "")))
            choice = gui.add_dropdown(
                text("jog.frame"), (text("jog.frame.base"),), hint=text("program.frame_hint"), visible=False
            )
            self._frame = BoundControl(choice, ask, self._ask_frame)
            for name in (*_PLAIN, *(("psi",) if state.model.redundancy else ())):
                self._field(gui, name)
        self._pose = gui.add_folder(text("program.pose"))
        with self._pose:
            gui.add_html('<i class="rl-trios"></i>')
            for name in POSE_FIELDS:
                self._field(gui, name)
        self._via = gui.add_folder(text("program.via"))
        with self._via:
            gui.add_html('<i class="rl-trios"></i>')
            for name in VIA_FIELDS:
                self._field(gui, name)
            self._button(gui, "via", "here", "map-pin")
            self._button(gui, "via", "target", "current-location")
        self._teach = gui.add_folder(text("program.teach"))
        with self._teach:
            gui.add_html('<i class="rl-buttons"></i>')
            for what, source, icon in (
                ("teach", "here", "map-pin"), ("teach", "target", "current-location"), ("start", "here", "flag"),
                ("aim", "target", "eye"),
            ):  # fmt: skip
                self._button(gui, what, source, icon)
        self._source = Html(gui)  # It is not always visible, so it is last.

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the selected waypoint."""
        draft, key = state.program.draft, state.program.selected
        index, waypoint = draft.index(key), draft.waypoint(key)
        if draft.model != state.model.name or waypoint is None or index is None:
            for folder in (self._folder, self._pose, self._via, self._teach):
                folder.visible = False
            self._source.show("")
            return
        arm = draft.arm(state.model)
        values = _values(waypoint, arm)
        self._folder.visible = self._teach.visible = True
        self._folder.label = self._text("program.selected", number=index + 1)
        self._pose.visible, self._via.visible = "x" in values, waypoint.type == "arc"
        self._show_kind(waypoint)
        frames = () if state.cell.cell is None else tuple(state.cell.cell.frame_poses)
        self._show_frame(waypoint, frames)
        for name, field in self._fields.items():
            field.field = f"program.{key}.{name}"
            field.show(values.get(name, ""), state.problems.get(field.field), state.entered)
        self._source.show(self._note(waypoint, frames))

    def _show_kind(self, waypoint: Waypoint) -> None:
        """Shows the type; a type that only files have is the only option."""
        label = self._text(f"program.type.{waypoint.type}")
        is_free, box = waypoint.type in TYPES, self._kind.handle
        options = tuple(self._kinds.values()) if is_free else (label,)
        if box.options != options:
            self._kind.exchange(options, label)
        box.disabled = not is_free
        self._kind.show(label)

    def _show_frame(self, waypoint: Waypoint, frames: tuple[str, ...]) -> None:
        """Shows the frame of a waypoint, where there is a choice; also one that the cell does not have."""
        base, box = self._text("jog.frame.base"), self._frame.handle
        label = base if waypoint.frame is None else waypoint.frame
        options = tuple(dict.fromkeys((base, *frames[1:], label)))  # The first one is the world.
        if box.options != options:
            self._frame.exchange(options, label)
        box.visible = len(options) > 1 and waypoint.type != "nullspace"
        self._frame.show(label)

    def _ask_frame(self, label: str, page: int | None) -> EditProgram:
        is_base = label == self._text("jog.frame.base")
        return EditProgram(page=page, what="frame", frame=None if is_base else label)

    def _field(self, gui: Any, name: str) -> None:
        box = gui.add_text(self._text(f"program.field.{name}"), "", hint=self._text(f"program.hint.{_hint_of(name)}"))
        unit = "mm" if name in ("blend", *POSE_FIELDS[:3], *VIA_FIELDS) else "deg"
        is_plain = name in ("speed", "dwell")
        self._fields[name] = NumberField(
            box, self._ask, f"program.0.{name}", None if is_plain else self._text.unit(unit)
        )

    def _button(self, gui: Any, what: Any, source: Any, icon: str) -> None:
        name = self._text(f"program.{what}_{source}")
        button = gui.add_button(name, icon=icon, color="gray", hint=self._text(f"program.{what}_{source}_hint"))
        on_press(button, self._ask, lambda page: EditProgram(page=page, what=what, source=source))

    def _note(self, waypoint: Waypoint, frames: tuple[str, ...]) -> str:
        notes = [] if waypoint.type in TYPES else [self._text("program.from_file")]
        if waypoint.frame not in (None, *frames):
            notes.append(self._text("program.frame_missing", frame=waypoint.frame))
        return "".join(f'<p class="rl-note">{esc(note)}</p>' for note in notes)


def _values(waypoint: Waypoint, arm: RobotModel) -> dict[str, str]:
    """Returns the text of each field of this waypoint."""
    psi, target = arm_angle_of(waypoint, arm), target_of(waypoint, arm)
    values = {
        "speed": shown(100.0 * waypoint.speed), "blend": shown(1000.0 * waypoint.blend), "dwell": shown(waypoint.dwell),
        "psi": "" if psi is None else shown(math.degrees(psi)),
    }  # fmt: skip
    if target is not None:
        values |= dict(zip(POSE_FIELDS, shown_pose(target), strict=True))
    if waypoint.via is not None:
        values |= {name: shown(1000.0 * number) for name, number in zip(VIA_FIELDS, waypoint.via, strict=True)}
    return values


def _hint_of(name: str) -> str:
    return "mm" if name in (*POSE_FIELDS[:3], *VIA_FIELDS) else "deg" if name in POSE_FIELDS else name
