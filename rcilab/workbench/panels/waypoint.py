"""The editor of the selected waypoint: type, numbers, target."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_draft import TYPES, target_of
from rcilab.app.program.waypoint_fields import CIRCLE_FIELDS, VIA_FIELDS, arm_angle_of
from rcilab.app.text import Text
from rcilab.motion.waypoint import Waypoint
from rcilab.motion.waypoint_types import ALLOWED, CHOICES
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown, shown_pose

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel

_PLAIN = ("speed", "blend", "dwell", "approach", "distance", "signal", "timeout", "count", "text", "angle")
_LENGTHS = ("blend", "approach", "distance", *POSE_FIELDS[:3], *VIA_FIELDS, *CIRCLE_FIELDS[:3])
_UNITLESS = ("speed", "dwell", "signal", "timeout", "count", "text", *CIRCLE_FIELDS[3:])
_CHOICES = {
    "level": ("on", "off"),
    "jaws": CHOICES["jaws"],
    "orientation": CHOICES["orientation"],
    "way": CHOICES["way"],
}


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
            self._choices = {name: self._choice(gui, name, values) for name, values in _CHOICES.items()}
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
        self._circle = gui.add_folder(text("program.circle"))
        with self._circle:
            gui.add_html('<i class="rl-trios"></i>')
            for name in CIRCLE_FIELDS:
                self._field(gui, name)
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
            for folder in (self._folder, self._pose, self._via, self._circle, self._teach):
                folder.visible = False
            self._source.show("")
            return
        arm = draft.arm(state.model)
        values = _values(waypoint, arm)
        self._folder.visible = waypoint.type != "end"
        self._teach.visible = waypoint.type in TYPES
        several = len(draft.chosen(key, state.program.marked))
        self._folder.label = (
            self._text("program.selected", number=index + 1)
            if several == 1
            else self._text("program.selected_many", count=several)
        )
        self._pose.visible, self._via.visible = "x" in values, waypoint.type == "arc"
        self._circle.visible = waypoint.type == "circle"
        self._show_kind(waypoint)
        allowed = ALLOWED[waypoint.type]
        for name in (*_PLAIN, "psi"):
            if name in self._boxes:
                self._boxes[name].visible = name in allowed
        for name, control in self._choices.items():
            control.handle.visible = name in allowed and (name != "level" or waypoint.signal is not None)
            value = ("on" if waypoint.level else "off") if name == "level" else getattr(waypoint, name)
            if control.handle.visible:
                control.show(self._text(f"program.{name}.{value}"))
        frames = () if state.cell.cell is None else tuple(state.cell.cell.frame_poses)
        self._show_frame(waypoint, frames)
        for name, field in self._fields.items():
            field.field = f"program.{key}.{name}"
            field.show(values.get(name, ""), state.problems.get(field.field), state.entered)
        note = f'<p class="rl-note">{esc(self._text("program.several"))}</p>' if several > 1 else ""
        self._source.show(note + self._note(waypoint, frames))

    def _show_kind(self, waypoint: Waypoint) -> None:
        """Shows the type; one that has no target is the only option."""
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
        box.visible = len(options) > 1 and "frame" in ALLOWED[waypoint.type]
        self._frame.show(label)

    def _ask_frame(self, label: str, page: int | None) -> EditProgram:
        is_base = label == self._text("jog.frame.base")
        return EditProgram(page=page, what="frame", frame=None if is_base else label)

    def _field(self, gui: Any, name: str) -> None:
        box = gui.add_text(self._text(f"program.field.{name}"), "", hint=self._text(f"program.hint.{_hint_of(name)}"))
        unit = None if name in _UNITLESS else self._text.unit("mm" if name in _LENGTHS else "deg")
        self._fields[name] = NumberField(box, self._ask, f"program.0.{name}", unit)
        self._boxes[name] = box

    def _choice(self, gui: Any, name: str, values: tuple[str, ...]) -> BoundControl:
        """Adds a field with a fixed set of values."""
        labels = {self._text(f"program.{name}.{value}"): value for value in values}
        box = gui.add_dropdown(
            self._text(f"program.field.{name}"), tuple(labels), hint=self._text(f"program.hint.{name}")
        )
        return BoundControl(
            box, self._ask, lambda v, p: EditProgram(page=p, what="choose", name=name, value=labels.get(v, ""))
        )

    def _button(self, gui: Any, what: Any, source: Any, icon: str) -> None:
        name = self._text(f"program.{what}_{source}")
        button = gui.add_button(name, icon=icon, color="gray", hint=self._text(f"program.{what}_{source}_hint"))
        on_press(button, self._ask, lambda page: EditProgram(page=page, what=what, source=source))

    def _note(self, waypoint: Waypoint, frames: tuple[str, ...]) -> str:
        notes: list[str] = []
        if waypoint.type == "end":
            notes.append(self._text("program.end_note"))
        if waypoint.frame not in (None, *frames):
            notes.append(self._text("program.frame_missing", frame=waypoint.frame))
        return "".join(f'<p class="rl-note">{esc(note)}</p>' for note in notes)


def _values(waypoint: Waypoint, arm: RobotModel) -> dict[str, str]:
    """Returns the text of each field of this waypoint."""
    psi, target = arm_angle_of(waypoint, arm), target_of(waypoint, arm)
    values = {
        "speed": shown(100.0 * waypoint.speed), "blend": shown(1000.0 * waypoint.blend), "dwell": shown(waypoint.dwell),
        "psi": "" if psi is None else shown(math.degrees(psi)),
        "approach": shown(1000.0 * (waypoint.approach or 0.0)), "distance": shown(1000.0 * (waypoint.distance or 0.0)),
        "signal": "" if waypoint.signal is None else str(waypoint.signal), "timeout": shown(waypoint.timeout or 0.0),
        "count": "" if waypoint.count is None else str(waypoint.count), "text": waypoint.text or "",
        "angle": shown(math.degrees(math.tau if waypoint.angle is None else waypoint.angle)),
    }  # fmt: skip
    if waypoint.center is not None and waypoint.axis is not None:
        numbers = [*(shown(1000.0 * x) for x in waypoint.center), *map(shown, waypoint.axis)]
        values |= dict(zip(CIRCLE_FIELDS, numbers, strict=True))
    if target is not None:
        values |= dict(zip(POSE_FIELDS, shown_pose(target), strict=True))
    if waypoint.via is not None:
        values |= {name: shown(1000.0 * number) for name, number in zip(VIA_FIELDS, waypoint.via, strict=True)}
    return values


def _hint_of(name: str) -> str:
    if name in CIRCLE_FIELDS[3:]:
        return "axis"
    in_mm = (*POSE_FIELDS[:3], *VIA_FIELDS, *CIRCLE_FIELDS[:3])
    return "mm" if name in in_mm else "deg" if name in POSE_FIELDS else name
