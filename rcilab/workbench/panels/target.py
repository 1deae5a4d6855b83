"""Target: the tool pose in numbers, the branches that reach it, the arm angle, and how to go there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.posing.planning import LAWS
from rcilab.posing.reach import margin
from rcilab.workbench import requests
from rcilab.workbench.goal.actions import POSE_FIELDS
from rcilab.workbench.panels.jog import problems_html, reach_html
from rcilab.workbench.setup.wanted import name_parts
from rcilab.workbench.text import Text
from rcilab.workbench.widgets import Ask, Html, Linked, NumberField, esc, on_press, shown

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState


class TargetPanel:
    """Pose in mm and degrees, branch list, arm angle, speed, law, "plan there"."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        gui.add_html(f'<p class="rl-note">{esc(text("target.note"))}</p>')
        self._fields: list[NumberField] = []
        with gui.add_folder(text("target.pose")):
            gui.add_html('<i class="rl-pairs"></i>')
            for index in (0, 3, 1, 4, 2, 5):
                name = POSE_FIELDS[index]
                box = gui.add_text(text(f"target.{name}"), "", hint=text("target.type_hint"))
                self._fields.append(NumberField(box, ask, f"pose.{name}", text.unit("mm" if index < 3 else "deg")))
        self._problems = Html(gui)
        self._reach = Html(gui)
        self._psi: Linked | None = None
        self._psi_field: NumberField | None = None
        if state.model.n == 7:
            with gui.add_folder(text("target.psi_title")):
                gui.add_html('<i class="rl-rows"></i>')
                factor, _ = text.units.from_si("rad")
                end, step = (180.0, 1.0) if text.units.angle == "deg" else (3.14, 0.01)
                slider = gui.add_slider("ψ", -end, end, step, 0.0, hint=text("target.psi_hint"))
                self._psi = Linked(slider, ask, lambda v, p: requests.SetArmAngle(page=p, psi=v / factor))
                self._psi_field = NumberField(gui.add_text("", ""), ask, "psi", text.unit("deg"))
        with gui.add_folder(text("target.branches")):
            self._branches = Html(gui)
            self._choice = gui.add_button_group(
                " ", [str(number) for number in range(1, 9)], hint=text("target.branch_hint")
            )

            @self._choice.on_click
            async def _(event: Any) -> None:
                ask(requests.ChooseBranch(page=event.client_id, index=int(event.target.value) - 1))

        with gui.add_folder(text("target.motion")):
            with gui.add_folder(text("target.speed")):
                gui.add_html('<i class="rl-rows"></i>')
                speed = gui.add_slider("%", 1, 100, 1, 50, hint=text("target.speed_hint"))
                self._speed = Linked(speed, ask, lambda v, p: requests.SetSpeed(page=p, speed=v / 100.0))
                self._speed_field = NumberField(gui.add_text("", "", hint=text("target.speed_hint")), ask, "speed")
            self._speed_problem = Html(gui)
            laws = {text(f"law.{law}"): law for law in LAWS}
            self._laws = {law: label for label, law in laws.items()}
            law = gui.add_dropdown(text("target.law"), tuple(laws))
            gui.add_html(f'<p class="rl-note">{esc(text("target.law_hint"))}</p>')  # A tooltip would cover the list.
            self._law = Linked(law, ask, lambda v, p: requests.SetLaw(page=p, law=laws.get(v, "")))
            self._plan = gui.add_button(text("target.plan"), icon="route", hint=text("target.plan_hint"))
            on_press(self._plan, ask, lambda page: requests.Plan(page=page))
            self._planned = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the goal."""
        goal = state.goal
        values = (*(goal.target.position * 1000.0), *np.degrees(goal.target.rpy))
        numbers: dict[str, float] = dict(zip(POSE_FIELDS, values, strict=True))
        labels = []
        for field in self._fields:
            name = field.field.partition(".")[2]
            field.show(shown(numbers[name]), state.problems.get(field.field), state.typed)
            labels.append((field.field, self._text(f"target.{name}")))
        if self._psi is not None and self._psi_field is not None and goal.psi is not None:
            is_deg = self._text.units.angle == "deg"
            self._psi.show(float(round(math.degrees(goal.psi))) if is_deg else round(goal.psi, 2))
            self._psi_field.show(shown(math.degrees(goal.psi)), state.problems.get("psi"), state.typed)
            labels.append(("psi", "ψ"))
        self._problems.show(problems_html(state, self._text, labels))
        self._reach.show(reach_html(state, self._text))
        self._branches.show(self._branch_table(state, status))
        solutions = goal.reach.solutions
        self._choice.visible = solutions is not None and len(solutions) > 0
        if solutions is not None and len(solutions):
            self._choice.options = tuple(str(number) for number in range(1, len(solutions) + 1))
        self._speed.show(round(state.speed * 100.0))
        self._speed_field.show(shown(state.speed * 100.0), state.problems.get("speed"), state.typed)
        self._speed_problem.show(problems_html(state, self._text, [("speed", self._text("target.speed"))]))
        self._law.show(self._laws[state.law])
        self._planned.show(planned_html(state, self._text))

    def _branch_table(self, state: UiState, status: SupervisorStatus) -> str:
        solutions, text = state.goal.reach.solutions, self._text
        if solutions is None or not len(solutions):
            code = "target.out_of_reach" if state.goal.reach.tone == "bad" else "target.no_branches"
            return f'<p class="rl-note">{esc(text(code))}</p>'
        here = state.goal.q if status.q_c is None else status.q_c
        rows = []
        for number, q in enumerate(solutions, start=1):
            least = margin(state.model, q)
            chosen = float(np.abs(np.angle(np.exp(1j * (q - state.goal.q)))).max()) < 1e-6
            mark = ' class="rl-chosen"' if chosen else ""
            left, away = (text.units.angle_of(angle) for angle in (least.angle, float(np.abs(q - here).max())))
            cells = (f"{number}", left, f"J{least.joint}", away)
            rows.append(f"<tr{mark}>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
        heads = "".join(
            f"<th>{esc(text(f'target.head.{name}'))}</th>" for name in ("number", "margin", "worst", "away")
        )
        others = len(solutions.all) - len(solutions)
        rest = f'<p class="rl-note">{esc(text("target.forbidden", count=others))}</p>' if others else ""
        return f'<table class="rl-table"><tr>{heads}</tr>{"".join(rows)}</table>{rest}'


def planned_html(state: UiState, text: Text) -> str:
    """Returns one line about the plan: how long it takes and whether it passed, or why there is none."""
    if state.plan is None:
        return f'<p class="rl-note">{esc(text.say(state.no_plan)) if state.no_plan else ""}</p>'
    stale = state.plan.stale_parts(state.model, state.setup.wanted.box)
    if stale:
        said = text("setup.stale_why", what=text.say(name_parts(stale)))
        return f'<p class="rl-verdict rl-warn"><b>{esc(text("setup.stale"))}</b> {esc(said)}</p>'
    report = state.plan.report
    tone, word = ("good", "check.passed") if report.ok else ("bad", "check.failed")
    code = "target.planned" if state.plan.program is None else "program.planned"
    said = text(code, duration=f"{state.plan.motion.duration:.3f}")
    if state.plan.short is not None:
        said += " " + text("target.leads_short", short=text.say(state.plan.short))
        tone, word = (tone, word) if not report.ok else ("warn", "target.not_there")
    return f'<p class="rl-verdict rl-{tone}"><b>{esc(text(word))}</b> {esc(said)}</p>'
