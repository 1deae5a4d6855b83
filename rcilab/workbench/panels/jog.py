"""Jog: pose the candidate arm joint by joint. Nothing here moves the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rcilab.workbench import requests
from rcilab.workbench.text import Text
from rcilab.workbench.widgets import Ask, Html, Linked, NumberField, esc, shown

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState

_Name = Literal["zero", "home", "here", "undo"]
_NAMES: tuple[_Name, ...] = ("zero", "home", "here", "undo")


class JogPanel:
    """Sliders in degrees with the limits at their ends, a typed number beside each, named poses."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds one row a joint."""
        text, limits = self._text, state.model.limits.joint
        gui.add_html(f'<p class="rl-note">{esc(text("jog.note"))}</p>')
        self._buttons = gui.add_button_group(text("jog.poses"), [text(f"jog.{name}") for name in _NAMES])
        names: dict[str, _Name] = {text(f"jog.{name}"): name for name in _NAMES}

        @self._buttons.on_click
        async def _(event: Any) -> None:
            self._ask(requests.PoseGoal(page=event.client_id, name=names[event.target.value]))

        self._sliders: list[Linked] = []
        self._fields: list[NumberField] = []
        source = state.model.limits.source("joint.lower")
        angles = np.degrees(state.goal.q)
        with gui.add_folder(text("jog.joints")):
            gui.add_html('<i class="rl-rows"></i>')
            for joint in range(state.model.n):
                low, high = float(np.degrees(limits.lower[joint])), float(np.degrees(limits.upper[joint]))
                slider = gui.add_slider(
                    f"J{joint + 1}",
                    round(low, 3),
                    round(high, 3),
                    0.1,
                    round(float(np.clip(angles[joint], low, high)), 3),
                    marks=((low, f"{low:.0f}"), (0.0, ""), (high, f"{high:.0f}")),
                    hint=text("jog.limit_hint", joint=joint + 1, low=f"{low:.0f}", high=f"{high:.0f}", source=source),
                )
                self._sliders.append(Linked(slider, self._ask, _joint_request(joint)))
                box = gui.add_text("", shown(angles[joint]), hint=text("jog.type_hint"))
                self._fields.append(NumberField(box, self._ask, f"joint.{joint}"))
        self._problems = Html(gui)
        self._reach = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Moves sliders and numbers to the goal."""
        for joint, angle in enumerate(np.degrees(state.goal.q)):
            self._sliders[joint].show(round(float(angle), 3))
            field = self._fields[joint]
            field.show(shown(angle), state.problems.get(field.field), state.typed)
        self._problems.show(
            problems_html(state, self._text, [(f.field, f"J{i + 1}") for i, f in enumerate(self._fields)])
        )
        self._reach.show(reach_html(state, self._text))


def problems_html(state: UiState, text: Text, fields: list[tuple[str, str]]) -> str:
    """Returns what is wrong with typed numbers, one line a field."""
    return "".join(
        f'<p class="rl-problem" role="alert"><b>{esc(label)}</b> {esc(text.say(state.problems[field]))}</p>'
        for field, label in fields
        if field in state.problems
    )


def reach_html(state: UiState, text: Text) -> str:
    """Returns what the inverse says about the goal, with its tone as a word and as a sign."""
    reach = state.goal.reach
    return (
        f'<p class="rl-verdict rl-{reach.tone}"><b>{esc(text("reach.tone." + reach.tone))}</b> '
        f"{esc(text.say(reach.reason))}</p>"
    )


def _joint_request(joint: int):  # type: ignore[no-untyped-def]
    def make(angle: float, page: int | None) -> requests.Request:
        return requests.MoveJoint(page=page, joint=joint, angle=float(np.radians(angle)))

    return make
