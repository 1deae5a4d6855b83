"""Targets become sections: geometry, joint angles and bounds, computed in slices that fit into a cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import tau

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import (
    InvalidValueError,
    KinematicsError,
    PlanningError,
    RcilabError,
    SingularError,
    UnreachableError,
)
from rcilab.core.limits import JointLimits, Limits
from rcilab.core.spatial import Pose, rotation_between
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import angle_text
from rcilab.motion.path import Path, build_arc, build_circle, build_line, circle_through
from rcilab.sim.planner.guide import Guide
from rcilab.sim.planner.planner_event import Refusal, RefusalReason
from rcilab.sim.planner.pose_spline import PoseSpline, without_repetitions
from rcilab.sim.planner.section import (
    CurveSection,
    JointSection,
    PoseSolver,
    Section,
    ToolSection,
    intervals_of,
)
from rcilab.sim.planner.section_bounds import (
    ShareBounds,
    bounds_of_line,
    bounds_of_samples,
    joint_bounds,
    slower,
    strictest,
    tool_bounds,
)
from rcilab.sim.planner.target import ArcTarget, JointSpeed, JointTarget, LineTarget, PauseTarget, Target, ToolSpeed

_SLICE = 6  # Samples in one cycle: about 0.3 ms.
_LARGEST_STEP = 0.6  # [rad] A joint that moves farther between two samples of a path changes its branch.
_STANDSTILL = 1e-9  # [m], [rad] A shorter path has no motion.


@dataclass(frozen=True, slots=True, eq=False)
class PlannedArm:
    """The arm of a planner."""

    model: RobotModel
    """With its tool."""
    limits: Limits
    solver: PoseSolver
    slows_down: bool
    """Whether a path of the tool is followed more slowly where the joints would exceed their limits."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PreparedTarget:
    """A target that can begin."""

    target: Target
    section: Section | None
    """None for one that does not move."""
    bounds: tuple[ShareBounds, ...] = ()
    length: float = 0.0
    """Path length, [m], or for turns and joints [rad]."""
    goal: tuple[float, ...]
    """Joint angles at the end, [rad]."""
    speed: ToolSpeed | JointSpeed | None = None


class Sampling:
    """Joint angles along a section, computed in slices.

    Attributes:
        refusal: Why the section cannot be followed; None: nothing is known against it.

    Args:
        section: The path.
        start: Joint angles at its start, [rad].
        limits: Range of the joints.
    """

    def __init__(self, section: Section, start: Sequence[float], limits: JointLimits) -> None:
        self._section = section
        self._ends = list(zip(limits.lower.tolist(), limits.upper.tolist(), strict=True))
        self.rows: list[list[float]] = [list(start)]
        self._tool: list[list[float]] = []
        self._last_pose: Pose | None = None
        self.refusal: Refusal | None = None

    @property
    def is_done(self) -> bool:
        """Whether all samples are there, or none are needed any more."""
        return self.refusal is not None or len(self.rows) > self._section.intervals

    @property
    def tool(self) -> Array | None:
        """Position and turned angles of the tool at the samples, shape (N + 1, 6); None for a path of the joints."""
        return np.array(self._tool) if self._tool else None

    def advance(self) -> None:
        """Computes the next slice."""
        section = self._section
        for _ in range(_SLICE):
            if self.is_done:
                return
            share = len(self.rows) / section.intervals
            near = self.rows[-1]
            try:
                if not self._tool:
                    self._add_pose(section.at(0.0, near).pose)
                q, pose = section.at(share, near)
            except KinematicsError as error:
                of_end = self._error_at_end(near)
                self.refusal = refusal_of(error, share) if of_end is None else refusal_of(of_end, 1.0)
                return
            self._add_pose(pose)
            self.refusal = find_outside(q, self._ends, share) or find_jump(near, q, share)
            of_end = None if self.refusal is None else self._error_at_end(near)
            if isinstance(of_end, UnreachableError) and of_end.distance > 0.0:  # In any range of the joints.
                self.refusal = refusal_of(of_end, 1.0)
            self.rows.append(q)

    def _error_at_end(self, near: Sequence[float]) -> KinematicsError | None:
        """Returns why the end of the section has no joint angles; None: it has."""
        try:
            self._section.at(1.0, near)
        except KinematicsError as error:
            return error
        return None

    def _add_pose(self, pose: Pose | None) -> None:
        if pose is None:
            return
        turned = [0.0, 0.0, 0.0]
        if self._last_pose is not None:
            turn = rotation_between(self._last_pose.parts[0], pose.parts[0])
            turned = [a + b for a, b in zip(self._tool[-1][3:], turn, strict=True)]
        self._tool.append([*pose.parts[1], *turned])
        self._last_pose = pose


class Preparation:
    """Prepares one target, one slice a cycle. Owned by the planner.

    Attributes:
        result: The prepared target, or why it is refused; None until it is done.

    Args:
        arm: The arm.
        target: The target.
        start: Joint angles at its start, n plain floats, [rad].
    """

    def __init__(self, arm: PlannedArm, target: Target, start: Sequence[float]) -> None:
        self._arm, self.target, self._start = arm, target, list(start)
        self._section: CurveSection | None = None
        self._length = 0.0
        self._line: tuple[float, float] | None = None  # Distances of tool and orientation; None: not uniform.
        self._sampling: Sampling | None = None
        self.result: PreparedTarget | Refusal | None = None

    def advance(self) -> None:
        """Computes the next slice."""
        sampling = self._sampling
        if sampling is None:
            try:
                self._begin()
            except KinematicsError as error:
                self.result = refusal_of(error, 1.0)
            except (PlanningError, InvalidValueError) as error:
                self.result = refusal_of(error, 0.0)
        elif not sampling.is_done:
            sampling.advance()
            self.result = sampling.refusal
        else:
            self._finish(sampling)

    def _begin(self) -> None:
        target, arm = self.target, self._arm
        if isinstance(target, PauseTarget):
            self.result = PreparedTarget(target=target, section=None, goal=tuple(self._start))
        elif isinstance(target, JointTarget):
            self.result = self._joint(target)
        elif isinstance(target, LineTarget | ArcTarget):
            path = self._path(target)
            if path.distance <= _STANDSTILL:
                self.result = PreparedTarget(target=target, section=None, goal=tuple(self._start))
                return
            line = (path.distance if path.unit == "m" else 0.0, path.turn)
            self._sample(ToolSection(path, arm.solver), path.distance, line)
        else:
            poses = without_repetitions([arm.model.forward(self._start), *target.poses])
            if len(poses) < 2:
                self.result = PreparedTarget(target=target, section=None, goal=tuple(self._start))
                return
            spline = PoseSpline(poses)
            section = CurveSection(spline.at, intervals_of(spline.distance, spline.turn), arm.solver)
            self._sample(section, spline.distance, None)

    def _sample(self, section: CurveSection, length: float, line: tuple[float, float] | None) -> None:
        self._section, self._length, self._line = section, length, line
        self._sampling = Sampling(section, self._start, self._arm.limits.joint)

    def _joint(self, target: JointTarget) -> PreparedTarget | Refusal:
        arm, start = self._arm, self._start
        if target.q is not None:
            goal = [a + b for a, b in zip(start, target.q, strict=True)] if target.is_relative else list(target.q)
        else:
            assert target.pose is not None  # Checked by `Planner.add`.
            goal = arm.solver.nearest(self._in_base(target.pose, target.frame), start)
        limits = arm.limits.joint
        ends = list(zip(limits.lower.tolist(), limits.upper.tolist(), strict=True))
        refusal = find_outside(goal, ends, 1.0)
        if refusal is not None:
            return refusal
        section = JointSection(start, goal)
        length = max(map(abs, section.distances))
        if length <= _STANDSTILL:
            return PreparedTarget(target=target, section=None, goal=tuple(goal))
        bounds = bounds_of_line(section.distances, joint_bounds(limits, target.speed))
        return PreparedTarget(
            target=target, section=section, bounds=(bounds,), length=length, goal=tuple(goal), speed=target.speed
        )

    def _path(self, target: LineTarget | ArcTarget) -> Path:
        start = self._arm.model.forward(self._start)
        goal = self._in_base(target.pose, target.frame)
        if isinstance(target, LineTarget):
            return build_line(start, goal)
        via = self._in_base(target.via, target.frame)
        if target.angle is None:
            return build_arc(start, via, goal)
        center, axis = circle_through(start, via, goal)
        turns = target.angle / tau
        path = build_circle(start, center, axis, min(target.angle, tau))
        if turns <= 1.0 or path.circle is None:
            return path
        part = target.angle % tau
        end = build_circle(start, center, axis, part).goal if part > _STANDSTILL else start
        circle = replace(path.circle, angle=target.angle)
        return replace(path, goal=end, circle=circle, distance=path.distance * turns)

    def _in_base(self, pose: Pose, frame: str) -> Pose:
        if frame == "base":
            return pose
        start = self._arm.model.forward(self._start)
        return start @ pose if frame == "tool" else _shifted(start, pose)

    def _finish(self, sampling: Sampling) -> None:
        arm, target, section = self._arm, self.target, self._section
        assert section is not None
        assert not isinstance(target, PauseTarget | JointTarget)
        tool = sampling.tool
        assert tool is not None
        section.set_guide(Guide.through(sampling.rows))
        wanted = tool_bounds(arm.limits.cartesian, target.speed)
        line = bounds_of_line(self._line or _largest_rates(tool), wanted)
        bounds = sampled_bounds(arm, sampling, line, tools=(target.speed,))
        self.result = PreparedTarget(
            target=target,
            section=section,
            bounds=tuple(bounds),
            length=self._length,
            goal=tuple(sampling.rows[-1]),
            speed=target.speed,
        )


def sampled_bounds(
    arm: PlannedArm,
    sampling: Sampling,
    line: ShareBounds,
    *,
    joints: Sequence[JointSpeed] = (),
    tools: Sequence[ToolSpeed] = (),
) -> list[ShareBounds]:
    """Returns the bounds of a sampled curve.

    Args:
        arm: The arm.
        sampling: Of the section, done.
        line: Bounds inside which they are in any case.
        joints: Speeds of the joints on it.
        tools: Speeds of the tool on it. Across its direction the tool may accelerate up to the limit of the arm.
    """
    limit = arm.limits.joint
    limits = [joint_bounds(limit, JointSpeed())] if arm.slows_down or not tools else []
    limits += [joint_bounds(limit, speed) for speed in joints]
    poses = sampling.tool
    along = None
    if poses is not None:
        speeds = [ToolSpeed(velocity=tool.velocity, rotation_velocity=tool.rotation_velocity) for tool in tools]
        along = poses, strictest([tool_bounds(arm.limits.cartesian, speed) for speed in speeds])
    rows = np.array(sampling.rows)
    return slower(bounds_of_samples(rows, strictest(limits, rows.shape[1]), line.velocity, along), line)


def _shifted(start: Pose, offset: Pose) -> Pose:
    """Returns a pose after an offset: shifted and turned in the axes of the base."""
    rotation, _ = (Pose.from_parts(offset.parts[0], (0.0, 0.0, 0.0)) @ start).parts
    x, y, z = (a + b for a, b in zip(start.parts[1], offset.parts[1], strict=True))
    return Pose.from_parts(rotation, (x, y, z))


def _largest_rates(tool: Array) -> tuple[float, float]:
    """Returns the largest velocities of tool and orientation by the share, [m], [rad]."""
    steps = np.diff(tool, axis=0) * (len(tool) - 1)
    return float(np.linalg.norm(steps[:, :3], axis=1).max()), float(np.linalg.norm(steps[:, 3:], axis=1).max())


def find_outside(q: Sequence[float], ends: Sequence[tuple[float, float]], share: float) -> Refusal | None:
    """Returns why joint angles are refused: the first joint outside its range; None: all are inside."""
    for number, (angle, (lower, upper)) in enumerate(zip(q, ends, strict=True), 1):
        if not lower <= angle <= upper:
            bound = lower if angle < lower else upper
            text = (
                f"joint {number} would be at {angle_text(angle)}, outside its range of {angle_text(lower)} to "
                f"{angle_text(upper)}"
            )
            remark = Remark(text, "target_range", joint=number, value=angle, bound=bound, unit="rad")
            return Refusal(
                reason=RefusalReason.JOINT_RANGE, remark=remark, share=share, joint=number, value=angle, bound=bound
            )
    return None


def find_jump(before: Sequence[float], q: Sequence[float], share: float) -> Refusal | None:
    """Returns why a path is refused on which a joint jumps between two samples; None: none does."""
    steps = [abs(b - a) for a, b in zip(before, q, strict=True)]
    largest = max(steps)
    if largest <= _LARGEST_STEP:
        return None
    joint = steps.index(largest) + 1
    remark = Remark(f"joint {joint} would have to jump, because a singularity is close", "target_jump", joint=joint)
    return Refusal(reason=RefusalReason.SINGULAR, remark=remark, share=share, joint=joint)


def refusal_of(error: RcilabError, share: float) -> Refusal:
    """Returns why a target is refused."""
    reason, code = RefusalReason.GEOMETRY, "target_geometry"
    if isinstance(error, SingularError):
        reason, code = RefusalReason.SINGULAR, "target_singular"
    elif isinstance(error, KinematicsError):
        reason, code = RefusalReason.UNREACHABLE, "target_unreachable"
    return Refusal(reason=reason, remark=Remark(str(error), code), share=share)
