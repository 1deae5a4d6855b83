"""The state of the Learn tab: the displayed fault, the one in progress, the lesson and its step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rcilab.app.run.recording import Recording
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import FaultCode
from rcilab.i18n.translator import Message

if TYPE_CHECKING:
    from rcilab.app.displayed_motion import DisplayedMotion
    from rcilab.app.fault_lab.fault_demo import FaultDemo
    from rcilab.app.store import UiState


@dataclass(frozen=True, eq=False, kw_only=True)
class FaultDisplay:
    """A displayed fault, for timeline and scene."""

    demo: FaultDemo
    """The fault."""
    displayed: DisplayedMotion
    recording: Recording
    """The motion of the arm."""
    plan_motion: object
    """The plan of the page when the display opened; another plan closes the display."""

    @property
    def playhead(self) -> float:
        """Place of the fault on the timeline, 0 to 1; the controlled stop follows it."""
        return self.demo.time / max(self.displayed.plan.motion.duration, CYCLE_TIME)


@dataclass(frozen=True, eq=False, kw_only=True)
class LessonState:
    """Progress in a lesson."""

    name: str
    step: int = 0
    """From 0; the number of steps if the lesson is finished."""
    skipped: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False, kw_only=True)
class LearnState:
    """The state of the Learn tab."""

    provoking: FaultCode | None = None
    progress: float = 0.0
    """Progress of the provocation, 0 to 1."""
    show: FaultDisplay | None = None
    is_script_shown: bool = False
    problem: Message | None = None
    """Why the last provocation failed."""
    lesson: LessonState | None = None


def displayed_state(state: UiState, *, scene: bool = False) -> UiState:
    """Returns the state for timeline, or scene: with the opened run, or the displayed fault, in place of the plan."""
    if state.replay is not None:
        return state.replay.over(state)
    show = state.learn.show
    if show is None:
        return state
    seen = show.displayed.scene if scene else show.displayed.plan
    return replace(state, plan=seen, recording=show.recording)
