"""Program: the waypoints as a list, and the controls that plan them."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.new_steps import NEW_STEPS
from rcilab.app.program.program_actions import CancelProgram, PlanProgram
from rcilab.app.program.program_draft import Draft, Note, ProgramState, describe_place, number_at, placed
from rcilab.app.program.waypoint_fields import WAYPOINT_FIELDS
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.readiness import time_shown
from rcilab.app.text import Text
from rcilab.app.view_actions import SetView
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.panels.program_list import list_html, notes_html, window_around
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_TOOLS = (
    ("up", "arrow-up"), ("down", "arrow-down"), ("duplicate", "copy"), ("delete", "trash"), ("undo", "arrow-back-up"),
    ("redo", "arrow-forward-up"), ("copy_steps", "clipboard-copy"), ("paste", "clipboard"),
)  # fmt: skip
_SAME = math.radians(1e-4)  # [rad] A joint at a smaller distance is at the start of the program.
_MOMENT = 0.25  # [s] A shorter progress bar would only flicker.


class ProgramPanel:
    """The list with its buttons, plan, progress, cancel, loop, rounds."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: tuple[object, ...] = ()
        self._noted: tuple[Note, ...] = ()
        self._began = 0.0
        self._window = range(0)

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("program.add")):
            gui.add_html('<i class="rl-buttons rl-bare"></i>')
            for source, icon in (("here", "map-pin"), ("target", "current-location")):
                button = gui.add_button(
                    text(f"program.add_{source}"), icon=icon, hint=text(f"program.add_{source}_hint")
                )
                on_press(button, ask, _edit("add", source=source))
        with gui.add_folder(text("program.insert_title")):
            gui.add_html('<i class="rl-pairs rl-worded rl-bare"></i>')
            kinds = {
                text(f"program.new.{kind}"): kind for kind in NEW_STEPS if kind != "nullspace" or state.model.redundancy
            }
            chosen = gui.add_dropdown(text("program.insert_kind"), tuple(kinds), hint=text("program.insert_hint"))
            insert = gui.add_button(text("program.insert"), icon="plus", color="gray", hint=text("program.insert_hint"))
            on_press(insert, ask, lambda page: EditProgram(page=page, what="insert", type=kinds.get(chosen.value, "")))
            box = gui.add_text(text("program.find"), "", hint=text("program.find_hint"))
            self._find = NumberField(box, ask, "program.0.find")
        with gui.add_folder(text("program.tools")):
            gui.add_html('<i class="rl-tools rl-bare"></i>')
            self._tools: dict[str, Any] = {}
            for what, icon in _TOOLS:
                button = gui.add_button(text(f"program.{what}"), icon=icon, color="gray", hint=text(f"program.{what}"))
                on_press(button, ask, _edit(what.removesuffix("_steps")))
                self._tools[what] = button
        self._list = Html(gui)
        with gui.add_folder(text("program.plan_title")):
            gui.add_html('<i class="rl-buttons"></i>')
            self._plan = gui.add_button(text("program.plan"), icon="route", hint=text("program.plan_hint"))
            on_press(self._plan, ask, lambda page: PlanProgram(page=page))
            self._upto = gui.add_button(
                text("program.upto"), icon="route", color="gray", hint=text("program.upto_hint")
            )
            on_press(self._upto, ask, lambda page: PlanProgram(page=page, upto=True))
            loop = gui.add_checkbox(text("program.loop"), False, hint=text("program.loop_hint"))
            self._loop = BoundControl(loop, ask, lambda v, p: SetView(page=p, name="loop", value=v))
            box = gui.add_text(text("program.rounds"), "", hint=text("program.rounds_hint"))
            self._rounds = NumberField(box, ask, "program.0.rounds")
            self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
            self._cancel = gui.add_button(text("program.cancel"), icon="x", color="gray", visible=False)
            on_press(self._cancel, ask, lambda page: CancelProgram(page=page))
            self._answer = Html(gui)
            self._notes = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the program and its plan."""
        text, program = self._text, state.program
        draft = program.draft if program.draft.model == state.model.name else Draft(model=state.model.name)
        plan = state.plan if state.plan is not None and program.planned is draft and state.plan.program else None
        t = time_shown(state, status)
        running = None if plan is None else number_at(plan, t)
        in_base = placed(draft, state.cell.cell)
        index, count = draft.index(program.selected), len(draft.steps)
        wanted = index if program.scrolled is None else program.scrolled
        self._window = window_around(self._window, count, wanted)
        drawn = (
            in_base,
            program.selected,
            program.failed,
            program.notes,
            running,
            state.model,
            self._window,
            program.marked,
        )
        if drawn != self._drawn:  # The positions of waypoints take some time to compute.
            self._drawn = drawn
            self._list.show(list_html(state, in_base, running, text, self._window))
        able = {
            "up": index is not None and index > 0, "down": index is not None and index < count - 1,
            "duplicate": index is not None, "delete": index is not None, "undo": program.can_undo,
            "redo": program.can_redo, "copy_steps": index is not None, "paste": count > 0,
        }  # fmt: skip
        for what, button in self._tools.items():
            button.disabled = not able[what]
        planning = program.progress is not None
        self._plan.disabled = not count or planning or is_moving(status)
        self._upto.disabled = index is None or planning or is_moving(status)
        self._loop.show(state.loop)
        self._find.show("", state.problems.get(self._find.field), state.entered)
        self._rounds.show(str(program.rounds), state.problems.get(self._rounds.field), state.entered)
        now = time.monotonic()
        self._began = self._began if planning else now
        self._bar.visible = self._cancel.visible = planning and now - self._began > _MOMENT
        if program.progress is not None:
            self._bar.value = round(100.0 * program.progress, 1)
        sentence = problems_html(state, text, self._typed(program))
        if sentence:  # While a rejected number is shown, the verdict is hidden: it is about another program.
            sentence += f'<p class="rl-note">{esc(text("program.rejected"))}</p>'
        elif plan is not None:
            where = describe_place(plan, t)
            sentence += planned_html(state, status, text)
            sentence += "" if where is None else f'<p class="rl-note rl-now">▸ {esc(text.render(where))}</p>'
        elif count and not planning and program.answer is None:
            sentence += f'<p class="rl-note">{esc(self._elsewhere(draft, status))}</p>'
        if program.answer is not None and "rl-problem" not in sentence:
            sentence += f'<p class="rl-verdict rl-{program.tone}">{esc(text.render(program.answer))}</p>'
        self._answer.show(f'<div class="rl-room">{sentence}</div>' if count else sentence)

        if program.notes is not self._noted:
            self._noted = program.notes
            self._notes.show(notes_html(program.notes, text))

    def _typed(self, program: ProgramState) -> list[tuple[str, str]]:
        """Returns the fields of numbers, and their labels: the rounds, and those of the selected waypoint."""
        own = f"program.{program.selected}."
        waypoint = [(f"{own}{name}", self._text(f"program.field.{name}")) for name in WAYPOINT_FIELDS]
        whole = [(f"program.0.{name}", self._text(f"program.{name}")) for name in ("rounds", "find")]
        return [*whole, *waypoint]

    def _elsewhere(self, draft: Draft, status: SupervisorStatus) -> str:
        """Returns whether the program starts at the arm's position, as text."""
        if status.q_c is None or draft.start is None or len(status.q_c) != len(draft.start):
            return self._text("program.not_planned")
        travel = np.abs(status.q_c - np.array(draft.start))
        if float(travel.max()) < _SAME:
            return self._text("program.not_planned")
        joint = int(travel.argmax())
        return self._text("program.elsewhere", joint=joint + 1, angle=float(travel[joint]))


def _edit(what: Any, **values: Any):  # type: ignore[no-untyped-def]
    return lambda page: EditProgram(page=page, what=what, **values)
