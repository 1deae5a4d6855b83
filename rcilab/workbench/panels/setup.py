"""Setup: what is mounted on the arm and where its tool may be; the set values next to the controller's."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any

from rcilab.app.arm_features import explain_missing_part
from rcilab.app.check.check_actions import PressCheck
from rcilab.app.check.freshness import outdated
from rcilab.app.run.mode_parameters import held_rows, units_of
from rcilab.app.setup.configuration_state import (
    LISTED,
    describe_held,
    describe_part,
    describe_watched,
    differing_tool,
    has_other_limits,
    name_parts,
    pending_parts,
    setup_obstacle,
    tool_outside,
)
from rcilab.app.setup.setup_actions import PressSetup, SetSetup
from rcilab.app.text import Text
from rcilab.makers.configuration import SETUP_PARTS
from rcilab.makers.maker import parameters_of
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class SetupPanel:
    """The head of the Setup tab: whether the controller has the configuration, undo, confirmation, the edited part."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._verdict = Html(gui)
        self._send = gui.add_button(text("setup.send"), icon="send", color="orange", visible=False)
        on_press(self._send, ask, _press("send"))
        self._agree = gui.add_button(text("setup.confirm"), icon="send", color="red", visible=False)
        on_press(self._agree, ask, _press("confirm"))
        self._cancel = gui.add_button(text("run.cancel"), color="gray", visible=False)
        on_press(self._cancel, ask, _press("cancel"))
        self._table = Html(gui)
        self._planned = Html(gui)
        with gui.add_folder(text("setup.edit_title"), order=0.0):  # First, so that messages do not move it.
            gui.add_html('<i class="rl-buttons rl-setup-head"></i>')
            self._undo = gui.add_button(
                text("setup.undo"), icon="arrow-back-up", color="gray", hint=text("setup.undo_hint")
            )
            on_press(self._undo, ask, _press("undo"))
            self._again = gui.add_button(text("setup.check"), icon="clipboard-check", hint=text("setup.check_hint"))
            on_press(self._again, ask, lambda page: PressCheck(page=page, what="again"))
            parts = (part for part in SETUP_PARTS if explain_missing_part(state.model, part) is None)
            choices = {text("setup.nothing"): "", **{text(f"setup.part.{part}"): part for part in parts}}
            self._choices = {part: label for label, part in choices.items()}
            edited = gui.add_dropdown(
                text("setup.edit"), tuple(choices), initial_value=self._choices[state.setup.edited]
            )
            self._edited = BoundControl(
                edited, ask, lambda v, p: SetSetup(page=p, name="edited", value=choices.get(v, ""))
            )

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows state and controller."""
        text, setup = self._text, state.setup
        pending, foreign = pending_parts(state, status), state.target != "virtual"
        question = setup.asked is setup.wanted and bool(pending)
        self._verdict.show(self._verdict_html(state, status) + self._outside_html(state, status))
        is_asked = bool(pending) and (foreign or setup.refusal is not None)
        self._send.visible = is_asked and not question
        self._agree.visible = self._cancel.visible = question
        self._undo.disabled = not setup.can_undo
        self._edited.show(self._choices[setup.edited])
        self._edited.handle.disabled = bool(state.watched)
        self._again.disabled = outdated(state) is None
        is_idle = state.no_plan is not None and state.no_plan.code == "plan.here"  # Says how to move, not here.
        self._planned.show("" if is_idle else planned_html(state, status, text))
        self._table.show(self._table_html(state, status))

    def _verdict_html(self, state: UiState, status: SupervisorStatus) -> str:
        text, setup = self._text, state.setup
        if state.watched:
            return f'<p class="rl-note">{esc(text("setup.watched"))}</p>'
        pending = pending_parts(state, status)
        obstacle = setup_obstacle(state, status)
        differing = differing_tool(state, status)
        if setup.asked is setup.wanted and pending:
            named = (
                text("setup.value", part=text(f"setup.part.{part}"), value=self._said(setup.wanted, part))
                for part in pending
            )
            parts = reduce(lambda first, second: text("joined", first=first, second=second), named)
            sentence = text("setup.ask", model=state.model.name, address=state.target, what=parts)
            return f'<p class="rl-verdict rl-warn" role="alert">{esc(sentence)}</p>'
        if obstacle is not None:
            tone = "bad" if setup.refusal is not None else "warn"
            word = "setup.refused" if setup.refusal is not None else "setup.pending"
            return _verdict(tone, text(word), text.render(obstacle))
        if differing is not None:
            return _verdict("warn", text("setup.differs"), text("setup.differs_long", tool=text.render(differing)))
        if has_other_limits(state, status):
            return _verdict("warn", text("setup.other_limits"), text("setup.other_limits_long"))
        if any(field.startswith("setup.") for field in state.problems):
            return _verdict("warn", text("setup.rejected"), text("setup.rejected_long"))
        if not setup.touched:
            sentence = text("setup.untouched") + ("" if setup.edited else text("setup.untouched_choose"))
            return f'<p class="rl-note">{esc(sentence)}</p>'
        sent = name_parts(tuple(part for part in LISTED if part in setup.touched))
        return _verdict("good", text("setup.given"), text("setup.given_long", what=text.render(sent)))

    def _outside_html(self, state: UiState, status: SupervisorStatus) -> str:
        """Returns that the arm itself is outside the safety box, if it is."""
        box = state.setup.wanted.box
        if status.q_c is None or box is None or not box.active:
            return ""
        outside = tool_outside(state, state.model.forward(status.q_c).position)
        return "" if outside is None else _verdict("bad", self._text("setup.arm_outside"), self._text.render(outside))

    def _table_html(self, state: UiState, status: SupervisorStatus) -> str:
        text, pending = self._text, pending_parts(state, status)
        rows = []
        for part in LISTED:
            if explain_missing_part(state.model, part) is not None:
                continue
            if state.watched:
                held = text.render(describe_watched(status, part))
                rows.append(f"<tr><th>{esc(text(f'setup.part.{part}'))}</th><td>{esc(held)}</td></tr>")
                continue
            here = self._said(state.setup.wanted, part)
            held = text("setup.held", held=text.render(describe_held(status, part)))
            mark = ' class="rl-differs"' if part in pending else ""
            rows.append(
                f"<tr{mark}><th>{esc(text(f'setup.part.{part}'))}</th><td>{esc(here)}"
                f'<br><span class="rl-dim">{esc(held)}</span></td></tr>'
            )
        rows += [] if state.watched else self._parameter_rows(state, status)
        return f'<table class="rl-table rl-facts-table rl-setup">{"".join(rows)}</table>'

    def _parameter_rows(self, state: UiState, status: SupervisorStatus) -> list[str]:
        """Returns the parameters of all modes as the controller has them; Run has their fields."""
        groups, is_known = parameters_of(state.model), state.target == "virtual"
        held = held_rows(groups, None, status, self._text, is_known=is_known)
        where, rows = self._text("setup.in_mode"), []
        for group, (name, shown) in zip(groups, held, strict=True):
            notes = "<br>".join(esc(note) for note in (units_of(group, self._text.units), where) if note)
            rows.append(f'<tr><th>{esc(name)}</th><td>{esc(shown)}<br><span class="rl-dim">{notes}</span></td></tr>')
        return rows

    def _said(self, setup: Any, part: str) -> str:
        return self._text.render(describe_part(setup, part))


def _press(what: Any):  # type: ignore[no-untyped-def]
    return lambda page: PressSetup(page=page, what=what)


def _verdict(tone: str, word: str, rest: str) -> str:
    return f'<p class="rl-verdict rl-{tone}"><b>{esc(word)}</b> {esc(rest)}</p>'
