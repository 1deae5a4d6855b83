"""The planning of a program from start to end, in another thread than the dispatcher's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from rcilab.app.planning import Plan, build_plan_view
from rcilab.app.program.program_draft import Draft
from rcilab.cell.cell import Cell
from rcilab.cell.plan_free import plan_free
from rcilab.conformance.check import check
from rcilab.control_process.layout import MOTION_ROWS
from rcilab.core.arrays import JointVector
from rcilab.core.background_job import ProgressCallback
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.motion import plan_program
from rcilab.motion.joint import JointLaw
from rcilab.motion.plan_program import FreePlanner
from rcilab.motion.program import Program
from rcilab.motion.program_expansion import expand

PROGRAM_LAW: JointLaw = "torque_rate_limited"
"""Options of programs: they may take a hundredth of their time longer to keep the manual's recommendations."""
_MOTION, _CHECKED = 0.75, 0.8
"""Progress when the motion is planned, and when all but collisions is checked; about as measured."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """A program to plan."""

    model: RobotModel
    draft: Draft
    program: Program
    """The draft, or its first part, in base."""
    frames: Mapping[str, Pose]
    """Pose in base of each frame that waypoints of the draft are in."""
    here: JointVector
    """The arm's position, [rad]."""
    rounds: int
    box: SafetyBox | None
    """The safety box of the check."""
    cell: Cell | None
    """The cell of the check."""


def plan_job(job: Job, progress: ProgressCallback) -> Plan:
    """Returns the plan of a program."""
    motion = plan_program(
        job.model,
        job.program,
        start=job.here,
        rounds=job.rounds,
        law=PROGRAM_LAW,
        progress=lambda part: progress(_MOTION * part),
        max_rows=MOTION_ROWS,
        free=around(job.cell),
    )
    progress(_MOTION)
    report = check(motion, job.model, start=job.here, box=job.box, distance=None)
    plan = as_plan_of(build_plan_view(job.model, motion, report, job.box), job.program, job.frames)
    progress(_CHECKED)
    return plan.completed(cell=job.cell)


def as_plan_of(plan: Plan, program: Program, frames: Mapping[str, Pose]) -> Plan:
    """Returns the plan of a motion as that of a program.

    Args:
        plan: The plan.
        program: Its program, resolved.
        frames: Pose in base of each frame that waypoints are in.
    """
    return replace(plan, program=program, steps=expand(program.waypoints).rows, frames=frames)


def around(cell: Cell | None) -> FreePlanner | None:
    """Returns the planner of motions around the obstacles of a cell; None without one."""
    return None if cell is None else partial(plan_free, cell=cell)
