"""Slows a plan down until it conforms; each try is checked, so this takes some time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rcilab.app.goal.goal_actions import SLOWEST
from rcilab.app.planning import Plan, build_plan_view, make_plan
from rcilab.app.program.program_draft import Draft
from rcilab.app.program.program_planning import PROGRAM_LAW, around, as_plan_of
from rcilab.conformance.check import check
from rcilab.core.background_job import ProgressCallback
from rcilab.motion import plan_program
from rcilab.motion.waypoint import Waypoint

if TYPE_CHECKING:
    from rcilab.conformance.time_scaling import SlowDown
    from rcilab.core.spatial import Pose
    from rcilab.motion.joint import JointLaw

_TRIES = 2
_FURTHER = 0.9
"""Steps by which the next try is slower if the speed for the factor is not slow enough. Tuning values."""
_FOUND = 0.5  # Share of the progress at which the factor is known; about as measured.


@dataclass(frozen=True, eq=False, kw_only=True)
class SlowdownJob:
    """Result of a slow-down."""

    found: SlowDown
    plan: Plan | None = None
    """The slowed plan; None if none conforms."""
    scale: float = 1.0
    """Factor of the speed, or of every speed of the program."""
    draft: Draft | None = None
    """The slowed program."""
    is_stretched: bool = False
    """Whether the whole curve is slowed down, because no speed is slow enough: the speed does not bound the jerk."""


def slow_to_goal(plan: Plan, speed: float, law: JointLaw, via: Pose | None, progress: ProgressCallback) -> SlowdownJob:
    """Returns a new plan to the same goal, on the same kind of path, at the highest speed that conforms."""
    start, goal, kind = plan.motion.start, plan.motion.goal, plan.kind

    def make(scale: float) -> Plan | None:
        made = make_plan(plan.model, start, goal, scale * speed, law, plan.box, kind, via, plan.cell)
        return replace(made, missed_by=plan.missed_by).completed(cell=plan.cell) if isinstance(made, Plan) else None

    return _slower(plan, make, SLOWEST / speed, progress)


def slow_program(plan: Plan, draft: Draft, rounds: int, progress: ProgressCallback) -> SlowdownJob:
    """Returns the plan of the same program with every speed scaled by the largest factor that conforms."""
    planned = plan.program
    assert planned is not None  # It is the plan of a program.
    waypoints = planned.waypoints
    drafts: dict[float, Draft] = {}

    def make(scale: float) -> Plan | None:
        drafts[scale] = scaled(draft, scale)
        program = replace(planned, waypoints=tuple(slowed(waypoint, scale) for waypoint in waypoints))
        motion = plan_program(
            plan.model, program, start=plan.motion.start, rounds=rounds, law=PROGRAM_LAW, free=around(plan.cell)
        )
        report = check(motion, plan.model, start=plan.motion.start, box=plan.box, distance=None)
        view = build_plan_view(plan.model, motion, report, plan.box)
        return as_plan_of(view, program, plan.frames).completed(cell=plan.cell)

    slowest = min((step.waypoint.speed for step in draft.steps if not step.waypoint.is_instruction), default=1.0)
    result = _slower(plan, make, SLOWEST / slowest, progress)
    return result if result.is_stretched else replace(result, draft=drafts.get(result.scale))


def scaled(draft: Draft, scale: float) -> Draft:
    """Returns a program with every speed scaled."""
    steps = tuple(replace(step, waypoint=slowed(step.waypoint, scale)) for step in draft.steps)
    return replace(draft, steps=steps)


def slowed(waypoint: Waypoint, scale: float) -> Waypoint:
    """Returns a waypoint with its speed scaled; an instruction has none."""
    return waypoint if waypoint.is_instruction else replace(waypoint, speed=scale * waypoint.speed)


def _slower(plan: Plan, make: Callable[[float], Plan | None], least: float, progress: ProgressCallback) -> SlowdownJob:
    recommended = plan.report.ok
    found = plan.completed(cell=plan.cell).report.slow_down(
        recommended=recommended, progress=lambda part: progress(_FOUND * part)
    )
    progress(_FOUND)
    if found.factor is None or found.factor <= 1.0:
        return SlowdownJob(found=found)
    wanted = {row.id for row in found.report.rows if row.ok} if found.report is not None else set[str]()
    scale = 1.0 / found.factor
    for attempt in range(_TRIES):
        made = make(scale) if scale >= least else None
        progress(_FOUND + (1.0 - _FOUND) * (attempt + 1) / _TRIES)
        if made is not None and made.report.ok and all(row.ok for row in made.report.rows if row.id in wanted):
            return SlowdownJob(found=found, plan=made, scale=scale)
        scale *= _FURTHER
    assert found.motion is not None
    assert found.report is not None
    whole = build_plan_view(plan.model, found.motion, found.report, plan.box)
    whole = replace(whole, missed_by=plan.missed_by, program=plan.program, steps=plan.steps, frames=plan.frames)
    whole = replace(whole, cell=plan.cell, complete=True)
    return SlowdownJob(found=found, plan=whole, scale=1.0 / found.factor, is_stretched=True)
