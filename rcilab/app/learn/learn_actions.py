"""Requests of the Learn tab: faults and lessons. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from rcilab.app.connection import PageConnection
from rcilab.app.displayed_motion import display_fault
from rcilab.app.fault_lab import FaultDemo, FaultTable
from rcilab.app.fault_lab.private_arm import PrivateArm
from rcilab.app.learn.learn_state import FaultDisplay, LearnState, LessonState
from rcilab.app.learn.lessons import LESSONS, Watcher, lessons_of
from rcilab.app.request import Handlers, Request
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.recording import Recording
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.background_job import BackgroundJob
from rcilab.core.errors import RcilabError
from rcilab.core.fault import FaultCode
from rcilab.i18n.translator import message


@dataclass(frozen=True, slots=True, kw_only=True)
class PressLearn(Request):
    """A button of the Learn tab."""

    what: Literal["provoke", "cancel", "close", "moment", "script", "lesson", "skip", "leave"]
    fault: int = -1
    """Number of a fault."""
    name: str = ""
    """Name of a lesson."""


class LearnActions:
    """The fault lab never touches the robot of the page; lessons only watch."""

    def __init__(self, store: Store, connection: PageConnection) -> None:
        self._store, self._connection = store, connection
        self._arm = PrivateArm()
        self._work: BackgroundJob[FaultCode, FaultDemo] = BackgroundJob("fault lab")
        self._watcher = Watcher()

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            PressLearn: self.press,
        }

    def press(self, request: PressLearn) -> None:
        """Handles a button of the tab."""
        match request.what:
            case "provoke":
                self._provoke(request.fault)
            case "cancel":
                self._work.cancel()
                self._set(provoking=None, progress=0.0)
            case "close":
                self._close()
            case "moment" if self._learn.show is not None:
                self._store.update(playhead=self._learn.show.playhead, playing=False)
            case "script":
                self._set(is_script_shown=not self._learn.is_script_shown)
            case "lesson" if request.name in lessons_of(self._store.state.model):
                self._watcher = Watcher()
                self._set(lesson=LessonState(name=request.name))
                first = LESSONS[request.name][0].name
                self._store.notify("good", message(f"lesson.{request.name}.{first}"))
            case "skip":
                self._step(skipped=True)
            case "leave":
                self._set(lesson=None)
            case _:
                pass

    def tick(self) -> None:
        """Shows progress and result of a provocation; closes the display; checks the lesson's step."""
        learn = self._learn
        if self._work.is_done:
            self._finish(self._work.pop_result()[1])
        elif self._work.progress is not None and self._work.progress != learn.progress:
            self._set(progress=self._work.progress)
        self._look_beside()
        self._watch()

    def close(self) -> None:
        """Ends the private controller."""
        self._work.cancel()
        self._arm.close()

    @property
    def _learn(self) -> LearnState:
        return self._store.state.learn

    def _set(self, **changes: Any) -> None:
        self._store.update(learn=replace(self._learn, **changes))

    def _provoke(self, fault: int) -> None:
        model = self._store.state.model
        table = FaultTable(model)
        chosen = next((known for known in table if known == fault), None)
        if chosen is None:
            return
        obstacle = table.obstacle(chosen)
        if obstacle is not None:
            self._set(problem=obstacle)
            return
        self._work.start(chosen, partial(self._arm.provoke, chosen, model.name))
        self._set(provoking=chosen, progress=0.0, problem=None)

    def _finish(self, result: FaultDemo | RcilabError) -> None:
        if isinstance(result, RcilabError):
            self._set(provoking=None, problem=message("learn.failed", error=explain_error(result)))
            return
        state = self._store.state
        plan_motion = None if state.plan is None else state.plan.motion
        show = build_display(result, plan_motion)
        self._set(provoking=None, show=show)
        self._store.update(playhead=show.playhead, playing=False)

    def _close(self) -> None:
        if self._learn.show is not None:
            self._set(show=None)
            self._store.update(playhead=0.0, playing=False)

    def _look_beside(self) -> None:
        """Closes the display once there is something else to show: another plan, another arm, a motion."""
        state, show = self._store.state, self._learn.show
        if show is None:
            return
        plan_motion = None if state.plan is None else state.plan.motion
        other = plan_motion is not show.plan_motion or state.model.name != show.demo.model.name
        if other or is_moving(self._connection.status()):
            self._set(show=None)

    def _watch(self) -> None:
        lesson = self._learn.lesson
        if lesson is not None and lesson.step < len(LESSONS[lesson.name]):
            step = LESSONS[lesson.name][lesson.step]
            if self._watcher.is_done(step, self._store.state, self._connection.status()):
                self._step()

    def _step(self, *, skipped: bool = False) -> None:
        lesson = self._learn.lesson
        if lesson is None or lesson.step >= len(LESSONS[lesson.name]):
            return
        passed = lesson.skipped | {lesson.step} if skipped else lesson.skipped
        self._watcher = Watcher()
        self._set(lesson=replace(lesson, step=lesson.step + 1, skipped=passed))
        if not skipped:  # Shown on every tab: the learner is on the tab of the step.
            steps = LESSONS[lesson.name][lesson.step + 1 :]
            last = message("lesson.over") if not steps else message(f"lesson.{lesson.name}.{steps[0].name}")
            self._store.notify("good", message("lesson.ticked", next=last))


def build_display(demo: FaultDemo, plan_motion: object) -> FaultDisplay:
    """Returns a fault as the page shows it."""
    rows = demo.whole
    return FaultDisplay(
        demo=demo,
        displayed=display_fault(demo),
        recording=Recording(
            t=np.array(rows["t"]),
            q=rows["q"],
            q_c=rows["q_c"],
            dq=rows["dq"],
            delay=0,
            mode=demo.scenario.mode,
            moment=demo.time,
        ),
        plan_motion=plan_motion,
    )
