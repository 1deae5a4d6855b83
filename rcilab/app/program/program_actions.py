"""Requests that plan or load a program. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial, reduce

import numpy as np

from rcilab.app.arm_features import start_of_plans
from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.planning import Plan
from rcilab.app.program.edit_actions import LONGEST_NAME, EditActions
from rcilab.app.program.path_actions import PathActions
from rcilab.app.program.program_draft import FILE_FIELD, Draft, draft_of, is_led_in, notes_of, number_at, placed
from rcilab.app.program.program_history import ProgramHistory
from rcilab.app.program.program_planning import Job, plan_job
from rcilab.app.request import Handlers, Request
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.store import Store
from rcilab.core.arrays import readonly_copy
from rcilab.core.background_job import BackgroundJob
from rcilab.core.errors import InvalidValueError, PlanningError, RcilabError, VersionMismatchError
from rcilab.core.safety_box import SafetyBox
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Message, message
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion.program import Program


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanProgram(Request):
    """Plan the program and check it."""

    upto: bool = False
    """Only up to the selected waypoint."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelProgram(Request):
    """Cancel the planning in progress."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadProgram(Request):
    """A file was chosen in the browser."""

    name: str
    content: bytes


class ProgramActions:
    """Planning in another thread, files; one program for each arm.

    Attributes:
        editing: The edits of the program.
        paths: Paths that become waypoints.
    """

    def __init__(self, store: Store, connection: PageConnection, goal: GoalActions) -> None:
        self._store, self._connection = store, connection
        self._planner: BackgroundJob[Job, Plan] = BackgroundJob("program")
        # Model, safety box and program in base with which planning failed.
        self._basis: tuple[RobotModel, SafetyBox | None, Draft] | None = None
        self._history = ProgramHistory(store, self._drop_planning)
        self.editing = EditActions(store, connection, goal, self._history)
        self.paths = PathActions(store, connection, self._history)

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            PlanProgram: self.plan,
            CancelProgram: self.cancel,
            LoadProgram: self.load,
        }

    def plan(self, request: PlanProgram) -> None:
        """Plans the program, or its part up to the selected step, from the arm's position."""
        self._history.open()
        state, status = self._store.state, self._connection.status()
        start = start_of_plans(state.model, status)
        upto = self._history.state.selected if request.upto else None
        program = self._history.draft.program(state.model, upto)
        reason = (
            "notice.moving" if is_moving(status) else "plan.no_arm" if start is None
            else "program.empty" if program is None else "program.select" if request.upto and upto is None else None
        )  # fmt: skip
        if reason is not None:
            self._store.notify("warn", message(reason))
            return
        rejected = self._find_rejected()
        if rejected is not None:
            self._store.notify("warn", rejected)
            return
        assert program is not None
        assert start is not None
        cell = state.cell.cell
        poses = {} if cell is None else cell.frame_poses
        try:
            in_base = program.resolved({}) if cell is None else cell.resolve(program)
        except InvalidValueError as error:
            self._store.notify("warn", message("plan.failed", error=describe_error(error)))
            return
        job = Job(
            model=self._history.draft.arm(state.model),
            draft=self._history.draft,
            program=in_base,
            frames={name: poses[name] for name in program.frames},
            here=readonly_copy(start),
            rounds=self._history.state.rounds,
            box=state.setup.wanted.box,
            cell=state.cell_for(self._history.draft.arm(state.model)),
        )
        self._basis = state.model, job.box, placed(job.draft, cell)
        self._planner.start(job, partial(plan_job, job))
        self._store.update(busy=message("program.planning"))
        self._store.clear_problems(FILE_FIELD)
        self._history.set(progress=0.0, answer=None, failed=None, notes=())

    def cancel(self, request: CancelProgram) -> None:
        """Cancels the planning in progress; the previous plan is kept."""
        if self._planner.progress is not None:
            self._drop_planning()
            self._history.set(tone="warn", answer=message("program.cancelled"))

    def load(self, request: LoadProgram) -> None:
        """Loads a program from a file, or shows the problem next to the button; undo restores the previous one."""
        self._history.open()
        try:
            program = Program.from_json(request.content, request.name[:LONGEST_NAME] or "program")
        except (InvalidValueError, VersionMismatchError) as error:
            self._refuse_file(message("program.file_bad", error=describe_error(error)))
            return
        model = self._store.state.model.name
        if program.model != model:
            name = request.name[:LONGEST_NAME]
            self._refuse_file(message("program.file_other", file=name, theirs=program.model, ours=model))
            return
        self._store.clear_problems(FILE_FIELD)
        draft = draft_of(program, self._store.state.model)
        self._history.change(draft, draft.steps[0].key)
        loaded = message("program.loaded", count=len(draft.steps), name=request.name[:LONGEST_NAME])
        other = self._describe_other_setup(draft)
        if other is None:
            self._store.notify("good", loaded)
        else:
            self._store.notify("warn", message("program.both", first=loaded, second=other))

    def restore(self, program: Program) -> None:
        """Restores a program of the previous workbench."""
        self._history.open()
        draft = draft_of(program, self._store.state.model)
        self._history.change(draft, draft.steps[0].key)

    def lay_aside(self, program: Program) -> None:
        """Keeps a program of an arm that is not chosen."""
        self._history.lay_aside(draft_of(program, load_model(program.model)))

    def exchange(self, draft: Draft, plan: Plan) -> None:
        """Takes a changed program with its plan; undo restores the previous one."""
        self._history.open()
        self._history.change(draft, self._history.state.selected)
        self.keep_plan(plan)

    def keep_plan(self, plan: Plan) -> None:
        """Takes the plan of the unchanged program."""
        self._store.update(plan=plan, no_plan=None, recording=None, playhead=0.0, playing=False, asked=None)
        self._history.set(planned=self._history.draft, answer=None, notes=notes_of(plan, self._history.draft.steps))

    def tick(self) -> None:
        """Shows progress and result of the planning; follows the choice of another arm."""
        self._history.open()
        if self._planner.is_done:
            self._store.update(busy=None)
            self._history.set(progress=None)
            self._finish(*self._planner.pop_result())
        elif self._history.state.tone == "bad" and self._is_failure_old():
            self._history.set(tone="good", answer=None, failed=None)
        elif self._planner.progress != self._history.state.progress:
            self._history.set(progress=self._planner.progress)
        elif (
            self._history.state.answer is not None
            and self._history.state.tone != "bad"
            and is_moving(self._connection.status())
        ):
            self._history.set(tone="good", answer=None)  # It describes the arm's position before the motion.

    def close(self) -> None:
        """Cancels the planning in progress."""
        self._planner.cancel()

    def _find_rejected(self) -> Message | None:
        """Returns the first rejected number, and why it was rejected; None if all were accepted."""
        for field, why in self._store.state.problems.items():
            _, key, name = (*field.split("."), "", "")[:3]
            number = self._history.draft.index(int(key)) if key.isdecimal() else None
            if name == "rounds":
                return message("program.mend_rounds", why=why)
            if field.startswith("program.") and number is not None:
                label = message(f"program.field.{name}")
                return message("program.mend", number=number + 1, field=label, why=why)
        return None

    def _refuse_file(self, why: Message) -> None:
        """Shows why a file was not loaded, until the next file, edit or plan."""
        self._store.set_problem(FILE_FIELD, why)

    def _describe_other_setup(self, draft: Draft) -> Message | None:
        """Returns in what a program differs from tool, load and safety box of the page, or None."""
        state = self._store.state
        is_other = not draft.is_for(state.model), draft.has_other_box(state.setup.wanted.box)
        keys = ("program.other_arm", "program.other_box")
        return _join([message(key) for key, other in zip(keys, is_other, strict=True) if other])

    def _drop_planning(self) -> bool:
        if self._planner.progress is None:
            return False
        self._planner.cancel()
        self._store.update(busy=None)
        self._history.set(progress=None)
        return True

    def _is_failure_old(self) -> bool:
        """Returns whether planning failed with another tool, load, joint limits, box or frames than those of now."""
        state = self._store.state
        now = state.model, state.setup.wanted.box, placed(self._history.draft, state.cell.cell)
        is_same = self._basis is not None and all(then is it for then, it in zip(self._basis, now, strict=True))
        return self._history.state.planned is None and not is_same

    def _was_stretched(self) -> bool:
        """Returns whether the current plan is slower than the speeds of its program."""
        plan, slowed = self._store.state.plan, self._store.state.check.slowed
        return slowed is not None and slowed.draft is None and plan is not None and plan.program is not None

    def _finish(self, job: Job, result: Plan | RcilabError) -> None:
        steps = job.draft.steps
        if isinstance(result, RcilabError):
            number = result.waypoint if isinstance(result, PlanningError) else None
            failed = None if number is None else steps[number - 1].key
            self._history.set(
                tone="bad", answer=message("plan.failed", error=describe_error(result)), failed=failed, planned=None
            )
            return
        tone, answer, failed = "good", [], None
        if self._was_stretched():
            tone, answer = "warn", [message("program.unslowed")]
        self._store.update(plan=result, no_plan=None, recording=None, playhead=0.0, playing=False, asked=None)
        if is_led_in(result):
            tone = "warn"
            answer.append(_describe_approach(job, result))
        if result.report.violations:
            number = number_at(result, result.report.violations[0].time) or 0
            failed = steps[number - 1].key if number else None
            where = message("program.at_start") if number == 0 else message("program.waypoint", number=number)
            answer.append(message("program.worst", where=where))
            tone = "bad"
        self._history.set(
            planned=job.draft, failed=failed, tone=tone, answer=_join(answer), notes=notes_of(result, steps)
        )


def _describe_approach(job: Job, plan: Plan) -> Message:
    """Returns that the motion begins with the approach to the program's start, and its length."""
    travel = np.abs(job.here - np.array(job.program.start))
    joint = int(travel.argmax())
    duration = float(plan.motion.segment_starts[1])
    return message("program.approach", joint=joint + 1, angle=float(travel[joint]), duration=f"{duration:.2f}")


def _join(messages: list[Message]) -> Message | None:
    """Returns the messages about a plan as one message."""
    return (
        reduce(lambda first, second: message("program.both", first=first, second=second), messages)
        if messages
        else None
    )
