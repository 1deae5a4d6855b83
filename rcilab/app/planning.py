"""From a goal to a checked motion: runs after every change of the goal, many times a second during a drag."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rcilab.cell.cell import Cell
from rcilab.cell.plan_free import plan_free
from rcilab.conformance.check import check
from rcilab.conformance.free_elbow import resulting_motion
from rcilab.core.arrays import Array, JointVector
from rcilab.core.background_job import ProgressCallback
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import RcilabError
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import Pose
from rcilab.core.state import Mode
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Message, message
from rcilab.model.robot_model import RobotModel
from rcilab.motion import plan_arc, plan_joint, plan_line, plan_recovery
from rcilab.motion.joint import JointLaw

if TYPE_CHECKING:
    from rcilab.conformance.report import Report
    from rcilab.motion import Motion, Program

PathType = Literal["joint", "line", "arc", "free"]
PATH_TYPES: tuple[PathType, ...] = get_args(PathType)

SMALLEST_MOTION = 1e-4  # [rad] A goal closer than this to the arm counts as the arm's position.
SAME_BRANCH = 1e-3  # [rad] At a larger distance a line ends in another branch than the requested one.
PATH_POINTS = 120


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """A motion, its report, and the data that views draw."""

    motion: Motion
    report: Report
    model: RobotModel
    """The arm it was checked for, with its tool and load."""
    box: SafetyBox | None = None
    """The safety box it was checked with."""
    cell: Cell | None = None
    """The cell it was checked in, with the tool and the load of `model`."""
    path: Array = field(repr=False)
    """Positions of the tool, shape (N, 3), [m]."""
    effort: Array = field(repr=False)
    """Utilisation of the velocity limit by the busiest joint at each of these positions, 0 to 1, shape (N,)."""
    missed_by: Message | None = None
    """How far from the target it ends, as a message; None if it reaches the target."""
    program: Program | None = None
    """The program of the motion, in base; None if it leads to the goal."""
    steps: tuple[int, ...] = ()
    """Number of the program's step, from 1, of each segment of a round."""
    frames: Mapping[str, Pose] = field(default_factory=dict[str, Pose])
    """Pose in base of each frame that waypoints of the program are in."""
    mode: Mode = "joint_position"
    """The mode it was checked for."""
    kind: PathType = "joint"
    """Path type, if it is not a program."""
    note: Message | None = None
    """Further message about its end."""
    complete: bool = False
    """Whether collisions were checked, too. Not during a drag: the check would halve the rate."""
    is_recorded: bool = False
    """Whether it is what a client commanded: after its last row, the controller commands the arm."""
    planned: Motion | None = None
    """The motion as planned, where the joints of the mode will move otherwise; None: as `motion`."""

    @property
    def as_planned(self) -> Motion:
        """The motion as planned, in any mode."""
        return self.motion if self.planned is None else self.planned

    @property
    def away(self) -> float:
        """Largest distance at the end of the joints from where they were planned, [rad]; 0 as planned."""
        return 0.0 if self.planned is None else float(np.abs(self.motion.goal - self.planned.goal).max())

    @property
    def starts_at(self) -> JointVector:
        """Joint angles at which it must be executed, [rad]."""
        return self.motion.start

    def completed(self, mode: Mode = "joint_position", cell: Cell | None = None) -> Plan:
        """Returns this plan with a report on all conditions of a mode, with collisions, as execution requires it.

        Args:
            mode: The mode.
            cell: The cell, with the tool and the load of `model`.
        """
        if self.complete and self.mode == mode and self.cell is cell:
            return self
        planned = self.as_planned
        motion = resulting_motion(planned, self.model, mode)
        if len(motion) < len(planned):
            motion = planned  # The report names the pose that is out of reach.
        report = check(motion, self.model, box=self.box, cell=cell, mode=mode)
        if motion is self.motion:
            return replace(self, report=report, cell=cell, mode=mode, complete=True)
        drawn = build_plan_view(self.model, motion, report, self.box)
        of_mode = replace(self, motion=motion, report=report, path=drawn.path, effort=drawn.effort)
        return replace(of_mode, cell=cell, mode=mode, complete=True, planned=None if motion is planned else planned)

    def stale_parts(self, model: RobotModel, box: SafetyBox | None) -> tuple[str, ...]:
        """Returns what has changed since the plan was checked, as in certificates: tool, load, joint limits, box.

        Args:
            model: The current arm.
            box: The current safety box; without one, a plan that was checked with a box still holds.
        """
        then, now = self.model.fingerprint, model.fingerprint
        changed = [part for part in ("tool", "load") if then[part] != now[part]]
        bound, checked = active_box(box), active_box(self.box)
        if bound is None:
            is_changed = checked is not None and any(v.condition.signal == "position" for v in self.report.violations)
        else:
            is_changed = checked is None or not _is_same_box(bound, checked)
        if is_changed:
            changed.append("box")
        if then["limits"] != now["limits"]:
            changed.append("joints")
        return tuple(changed)


def moved_frames(plan: Plan, cell: Cell | None) -> tuple[str, ...]:
    """Returns the names of the frames of a plan's program that are elsewhere in the cell, or no longer in it."""
    now = cell.frame_poses if cell is not None and plan.frames else {}
    return tuple(name for name, pose in plan.frames.items() if name not in now or not pose.is_close(now[name]))


def tool_path(model: RobotModel, motion: Motion) -> Array:
    """Returns the positions of the tool at `PATH_POINTS` times of a motion, shape (N, 3), [m]."""
    return model.position_path(motion.q[sampled_rows(motion)])


def make_plan(
    model: RobotModel,
    start: JointVector,
    goal: JointVector,
    speed: float,
    law: JointLaw,
    box: SafetyBox | None = None,
    kind: PathType = "joint",
    via: Pose | None = None,
    cell: Cell | None = None,
    progress: ProgressCallback | None = None,
) -> Plan | Message:
    """Returns a motion from start to goal, checked except for collisions, or why planning failed.

    A motion of the kind "free" leads around the obstacles of a cell; `progress` receives the used share of its time.
    """
    outside = explain_outside(model, "start", start) or explain_outside(model, "goal", goal)
    if outside is not None:
        return outside
    if float(np.abs(goal - start).max()) < SMALLEST_MOTION:
        return message("plan.here")
    if kind == "arc" and via is None:
        return message("plan.no_via")
    try:
        if kind == "free":
            around = Cell(model=model.name) if cell is None else cell
            motion = plan_free(model, start, goal, around, speed=speed, law=law, progress=progress)
        else:
            motion = _go(model, start, goal, speed, law, kind, via)
        report = check(motion, model, start=start, box=box, distance=None)
    except RcilabError as error:
        return message("plan.failed", error=describe_error(error))
    away = int(np.abs(motion.goal - goal).argmax())
    note = None
    if abs(float(motion.goal[away] - goal[away])) > SAME_BRANCH:
        note = message("plan.other_branch", joint=away + 1)
    return replace(build_plan_view(model, motion, report, box), kind=kind, note=note)


def make_recovery(model: RobotModel, start: JointVector, box: SafetyBox | None = None) -> Plan | Message:
    """Returns the motion that leads joints and tool back inside, checked except for collisions, or why none does."""
    try:
        motion = plan_recovery(model, start, box)
        report = check(motion, model, start=start, box=box, distance=None)
    except RcilabError as error:
        return message("plan.failed", error=describe_error(error))
    return build_plan_view(model, motion, report, box)


def find_outside(model: RobotModel, q: JointVector) -> int | None:
    """Returns the first joint, from 1, that is not strictly inside its range; None if all are."""
    outside = np.flatnonzero(~((model.limits.joint.lower < q) & (q < model.limits.joint.upper)))
    return int(outside[0]) + 1 if outside.size else None


def explain_outside(model: RobotModel, place: Literal["start", "goal"], q: JointVector) -> Message | None:
    """Returns why no motion can start or end at joint angles, shape (n,), [rad]: a joint is out of its range."""
    joint = find_outside(model, q)
    if joint is None:
        return None
    limits, angle = model.limits.joint, float(q[joint - 1])
    soft = limits.exceeded_soft_limit(joint, angle)
    low, high = float(limits.lower[joint - 1]), float(limits.upper[joint - 1])
    if soft is not None:
        code = "plan.start_soft" if place == "start" else "plan.at_soft"
        return message(code, joint=joint, angle=angle, limit=soft)
    if place == "start":
        return message("plan.start_limit", joint=joint)
    if low <= angle <= high:
        return message("plan.at_limit", joint=joint)
    return message("plan.beyond_limit", joint=joint, angle=angle, low=low, high=high)


def _go(
    model: RobotModel,
    start: JointVector,
    goal: JointVector,
    speed: float,
    law: JointLaw,
    kind: PathType,
    via: Pose | None,
) -> Motion:
    if kind == "joint":
        return plan_joint(model, start, goal, speed=speed, law=law)
    target, psi = model.forward(goal), model.arm_angle(goal) if model.redundancy else None
    if kind == "line" or via is None:
        return plan_line(model, start, target, speed=speed, psi=psi, law=law)
    return plan_arc(model, start, via, target, speed=speed, psi=psi, law=law)


def build_plan_view(model: RobotModel, motion: Motion, report: Report, box: SafetyBox | None = None) -> Plan:
    """Returns a checked motion with the data that views draw."""
    effort = np.abs(motion.dq[sampled_rows(motion)] / model.limits.joint.velocity).max(axis=1)
    return Plan(motion=motion, report=report, path=tool_path(model, motion), effort=effort, model=model, box=box)


def sampled_rows(motion: Motion) -> NDArray[np.intp]:
    """Returns the rows of a motion at `PATH_POINTS` times, with the first and the last."""
    times = np.linspace(0.0, motion.duration, PATH_POINTS)
    return np.minimum((times / CYCLE_TIME).astype(np.intp), len(motion.times) - 1)


def _is_same_box(a: SafetyBox, b: SafetyBox) -> bool:
    return a.size == b.size and a.T_base_box.is_close(b.T_base_box, 0.0)
