"""Requests that plan or load a program. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial, reduce

import numpy as np

from rcilab.app.arm_features import start_of_plans
from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.planning import Plan
from rcilab.app.program.edit_actions import LONGEST_NAME, EditActions
from rcilab.app.program.program_draft import FILE_FIELD, Draft, draft_of, is_led_in, notes_of, number_at
from rcilab.app.program.program_history import ProgramHistory
from rcilab.app.program.program_planning import Job, plan_job
from rcilab.app.request import Handlers, Request
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.store import Store
from rcilab.core.arrays import readonly_copy
from rcilab.core.background_job import BackgroundJob
from rcilab.core.errors import InvalidValueError, PlanningError, RcilabError, VersionMismatchError
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Message, message
from rcilab.model.robot_model import load_model
from rcilab.motion.program import Program


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanProgram(Request):
    """Plan the program and check it."""

    upto: bool = False
    """Only to the selected waypoint."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelProgram(Request):
    """Cancel the planning in progress."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadProgram(Request):
    """A file was chosen in the browser."""

    name: str
    content: bytes


class ProgramActions:
    """Planning beside this thread, files; one program for each arm.

    Attributes:
        editing: What changes the program.
    """

    def __init__(self, store: Store, session: RobotConnection, goal: GoalActions) -> None:
        self._store, self._session = store, session
        self._planner: BackgroundJob[Job, Plan] = BackgroundJob("program")
        self._shelves = ProgramHistory(store, self._drop_planning)
        self.editing = EditActions(store, session, goal, self._shelves)

    @property
    def handlers(self) -> Handlers:
        """What it does for each of its requests."""
        return {
            PlanProgram: self.plan,
            CancelProgram: self.cancel,
            LoadProgram: self.load,
        }

    def plan(self, request: PlanProgram) -> None:
        """Plans the program, or the part of it up to the selected step, from where the arm stands."""
        self._shelves.open()
        state, status = self._store.state, self._session.status()
        start = start_of_plans(state.model, status)
        upto = self._shelves.state.selected if request.upto else None
        program = self._shelves.draft.program(state.model, upto)
        reason = (
            "notice.moving" if is_moving(status) else "plan.no_arm" if start is None
            else "program.empty" if program is None else "program.select" if request.upto and upto is None else None
        )  # fmt: skip
        if reason is not None:
            self._store.say("warn", message(reason))
            return
        assert program is not None
        assert start is not None
        job = Job(
            model=self._shelves.draft.arm(state.model),
            draft=self._shelves.draft,
            program=program,
            here=readonly_copy(start),
            rounds=self._shelves.state.rounds,
            box=state.setup.wanted.box,
        )
        self._planner.start(job, partial(plan_job, job))
        self._store.update(busy=message("program.planning"))
        self._store.clear_problems(FILE_FIELD)
        self._shelves.set(progress=0.0, answer=None, failed=None, notes=())

    def cancel(self, request: CancelProgram) -> None:
        """Cancels the planning in progress; the plan before it stays."""
        if self._planner.progress is not None:
            self._drop_planning()
            self._shelves.set(tone="warn", answer=message("program.cancelled"))

    def load(self, request: LoadProgram) -> None:
        """Takes a program from a file, or says beside the button what is wrong; undo brings the old one back."""
        self._shelves.open()
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
        self._shelves.change(draft, draft.steps[0].key)
        self._store.say("good", message("program.loaded", count=len(draft.steps), name=request.name[:LONGEST_NAME]))

    def restore(self, program: Program) -> None:
        """Takes a program that was here before."""
        self._shelves.open()
        draft = draft_of(program, self._store.state.model)
        self._shelves.change(draft, draft.steps[0].key)

    def lay_aside(self, program: Program) -> None:
        """Keeps a program for when its arm is chosen."""
        self._shelves.lay_aside(draft_of(program, load_model(program.model)))

    def exchange(self, draft: Draft, plan: Plan) -> None:
        """Takes a changed program that has been planned already; undo brings the old one back."""
        self._shelves.open()
        self._shelves.change(draft, self._shelves.state.selected)
        self.keep_plan(plan)

    def keep_plan(self, plan: Plan) -> None:
        """Takes the plan of the program as it is."""
        self._store.update(plan=plan, no_plan=None, recording=None, place=0.0, playing=False, asked=None)
        self._shelves.set(planned=self._shelves.draft, answer=None, notes=notes_of(plan, self._shelves.draft.steps))

    def tick(self) -> None:
        """Shows how far the planning is, and what came of it; follows the choice of another arm."""
        self._shelves.open()
        if self._planner.is_done:
            self._store.update(busy=None)
            self._shelves.set(progress=None)
            self._finish(*self._planner.pop_result())
        elif self._planner.progress != self._shelves.state.progress:
            self._shelves.set(progress=self._planner.progress)
        elif (
            self._shelves.state.answer is not None
            and self._shelves.state.tone != "bad"
            and is_moving(self._session.status())
        ):
            self._shelves.set(tone="good", answer=None)  # It says where the arm was before it moved.

    def close(self) -> None:
        """Ends what is being planned."""
        self._planner.cancel()

    def _refuse_file(self, why: Message) -> None:
        """Says on every tab why a file was not loaded; on this one it stands until the next file, edit or plan."""
        self._store.complain(FILE_FIELD, why)
        self._store.say("bad", message("program.not_loaded", why=why))

    def _drop_planning(self) -> bool:
        if self._planner.progress is None:
            return False
        self._planner.cancel()
        self._store.update(busy=None)
        self._shelves.set(progress=None)
        return True

    def _was_stretched(self) -> bool:
        """Returns whether the plan of now is slower than the speeds of its program say."""
        plan, slowed = self._store.state.plan, self._store.state.check.slowed
        return slowed is not None and slowed.draft is None and plan is not None and plan.program is not None

    def _finish(self, job: Job, result: Plan | RcilabError) -> None:
        steps = job.draft.steps
        if isinstance(result, RcilabError):
            number = result.waypoint if isinstance(result, PlanningError) else None
            failed = None if number is None else steps[number - 1].key
            self._shelves.set(
                tone="bad", answer=message("plan.failed", error=describe_error(result)), failed=failed, planned=None
            )
            return
        tone, answer, failed = "good", [], None
        if self._was_stretched():
            tone, answer = "warn", [message("program.unslowed")]
        self._store.update(plan=result, no_plan=None, recording=None, place=0.0, playing=False, asked=None)
        if is_led_in(result):
            tone = "warn"
            answer.append(_tell_approach(job, result))
        if result.report.violations:
            number = number_at(result, result.report.violations[0].time) or 0
            failed = steps[number - 1].key if number else None
            where = message("program.at_start") if number == 0 else message("program.waypoint", number=number)
            answer.append(message("program.worst", where=where))
            tone = "bad"
        self._shelves.set(
            planned=job.draft, failed=failed, tone=tone, answer=_together(answer), notes=notes_of(result, steps)
        )


def _tell_approach(job: Job, plan: Plan) -> Message:
    """Returns that the motion begins with the way to the program's start, and how far that is."""
    travel = np.abs(job.here - np.array(job.program.start))
    joint = int(travel.argmax())
    duration = float(plan.motion.segment_starts[1])
    return message("program.approach", joint=joint + 1, angle=float(travel[joint]), duration=f"{duration:.2f}")


def _together(said: list[Message]) -> Message | None:
    """Returns the few sentences about a plan as one message."""
    return reduce(lambda first, second: message("program.both", first=first, second=second), said) if said else None
