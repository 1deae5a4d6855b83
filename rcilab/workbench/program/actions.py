"""What happens when somebody edits, plans or loads a program. Owned by the conductor's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from rcilab.arrays import JointVector, frozen
from rcilab.errors import InvalidValueError, PlanningError, RcilabError, VersionMismatchError
from rcilab.motion.program import Program, Waypoint
from rcilab.motion.program_file import read_program
from rcilab.posing.planning import Plan
from rcilab.words.number import parse_number
from rcilab.workbench import requests
from rcilab.workbench.background import Background
from rcilab.workbench.goal.actions import GoalActions
from rcilab.workbench.program.draft import (
    MOST_ROUNDS,
    TYPES,
    Draft,
    ProgramState,
    draft_of,
    is_led_in,
    number_at,
    target_of,
    time_at,
)
from rcilab.workbench.program.fields import default_via, proposed
from rcilab.workbench.program.planning import Job, plan_job
from rcilab.workbench.run.readiness import is_moving
from rcilab.workbench.session import Session
from rcilab.workbench.store import Store
from rcilab.workbench.text import Message, message

_UNDO_DEPTH = 200
_LONGEST_NAME = 80


@dataclass
class _Shelf:
    """What belongs to one arm's program while another arm is chosen, and what can be undone in it."""

    state: ProgramState
    past: list[Draft] = field(default_factory=list)
    future: list[Draft] = field(default_factory=list)


class ProgramActions:
    """Edits with undo, planning beside this thread, files; one program for each arm, none is ever dropped."""

    def __init__(self, store: Store, session: Session, goal: GoalActions) -> None:
        self._store, self._session, self._goal = store, session, goal
        self._planner: Background[Job, Plan | Message] = Background("program")
        self._shelves: dict[str, _Shelf] = {}
        self._edits: dict[str, Callable[[requests.EditProgram, int], None]] = {
            "select": self._select, "teach": self._teach, "via": self._via, "type": self._retype,
            "delete": self._delete, "duplicate": self._duplicate, "aim": self._aim,
            "up": lambda request, key: self._move(key, -1), "down": lambda request, key: self._move(key, 1),
            "move": self._move_to,
        }  # fmt: skip

    def edit(self, request: requests.EditProgram) -> None:
        """Changes the program, or what of it is selected; what nobody can do just now is said."""
        self._open()
        whole = {
            "add": lambda: self._add(request), "start": self._start_here, "undo": self._undo, "redo": self._redo,
            "clear": lambda: self._change(Draft(model=self._draft.model), None),
            "tool": lambda: self._change(replace(self._draft, tool=None), self._program.selected),
            "script": lambda: self._set(is_script_shown=not self._program.is_script_shown),
        }  # fmt: skip
        if request.what in whole:
            whole[request.what]()
            return
        key = self._program.selected if request.key is None else request.key
        if key is None or self._draft.place(key) is None:
            self._store.say("warn", message("program.select"))
            return
        self._edits[request.what](request, key)

    def type_field(self, request: requests.TypeField) -> None:
        """Takes what was typed about a step, the rounds or the name, or says beside the field what is wrong with it."""
        self._open()
        _, key, name = (*request.field.split("."), "", "")[:3]
        waypoint = self._draft.waypoint(int(key)) if key.isdecimal() else None
        if name == "name":
            self._rename(request)
        elif name == "rounds":
            parsed = parse_number(request.text, 1, MOST_ROUNDS, "")
            if parsed.value is not None and parsed.value != round(parsed.value):
                self._answer(request.field, message("program.whole", typed=request.text[:40]))
            elif self._answer(request.field, parsed.problem) and parsed.value is not None:
                self._drop_planning()
                self._set(rounds=int(parsed.value), planned=None, answer=None)
        elif waypoint is not None:
            made = proposed(waypoint, name, request.text, self._draft.arm(self._store.state.model))
            if made is not None and self._answer(request.field, made if isinstance(made, Message) else None):
                assert isinstance(made, Waypoint)
                self._change(self._draft.changed(int(key), made), int(key))

    def plan(self, request: requests.PlanProgram) -> None:
        """Plans the program, or the part of it up to the selected step, from where the arm stands."""
        self._open()
        state, status = self._store.state, self._session.status()
        upto = self._program.selected if request.upto else None
        program = self._draft.program(state.model, upto)
        reason = (
            "notice.moving" if is_moving(status) else "plan.no_arm" if status.q_c is None
            else "program.empty" if program is None else "program.select" if request.upto and upto is None else None
        )  # fmt: skip
        if reason is not None:
            self._store.say("warn", message(reason))
            return
        assert program is not None
        assert status.q_c is not None
        job = Job(
            model=self._draft.arm(state.model),
            draft=self._draft,
            program=program,
            here=frozen(status.q_c),
            rounds=self._program.rounds,
            box=state.setup.wanted.box,
        )
        self._planner.start(job, partial(plan_job, job))
        self._store.update(busy=message("program.planning"))
        self._set(progress=0.0, answer=None, failed=None)

    def cancel(self, request: requests.CancelProgram) -> None:
        """Drops the planning that is under way; the plan there was before stays."""
        if self._planner.progress is not None:
            self._drop_planning()
            self._set(tone="warn", answer=message("program.cancelled"))

    def load(self, request: requests.LoadProgram) -> None:
        """Takes a program from a file, or says beside the button what is wrong; undo brings the old one back."""
        self._open()
        try:
            program = read_program(request.content, request.name[:_LONGEST_NAME] or "program")
        except (InvalidValueError, VersionMismatchError) as error:
            self._answer("program.0.file", message("program.file_bad", error=str(error)))
            return
        model = self._store.state.model.name
        if program.model != model:
            self._answer(
                "program.0.file",
                message("program.file_other", file=request.name[:_LONGEST_NAME], theirs=program.model, ours=model),
            )
            return
        self._answer("program.0.file", None)
        draft = draft_of(program, self._store.state.model)
        self._change(draft, draft.steps[0].key)
        self._store.say("good", message("program.loaded", count=len(draft.steps), name=request.name[:_LONGEST_NAME]))

    def restore(self, program: Program) -> None:
        """Takes a program that was here before."""
        self._open()
        draft = draft_of(program, self._store.state.model)
        self._change(draft, draft.steps[0].key)

    def exchange(self, draft: Draft, plan: Plan) -> None:
        """Takes a changed program that has been planned already; undo brings the old one back."""
        self._open()
        self._change(draft, self._program.selected)
        self.keep_plan(plan)

    def keep_plan(self, plan: Plan) -> None:
        """Takes the plan of the program as it is."""
        self._store.update(plan=plan, no_plan=None, recording=None, place=0.0, playing=False, asked=None)
        self._set(planned=self._draft, answer=None)

    def tick(self) -> None:
        """Shows how far the planning is, and what came of it; follows the choice of another arm."""
        self._open()
        if self._planner.is_done:
            self._store.update(busy=None)
            self._set(progress=None)
            self._finish(*self._planner.take())
        elif self._planner.progress != self._program.progress:
            self._set(progress=self._planner.progress)

    def close(self) -> None:
        """Ends what is being planned."""
        self._planner.cancel()

    @property
    def _program(self) -> ProgramState:
        return self._store.state.program

    @property
    def _draft(self) -> Draft:
        return self._store.state.program.draft

    @property
    def _shelf(self) -> _Shelf:
        return self._shelves[self._draft.model]

    def _set(self, **changes: Any) -> None:
        self._store.update(program=replace(self._program, **changes))

    def _open(self) -> None:
        """Takes out the program of the arm that is chosen, and keeps that of the other one."""
        left, model = self._draft, self._store.state.model.name
        if left.model == model:
            return
        self._drop_planning()
        if left.model:
            self._shelf.state = replace(self._program, planned=None)
        found = self._shelves.setdefault(model, _Shelf(ProgramState(draft=Draft(model=model))))
        self._store.update(program=found.state)
        if left.steps:
            self._store.say("good", message("program.kept", count=len(left.steps), model=left.model))
        elif found.state.draft.steps:
            self._store.say("good", message("program.back", count=len(found.state.draft.steps), model=model))

    def _change(self, draft: Draft, selected: int | None) -> None:
        """Exchanges the program; what it was can be had back."""
        shelf = self._shelf
        shelf.past, shelf.future = [*shelf.past[-_UNDO_DEPTH:], self._draft], []
        self._exchange(draft, selected)

    def _exchange(self, draft: Draft, selected: int | None) -> None:
        is_dropped, shelf = self._drop_planning(), self._shelf
        if draft.place(selected) is None:
            selected = draft.steps[-1].key if draft.steps else None
        self._set(
            draft=draft, selected=selected, can_undo=bool(shelf.past), can_redo=bool(shelf.future), failed=None,
            tone="warn", answer=message("program.changed") if is_dropped else None,
        )  # fmt: skip
        self._forget_problems("program.")

    def _undo(self) -> None:
        if self._shelf.past:
            self._shelf.future.append(self._draft)
            self._exchange(self._shelf.past.pop(), self._program.selected)

    def _redo(self) -> None:
        if self._shelf.future:
            self._shelf.past.append(self._draft)
            self._exchange(self._shelf.future.pop(), self._program.selected)

    def _drop_planning(self) -> bool:
        if self._planner.progress is None:
            return False
        self._planner.cancel()
        self._store.update(busy=None)
        self._set(progress=None)
        return True

    def _answer(self, name: str, problem: Message | None) -> bool:
        """Says what is wrong with what was typed; returns whether nothing is."""
        if problem is None:
            self._forget_problems(name)
            self._store.update(typed=self._store.state.typed + 1)
            return True
        self._store.update(problems=MappingProxyType({**self._store.state.problems, name: problem}))
        return False

    def _forget_problems(self, prefix: str) -> None:
        kept = {k: v for k, v in self._store.state.problems.items() if not k.startswith(prefix)}
        self._store.update(problems=MappingProxyType(kept))

    def _rename(self, request: requests.TypeField) -> None:
        name = request.text.strip()
        good = name.isprintable() and len(name) <= _LONGEST_NAME
        if self._answer(request.field, None if good else message("program.name_bad", most=_LONGEST_NAME)):
            self._change(replace(self._draft, name=name), self._program.selected)

    def _configuration(self, source: str) -> JointVector | None:
        """Returns the joint angles of the arm or of the goal; what they lack is said."""
        state, here = self._store.state, self._session.status().q_c
        if source == "target":
            if state.goal.reach.short is not None:
                self._store.say("warn", message("program.short", short=state.goal.reach.short))
            return state.goal.q
        if here is None:
            self._store.say("warn", message("plan.no_arm"))
        return here

    def _add(self, request: requests.EditProgram) -> None:
        q = self._configuration(request.source)
        if q is None:
            return
        draft, chosen = self._draft, self._draft.waypoint(self._program.selected)
        if draft.start is None:
            here = self._session.status().q_c
            draft = replace(draft, start=tuple((q if here is None else here).tolist()))
        waypoint = Waypoint(type="joint", q=tuple(q.tolist()))
        if chosen is not None:
            waypoint = replace(waypoint, speed=chosen.speed, blend=chosen.blend)
            waypoint = replace(waypoint, type="line" if chosen.type != "joint" else "joint")
        self._change(*draft.inserted(waypoint, self._program.selected))

    def _start_here(self) -> None:
        q = self._configuration("here")
        if q is not None and self._draft.steps:
            self._change(replace(self._draft, start=tuple(q.tolist())), self._program.selected)

    def _select(self, request: requests.EditProgram, key: int) -> None:
        """Chooses a step; while the plan is of this program, the preview goes there."""
        if key != self._program.selected:
            self._forget_problems("program.")
        self._set(selected=key)
        state, place = self._store.state, self._draft.place(key)
        plan = state.plan
        if plan is None or plan.program is None or place is None or self._program.planned is not self._draft:
            return
        if place < len(plan.program.waypoints):
            self._store.update(place=time_at(plan, place + 1) / max(plan.motion.duration, 1e-3), playing=False)

    def _teach(self, request: requests.EditProgram, key: int) -> None:
        q, waypoint = self._configuration(request.source), self._draft.waypoint(key)
        if q is None or waypoint is None:
            return
        if waypoint.type not in TYPES:
            self._store.say("warn", message("program.no_target"))
            return
        taught = replace(waypoint, q=tuple(q.tolist()), position=None, wxyz=None, psi=None)
        self._change(self._draft.changed(key, taught), key)

    def _via(self, request: requests.EditProgram, key: int) -> None:
        q, waypoint = self._configuration(request.source), self._draft.waypoint(key)
        if q is None or waypoint is None or waypoint.type != "arc":
            return
        pose = self._draft.arm(self._store.state.model).forward(q)
        via = replace(waypoint, via=tuple(pose.position.tolist()), via_wxyz=tuple(pose.wxyz.tolist()))
        self._change(self._draft.changed(key, via), key)

    def _retype(self, request: requests.EditProgram, key: int) -> None:
        waypoint = self._draft.waypoint(key)
        if waypoint is None or request.type == waypoint.type or request.type not in TYPES:
            return
        if waypoint.type not in TYPES:
            self._store.say("warn", message("program.no_target"))
            return
        via = None
        if request.type == "arc":
            via = default_via(self._draft, key, self._draft.arm(self._store.state.model))
            if via is None:
                self._store.say("warn", message("program.no_way"))
                return
            self._store.say("good", message("program.via_made"))
        self._change(self._draft.changed(key, waypoint.retyped(request.type, via)), key)

    def _delete(self, request: requests.EditProgram, key: int) -> None:
        place = self._draft.place(key) or 0
        draft = self._draft.without(key)
        left = draft.steps[min(place, len(draft.steps) - 1)].key if draft.steps else None
        self._change(draft, left)

    def _duplicate(self, request: requests.EditProgram, key: int) -> None:
        waypoint = self._draft.waypoint(key)
        assert waypoint is not None
        self._change(*self._draft.inserted(waypoint, key))

    def _move(self, key: int, step: int) -> None:
        place = self._draft.place(key)
        if place is not None and 0 <= place + step < len(self._draft.steps):
            self._change(self._draft.moved(key, place + step), key)

    def _move_to(self, request: requests.EditProgram, key: int) -> None:
        if self._draft.place(key) != request.place:
            self._change(self._draft.moved(key, request.place), key)

    def _aim(self, request: requests.EditProgram, key: int) -> None:
        waypoint = self._draft.waypoint(key)
        assert waypoint is not None
        model = self._store.state.model
        arm = self._draft.arm(model)
        target = target_of(waypoint, arm)
        if target is None:
            self._store.say("warn", message("program.no_target"))
            return
        if arm is not model:
            target = target @ arm.T_flange_tool.inverse() @ model.T_flange_tool
        self._goal.lead_to(target, waypoint.psi, None if waypoint.q is None else frozen(waypoint.q))

    def _finish(self, job: Job, result: Plan | Message | RcilabError) -> None:
        steps = job.draft.steps
        if isinstance(result, Message):
            self._set(tone="bad", answer=result, failed=None, planned=None)
            return
        if isinstance(result, RcilabError):
            number = result.waypoint if isinstance(result, PlanningError) else None
            failed = None if number is None else steps[number - 1].key
            self._set(tone="bad", answer=message("plan.failed", error=str(result)), failed=failed, planned=None)
            return
        self._store.update(plan=result, no_plan=None, recording=None, place=0.0, playing=False, asked=None)
        tone, answer, failed = "good", [], None
        if is_led_in(result):
            tone, answer = "warn", [_tell_approach(job, result)]
        if result.motion.notes:
            tone = "warn"
            answer.append(message("program.notes", text="; ".join(result.motion.notes)))
        if result.report.violations:
            number = number_at(result, result.report.violations[0].time) or 0
            failed = steps[number - 1].key if number else None
            where = message("program.at_start") if number == 0 else message("program.waypoint", number=number)
            answer.append(message("program.worst", where=where))
            tone = "bad"
        self._set(planned=job.draft, failed=failed, tone=tone, answer=_together(answer))


def _tell_approach(job: Job, plan: Plan) -> Message:
    """Returns that the motion begins with the way to the program's start, and how far that is."""
    travel = np.degrees(np.abs(job.here - np.array(job.program.start)))
    joint = int(travel.argmax())
    duration = float(plan.motion.segment_starts[1])
    return message("program.approach", joint=joint + 1, angle=f"{travel[joint]:.1f}", duration=f"{duration:.2f}")


def _together(said: list[Message]) -> Message | None:
    if len(said) < 2:
        return said[0] if said else None
    return message("program.both", first=said[0], second=_together(said[1:]))
