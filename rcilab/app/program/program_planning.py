"""The planning of a program from beginning to end, as it is done beside the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass, replace

from rcilab.app.planning import Plan, build_plan_view
from rcilab.app.program.program_draft import Draft
from rcilab.conformance.check import check
from rcilab.control_process.layout import MOTION_ROWS
from rcilab.core.arrays import JointVector
from rcilab.core.background_job import ProgressCallback
from rcilab.core.safety_box import SafetyBox
from rcilab.model.robot_model import RobotModel
from rcilab.motion import plan_program
from rcilab.motion.joint import JointLaw
from rcilab.motion.program import Program

PROGRAM_LAW: JointLaw = "torque_rate_limited"
"""How programs run: they may take a hundredth of their time longer to keep what the manual recommends."""
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
    """The safety box to check with."""


def plan_job(job: Job, tell: ProgressCallback) -> Plan:
    """Returns the plan of a program."""
    motion = plan_program(
        job.model,
        job.program,
        start=job.here,
        rounds=job.rounds,
        law=PROGRAM_LAW,
        progress=lambda part: tell(_MOTION * part),
        max_rows=MOTION_ROWS,
    )
    tell(_MOTION)
    report = check(motion, job.model, start=job.here, box=job.box, distance=None)
    plan = replace(build_plan_view(job.model, motion, report, job.box), program=job.program)
    tell(_JUDGED)
    return plan.completed()
