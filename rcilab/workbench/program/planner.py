"""Programs planned beside the conductor's thread: long ones take seconds, and the page goes on."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace

from rcilab.arrays import JointVector
from rcilab.errors import RcilabError
from rcilab.model import RobotModel
from rcilab.motion.program import Program
from rcilab.posing.planning import Plan, picture
from rcilab.safety_box import SafetyBox
from rcilab.supervisor.layout import MOTION_TIME
from rcilab.workbench.program.draft import Draft
from rcilab.workbench.text import Message, message

_MOTION, _JUDGED = 0.75, 0.8
"""Parts of the work when the motion is made, and when all but collisions has been looked at; about what was seen."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """What is to be planned."""

    model: RobotModel
    draft: Draft
    program: Program
    """The draft, or the first part of it."""
    here: JointVector
    """Where the arm stands, [rad]."""
    rounds: int
    box: SafetyBox | None
    """The safety box to judge with."""


class _Cancelled(Exception):
    """Nobody wants the result any more."""


class ProgramPlanner:
    """One planning at a time. Owned by the conductor's thread, which asks for the result at every tick."""

    def __init__(self) -> None:
        self._work: _Work | None = None

    @property
    def job(self) -> Job | None:
        """What is being planned."""
        return None if self._work is None else self._work.job

    @property
    def progress(self) -> float | None:
        """How much of it is done, 0 to 1; None where nothing is being planned."""
        return None if self._work is None else self._work.progress

    def start(self, job: Job) -> None:
        """Begins; what was being planned is dropped."""
        self.cancel()
        self._work = _Work(job)
        threading.Thread(target=self._work.run, name="program", daemon=True).start()

    def cancel(self) -> None:
        """Drops what is being planned, at once; its thread ends when it comes to know."""
        if self._work is not None:
            self._work.unwanted.set()
        self._work = None

    @property
    def is_done(self) -> bool:
        """Whether there is something to take."""
        return self._work is not None and self._work.done.is_set()

    def take(self) -> tuple[Job, Plan | Message | RcilabError]:
        """Returns what was planned, or why it could not be, once it is done."""
        work, self._work = self._work, None
        assert work is not None
        if isinstance(work.result, Plan | Message | RcilabError):
            return work.job, work.result
        assert work.result is not None
        raise work.result


class _Work:
    """One planning in its thread."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self.progress = 0.0
        self.unwanted, self.done = threading.Event(), threading.Event()
        self.result: Plan | Message | Exception | None = None

    def run(self) -> None:
        try:
            self.result = self._plan()
        except Exception as error:  # The conductor tells it, or raises it where its bugs are counted.
            self.result = error
        self.done.set()

    def _plan(self) -> Plan | Message:
        from rcilab.conformance import check
        from rcilab.motion import plan_program

        job = self.job
        motion = plan_program(
            job.model, job.program, start=job.here, rounds=job.rounds, progress=lambda part: self._tell(_MOTION * part)
        )
        self._tell(_MOTION)
        if motion.duration > MOTION_TIME:
            return message("program.long", duration=f"{motion.duration:.0f}", most=f"{MOTION_TIME:.0f}")
        report = check(motion, job.model, start=job.here, box=job.box, distance=None)
        plan = replace(picture(job.model, motion, report, job.box), program=job.program)
        self._tell(_JUDGED)
        return plan.completed()

    def _tell(self, part: float) -> None:
        if self.unwanted.is_set():
            raise _Cancelled
        self.progress = part
