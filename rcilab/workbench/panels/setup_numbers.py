"""The numbers of the edited part of the configuration; those of other parts are hidden."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.arm_features import explain_missing_part
from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.setup.configuration_state import FORCE_AXES
from rcilab.app.setup.setup_actions import SetSetup
from rcilab.app.setup.setup_fields import FIELD_NAMES, INERTIA_NAMES, field_names, read_field
from rcilab.app.text import Text
from rcilab.makers.configuration import SETUP_PARTS
from rcilab.makers.maker import capabilities_of
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_ROWS: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "box": (("low", FIELD_NAMES["box"][:3]), ("high", FIELD_NAMES["box"][3:6]), ("turned", POSE_FIELDS[3:])),
    "tool": (("place", POSE_FIELDS[:3]), ("turned", POSE_FIELDS[3:])),
    "load": (
        ("mass", ("mass",)),
        ("center", POSE_FIELDS[:3]),
        ("moments", INERTIA_NAMES[:3]),
        ("products", INERTIA_NAMES[3:]),
    ),
    "force": (("place", POSE_FIELDS[:3]), ("turned", POSE_FIELDS[3:])),
}


class SetupNumbersPanel:
    """A group of the Setup tab for each part; only that of the edited one is visible."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._folders: dict[str, Any] = {}
        self._fields: dict[str, dict[str, NumberField]] = {}
        self._problems: dict[str, Html] = {}
        self._named: dict[str, list[tuple[str, str]]] = {}  # Each field, and its name in problems.
        self._seen: dict[str, BoundControl] = {}
        for part in SETUP_PARTS:
            if explain_missing_part(state.model, part) is not None:
                continue
            title = text(f"setup.part.{part}")
            title = title[:1].upper() + title[1:]
            folder = gui.add_folder(title, visible=state.setup.edited == part, order=0.5)  # After the choice.
            with folder:
                gui.add_html('<i class="rl-triples"></i>')
                if part == "box":
                    active = gui.add_checkbox(text("setup.active"), False, hint=text("setup.active_hint"))
                    self._active = BoundControl(active, ask, _switch("active"))
                if part == "force":
                    self._build_axes(gui, ask)
                self._build_numbers(gui, part, field_names(part, turns_box=capabilities_of(state.model).turns_box))
                see = gui.add_checkbox(text("setup.see"), False, hint=text("setup.see_hint"))
                self._seen[part] = BoundControl(see, ask, _switch(part))
                gui.add_html(f'<p class="rl-note">{esc(text(f"setup.note.{part}"))}</p>')
            self._folders[part] = folder

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the configuration."""
        setup = state.setup
        for part, folder in self._folders.items():
            if folder.visible != (part == setup.edited):
                folder.visible = part == setup.edited
        box, force = setup.wanted.box, setup.wanted.force
        assert box is not None
        assert force is not None
        if "box" in self._folders:
            self._active.show(box.active)
        if "force" in self._folders:
            self._axes.show(next(self._labels[name] for name, kind in FORCE_AXES.items() if kind == force.type))
        for part in self._folders:
            self._seen[part].show(part in setup.seen)
            for name, field in self._fields[part].items():
                number = read_field(setup, part, name)
                sentence = f"{number + 0.0:.6g}" if part == "load" and name in INERTIA_NAMES else shown(number)
                field.show(sentence, state.problems.get(field.field), state.entered)
            self._problems[part].show(problems_html(state, self._text, self._named[part]))

    def _build_numbers(self, gui: Any, part: str, known: tuple[str, ...]) -> None:
        text = self._text
        self._fields[part] = {}
        self._named[part] = []
        for row, names in _ROWS[part]:
            if not set(names) <= set(known):
                continue
            gui.add_html(f'<p class="rl-rowname">{esc(text(f"setup.row.{row}"))}</p>')
            for name in names:
                box = gui.add_text(self._label(name), "", hint=text("target.type_hint"))
                unit = None if name == "mass" or name in INERTIA_NAMES else "deg" if name in POSE_FIELDS[3:] else "mm"
                field = f"setup.{part}.{name}"
                self._fields[part][name] = NumberField(box, self._ask, field, text.unit(unit) if unit else None)
                self._named[part].append((field, f"{text(f'setup.row.{row}')}: {self._label(name)}"))
        self._problems[part] = Html(gui)

    def _build_axes(self, gui: Any, ask: Ask) -> None:
        names = {self._text(f"setup.axes.{name}"): name for name in FORCE_AXES}
        self._labels = {name: label for label, name in names.items()}
        axes = gui.add_dropdown(self._text("setup.axes"), tuple(names), hint=self._text("setup.axes_hint"))
        self._axes = BoundControl(axes, ask, lambda v, p: SetSetup(page=p, name="axes", value=names.get(v, "")))

    def _label(self, name: str) -> str:
        return self._text(f"setup.field.{name}")


def _switch(name: Any):  # type: ignore[no-untyped-def]
    return lambda value, page: SetSetup(page=page, name=name, value=bool(value))
