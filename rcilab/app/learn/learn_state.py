"""The Learn tab as a value: the fault on show, the one being provoked, the lesson and how far it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rcilab.app.run.recording import Recording
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import FaultCode
from rcilab.i18n.translator import Message

if TYPE_CHECKING:
    from rcilab.app.exhibition import Exhibition
    from rcilab.app.fault_lab.fault_demo import FaultDemo
    from rcilab.app.store import UiState


@dataclass(frozen=True, eq=False, kw_only=True)
class Show:
    """A fault on show, as timeline and scene draw it."""

    exhibit: FaultDemo
    """The fault."""
    exhibition: Exhibition
    recording: Recording
    """What the arm did."""
    beside: object
    """The motion that was planned on the page when it opened; another one closes the show."""

    @property
    def place(self) -> float:
        """Where the timeline stands at the fault, 0 to 1; behind it comes the controlled stop."""
        return self.exhibit.moment / max(self.exhibition.plan.motion.duration, CYCLE_TIME)


@dataclass(frozen=True, eq=False, kw_only=True)
class LessonState:
    """Progress in a lesson."""

    name: str
    step: int = 0
    """From 0; the number of steps when it is over."""
    skipped: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False, kw_only=True)
class LearnState:
    """Everything of the Learn tab."""

    provoking: FaultCode | None = None
    progress: float = 0.0
    """Of what is being provoked, 0 to 1."""
    show: Show | None = None
    is_script_shown: bool = False
    problem: Message | None = None
    """Why the last one did not come."""
    lesson: LessonState | None = None


def exhibited(state: UiState, *, scene: bool = False) -> UiState:
    """Returns what timeline, or scene, are to draw: the fault on show, if there is one, in place of the plan."""
    show = state.learn.show
    if show is None:
        return state
    seen = show.exhibition.scene if scene else show.exhibition.plan
    return replace(state, plan=seen, recording=show.recording)
