"""Plan there: joint motion, line or arc; speed and time law."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.goal.goal_actions import CancelSearch, PlanGoal, SetLaw, SetPathType, SetSpeed
from rcilab.app.planning import PATH_TYPES
from rcilab.app.text import Text
from rcilab.motion.joint import JOINT_LAWS
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class PathTypePanel:
    """The motion from the arm's position to the goal."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("target.motion")):
            ways = {text(f"way.{kind}"): kind for kind in PATH_TYPES}
            self._ways = {kind: label for label, kind in ways.items()}
            way = gui.add_dropdown(text("target.way"), tuple(ways), hint=text("target.way_hint"))
            self._way = BoundControl(way, ask, lambda v, p: SetPathType(page=p, kind=ways.get(v)))
            self._via = gui.add_button(text("target.via"), icon="map-pin-plus", color="gray", visible=False)
            on_press(self._via, ask, lambda page: SetPathType(page=page, via=True))
            self._note = Html(gui)
            with gui.add_folder(text("target.speed")):
                gui.add_html('<i class="rl-rows"></i>')
                speed = gui.add_slider("%", 1, 100, 1, 50, hint=text("target.speed_hint"))
                self._speed = BoundControl(speed, ask, lambda v, p: SetSpeed(page=p, speed=v / 100.0))
                self._field = NumberField(gui.add_text("", "", hint=text("target.speed_hint")), ask, "speed")
            laws = {text(f"law.{law}"): law for law in JOINT_LAWS}
            self._laws = {law: label for label, law in laws.items()}
            law = gui.add_dropdown(text("target.law"), tuple(laws))
            gui.add_html(f'<p class="rl-note">{esc(text("target.law_hint"))}</p>')  # A tooltip would cover the list.
            self._law = BoundControl(law, ask, lambda v, p: SetLaw(page=p, law=laws.get(v, "")))
            self._plan = gui.add_button(text("target.plan"), icon="route", hint=text("target.plan_hint"))
            on_press(self._plan, ask, lambda page: PlanGoal(page=page))
            self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
            self._cancel = gui.add_button(text("program.cancel"), icon="x", color="gray", visible=False)
            on_press(self._cancel, ask, lambda page: CancelSearch(page=page))
            self._problem, self._planned = Html(gui), Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the choices and the plan."""
        text = self._text
        self._way.show(self._ways[state.path_type])
        self._via.visible = state.path_type == "arc"
        self._note.show(_note_html(state, text))
        is_searching = state.search is not None
        if self._bar.visible != is_searching:
            self._bar.visible = self._cancel.visible = is_searching
        if state.search is not None:
            self._bar.value = round(100.0 * state.search, 1)
        self._speed.show(round(state.speed * 100.0))
        self._field.show(shown(state.speed * 100.0), state.problems.get("speed"), state.entered)
        self._problem.show(problems_html(state, text, [("speed", text("target.speed"))]))
        self._law.show(self._laws[state.law])
        self._planned.show(planned_html(state, status, text))


def _note_html(state: UiState, text: Text) -> str:
    """Returns the via point of an arc."""
    if state.path_type != "arc":
        return ""
    if state.via is None:
        return f'<p class="rl-note rl-why">{esc(text("target.via_none"))}</p>'
    x, y, z = map(float, state.via.position)
    return f'<p class="rl-note">{esc(text("target.via_at", x=x, y=y, z=z))}</p>'
