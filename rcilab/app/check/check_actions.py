"""Requests of the Check tab. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from rcilab.app.check.check_state import CheckState, Explained, Slowed
from rcilab.app.check.slowdown_job import SlowdownJob, slow_program, slow_to_goal
from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal_actions import GoalActions, PlanGoal
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import CancelProgram, PlanProgram, ProgramActions
from rcilab.app.request import Handlers, Request
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.background_job import BackgroundJob
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import message

if TYPE_CHECKING:
    from rcilab.app.planning import Plan
    from rcilab.conformance.report import Report
    from rcilab.core.condition import Condition


@dataclass(frozen=True, slots=True, kw_only=True)
class PressCheck(Request):
    """A button or a row of the Check tab."""

    what: Literal["row", "slow", "undo", "explain", "again", "cancel"]
    row: str = ""
    """Id of a condition."""


class CheckActions:
    """Shows a row's worst moment, slows the plan down, explains the report, repeats the check."""

    def __init__(self, store: Store, connection: PageConnection, goal: GoalActions, program: ProgramActions) -> None:
        self._store, self._connection, self._goal, self._program = store, connection, goal, program
        self._work: BackgroundJob[Plan, SlowdownJob | Explained] = BackgroundJob("check")

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            PressCheck: self.press,
        }

    def press(self, request: PressCheck) -> None:
        """Handles a button or a row of the tab."""
        plan = self._store.state.plan
        if request.what == "cancel":
            self._work.cancel()
            self._set(doing=None)
            self._program.cancel(CancelProgram())
        elif request.what == "undo":
            self._undo()
        elif request.what == "again":
            self._plan_again(plan)
        elif plan is None:
            self._store.notify("warn", message("check.nothing"))
        elif request.what == "row":
            self._seek(plan, request.row)
        elif request.what == "slow":
            self._slow_down(plan)
        elif request.what == "explain":
            self._explain(plan)

    def tick(self) -> None:
        """Shows the progress and the result of a job; drops what is about another plan."""
        if self._work.is_done:
            self._set(doing=None)
            about, result = self._work.pop_result()
            if isinstance(result, RcilabError):
                self._answer("bad", explain_error(result))
            elif isinstance(result, SlowdownJob):
                self._finish(about, result)
            else:
                self._set(explained=result)
        elif self._work.progress is not None and self._work.progress != self._check.progress:
            self._set(progress=self._work.progress)
        slowed, plan = self._check.slowed, self._store.state.plan
        if slowed is not None and (plan is None or plan.as_planned is not slowed.after.as_planned):
            self._set(slowed=None)

    def close(self) -> None:
        """Cancels the job."""
        self._work.cancel()

    @property
    def _check(self) -> CheckState:
        return self._store.state.check

    def _set(self, **changes: Any) -> None:
        self._store.update(check=replace(self._check, **changes))

    def _answer(self, tone: str, answer: Any) -> None:
        plan = self._store.state.plan
        self._set(tone=tone, answer=answer, found=None, about=None if plan is None else plan.report)

    def _seek(self, plan: Plan, name: str) -> None:
        """Moves the timeline to the worst moment of a row and selects its joint in the plots."""
        row = next((row for row in plan.report.rows if row.id == name), None)
        if row is None:
            return
        playhead = row.time / max(plan.motion.duration, 1e-3)
        plot, plots = plot_of(row.condition), self._store.state.plots
        shown = plots if plot is None else plots | {plot}
        self._store.update(playhead=min(max(playhead, 0.0), 1.0), playing=False, plot_joint=row.joint, plots=shown)
        self._set(seek_count=self._check.seek_count + 1, row=name)

    def _plan_again(self, plan: Plan | None) -> None:
        """Plans again what the plan was made of: the program, or the path to the goal."""
        if plan is None or plan.program is None:
            self._goal.plan(PlanGoal())
        else:
            self._program.plan(PlanProgram())

    def _slow_down(self, plan: Plan) -> None:
        state = self._store.state
        if is_moving(self._connection.status()):
            self._store.notify("warn", message("notice.moving"))
            return
        if plan.program is None:
            run = partial(slow_to_goal, plan, state.speed, state.law, state.via)
        elif state.program.planned is state.program.draft:
            run = partial(slow_program, plan, state.program.draft, state.program.rounds)
        else:
            self._answer("warn", message("ready.program"))
            return
        self._work.start(plan, run)
        self._set(doing="slow", progress=0.0, answer=None)

    def _finish(self, before: Plan, result: SlowdownJob) -> None:
        state = self._store.state
        if state.plan is None or state.plan.as_planned is not before.as_planned:
            self._answer("warn", message("check.overtaken"))
            return
        if result.plan is None:
            passes = result.found.factor is not None
            self._answer("good" if passes else "bad", message("check.already" if passes else "check.none"))
            self._set(found=result.found)
            return
        facts = {
            "factor": f"{1.0 / result.scale:.3g}",
            "before": f"{before.motion.duration:.3f}",
            "after": f"{result.plan.motion.duration:.3f}",
        }
        speed = state.speed if result.is_stretched or result.draft is not None else result.scale * state.speed
        slowed = Slowed(before=state.plan, after=result.plan, speed=state.speed, draft=result.draft)
        if result.draft is not None:
            self._program.exchange(result.draft, result.plan)
            sentence = message("check.slowed_program", **facts, scale=f"{100 * result.scale:.1f}")
        else:
            self._store.update(plan=result.plan, speed=speed, recording=None, playhead=0.0, playing=False)
            sentence = message("check.slowed", **facts, from_=f"{100 * state.speed:.1f}", to=f"{100 * speed:.1f}")
        if result.is_stretched:
            sentence = message("check.stretched", **facts)
        self._set(slowed=slowed)
        self._answer("good", sentence)

    def _undo(self) -> None:
        """Restores the plan before the slow-down."""
        slowed = self._check.slowed
        if slowed is None:
            return
        if slowed.draft is not None:
            self._program.editing.edit(EditProgram(what="undo"))
            self._program.keep_plan(slowed.before)
        else:
            self._store.update(plan=slowed.before, speed=slowed.speed, recording=None, playhead=0.0, playing=False)
        self._set(slowed=None, answer=None)

    def _explain(self, plan: Plan) -> None:
        report = plan.report
        self._work.start(plan, lambda tell: _explained(report))
        self._set(doing="explain", progress=0.0)


def plot_of(condition: Condition) -> str | None:
    """Returns the plot of the quantity that a condition bounds; None without such a plot."""
    match condition.signal, condition.order:
        case "joint", order:
            return ("q", "dq", "ddq", "jerk")[order]
        case "torque", _:
            return "tau"
        case (("translation" | "rotation"), order) if order in (1, 2):
            return ("speed", "acceleration")[order - 1]
        case "arm_angle", _:
            return "psi"
        case _:
            return None


def _explained(report: Report) -> Explained:
    return report, None if report.ok else report.slow_down()
