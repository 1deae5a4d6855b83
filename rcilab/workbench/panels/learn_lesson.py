"""Learn: short lessons whose steps are ticked when the learner has done them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.learn.learn_actions import PressLearn
from rcilab.app.learn.lessons import LESSONS, lessons_of
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.learn.learn_state import LessonState
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class LearnLessonPanel:
    """One button per lesson; during a lesson, its steps."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._choice = gui.add_folder(text("learn.lessons"))
        with self._choice:
            gui.add_html('<i class="rl-buttons rl-wall"></i>')
            for name in lessons_of(state.model):
                button = gui.add_button(text(f"lesson.{name}"), icon="school", color="blue")
                on_press(button, ask, _begin(name))
        self._steps = Html(gui)
        self._skip = gui.add_button(text("lesson.skip"), icon="player-track-next", color="gray", visible=False)
        on_press(self._skip, ask, lambda page: PressLearn(page=page, what="skip"))
        self._leave = gui.add_button(text("lesson.leave"), icon="x", color="gray", visible=False)
        on_press(self._leave, ask, lambda page: PressLearn(page=page, what="leave"))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the lesson."""
        learn = state.learn
        lesson = learn.lesson
        free = lesson is None and (learn.show is None or learn.provoking is not None)
        if self._choice.visible != free:
            self._choice.visible = free
        self._leave.visible = lesson is not None
        self._skip.visible = lesson is not None and lesson.step < len(LESSONS[lesson.name])
        self._steps.show("" if lesson is None else steps_html(lesson, self._text))


def steps_html(lesson: LessonState, text: Text) -> str:
    """Returns the steps of a lesson: done, current, to come."""
    steps = LESSONS[lesson.name]
    rows = []
    for place, step in enumerate(steps):
        words = esc(text(f"lesson.{lesson.name}.{step.name}"))
        if place < lesson.step:
            sign, look = ("↷", "rl-skipped") if place in lesson.skipped else ("✓", "rl-done")
            word = text("lesson.skipped" if place in lesson.skipped else "lesson.done")
        else:
            sign, look = ("▸", "rl-next") if place == lesson.step else ("○", "rl-later")
            word = text("lesson.now" if place == lesson.step else "lesson.later")
        current = ' aria-current="step"' if place == lesson.step else ""
        mark = f'<i role="img" title="{esc(word)}" aria-label="{esc(word)}">{sign}</i>'
        rows.append(f'<li class="{look}"{current}>{mark}{words}</li>')
    over = lesson.step >= len(steps)
    end = f'<p class="rl-verdict rl-good" role="status">{esc(text("lesson.over"))}</p>' if over else ""
    title = f"<b>{esc(text('lesson.' + lesson.name))}</b> {min(lesson.step + 1, len(steps))} / {len(steps)}"
    return f'<div class="rl-lesson"><p>{title}</p><ol>{"".join(rows)}</ol></div>{end}'


def _begin(name: str):  # type: ignore[no-untyped-def]
    return lambda page: PressLearn(page=page, what="lesson", name=name)
