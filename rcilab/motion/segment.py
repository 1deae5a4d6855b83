"""Segments of a program: the geometry of the path to each waypoint."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import InvalidValueError, KinematicsError, PlanningError, RcilabError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import require_inside
from rcilab.motion.cartesian import arm_angles
from rcilab.motion.hermite import DIFFERENCE_STEP, central_state
from rcilab.motion.inverse_path import inverse_path
from rcilab.motion.path import Path, build_arc, build_circle, build_line
from rcilab.motion.path_infeasibility import solve_path
from rcilab.motion.path_timing import require_path
from rcilab.motion.program_expansion import Move
from rcilab.motion.s_curve import STANDSTILL_DISTANCE
from rcilab.motion.waypoint import Waypoint, label, named_value

_KNOTS = 100
"""Number of steps of the first check of a path. Tuning value."""
_STEP = 0.1
"""A larger step of a joint from knot to knot is checked with finer knots, [rad]. Tuning value."""
_BRANCH_TOLERANCE = 1e-6
"""Largest difference between the end of a line and its target q, [rad]; beyond it q is on another branch."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Segment:
    """The path to one waypoint, as a function of its share u, 0 to 1."""

    number: int
    """Number of the waypoint, from 1."""
    waypoint: Waypoint
    start: JointVector
    """Joint angles at the start, shape (n,), [rad]."""
    goal: JointVector
    """Joint angles at the end, shape (n,), [rad]."""
    path: Path | None
    """Path of the tool; None is a straight line in joint space."""
    knots: JointPath
    """Joint angles at evenly spaced shares, shape (M + 1, n), [rad]; two rows for a straight line in joint space."""

    @property
    def label(self) -> str:
        """Name for errors."""
        return label(self.number, self.waypoint)

    @property
    def is_stationary(self) -> bool:
        """Whether nothing moves on the segment."""
        if self.path is not None:
            return self.path.distance == 0.0
        return float(np.abs(self.goal - self.start).max()) <= STANDSTILL_DISTANCE

    def joints_near(self, share: float) -> JointVector:
        """Returns joint angles close to those at a share, to select the branch."""
        return self.knots[round(min(max(share, 0.0), 1.0) * (len(self.knots) - 1))]

    def positions(self, model: RobotModel, shares: Array) -> Array:
        """Returns positions of the tool, shape (N, 3), [m], at many shares, shape (N,)."""
        if self.path is not None:
            return _positions(self.path, shares)
        return model.position_path(self.start + shares[:, np.newaxis] * (self.goal - self.start))

    def state(self, model: RobotModel, share: float) -> tuple[JointVector, JointVector, JointVector]:
        """Returns joint angles and their first two derivatives by the share, each of shape (n,)."""
        if self.path is None:
            distance = self.goal - self.start
            return self.start + share * distance, distance, np.zeros_like(distance)
        T, psi = self.path.sample(share + DIFFERENCE_STEP * np.array([-1.0, 0.0, 1.0]))
        return central_state(*inverse_path(model, T, psi, self.joints_near(share))[0])


def build_segments(
    model: RobotModel, start: ArrayLike, moves: Sequence[Move], progress: Callable[[float], None] = lambda part: None
) -> list[Segment]:
    """Returns the segments of a program; each starts at the end of the previous one.

    Args:
        model: The arm, with the tool of the program.
        start: Joint angles at the start, shape (n,), [rad].
        moves: The moves of the program.
        progress: Called with the progress, 0 to 1.

    Raises:
        PlanningError: A target is out of reach, or a joint limit or a singularity is in the way; the message names the
            waypoint, the position and the reason.
        InvalidValueError: A waypoint does not fit this arm.
    """
    q = np.array(start)
    try:
        require_inside("start", q, model.limits.joint)
    except PlanningError as error:
        raise PlanningError(f"the start: {error}").coded("program_start", reason=error) from error
    segments: list[Segment] = []
    for done, move in enumerate(moves, 1):
        number, waypoint = move.row, move.waypoint
        with naming(label(number, waypoint), number, waypoint.type):
            if move.offset:
                waypoint = _shifted(model, waypoint, move.offset)
            segments.append(_segment(model, q, number, waypoint))
        q = segments[-1].goal
        progress(done / len(moves))
    return segments


def _shifted(model: RobotModel, waypoint: Waypoint, offset: float) -> Waypoint:
    """Returns a waypoint whose target is `offset`, [m], in front of its own, against the tool's z axis."""
    target, psi, q = waypoint.pose, waypoint.psi, waypoint.q
    if q is not None:
        target, psi = model.forward(q), model.arm_angle(q) if model.redundancy else None
    assert target is not None
    T = target @ Pose((0.0, 0.0, -offset))
    if q is not None and waypoint.type != "line":
        angles = tuple(np.array(model.inverse(T, psi, q).nearest(q)).tolist())
        return replace(waypoint, q=angles)
    return replace(waypoint, q=None, position=tuple(T.position.tolist()), wxyz=tuple(T.wxyz.tolist()), psi=psi)


@contextmanager
def naming(what: str, number: int | None = None, kind: str = "") -> Iterator[None]:
    """Adds the name and number of a waypoint to errors of the body."""
    try:
        yield
    except InvalidValueError as error:
        if number is not None and kind:
            raise named_value(number, kind, error) from error
        raise InvalidValueError(f"{what}, {error.name}", error.value, error.requirement) from error
    except PlanningError as error:
        raise _named(
            PlanningError(f"{what}: {error}", share=error.share, waypoint=number), number, kind, error
        ) from error
    except KinematicsError as error:
        raise _named(PlanningError(f"{what}: {error}", waypoint=number), number, kind, error) from error


def _named(error: PlanningError, number: int | None, kind: str, reason: RcilabError) -> PlanningError:
    if number is None:
        return error.coded("way_to_start", reason=reason)
    return error.coded("waypoint", number=number, kind=kind, reason=reason)


def _positions(path: Path, shares: Array) -> Array:
    """Returns positions of the tool on a path, shape (N, 3), [m]."""
    u = shares[:, np.newaxis]
    if path.circle is None:
        start = path.start.position
        return start + u * (path.goal.position - start)
    center, first, second = (np.array(point) for point in (path.circle.center, path.circle.first, path.circle.second))
    return center + np.cos(u * path.circle.angle) * first + np.sin(u * path.circle.angle) * second


def _segment(model: RobotModel, q: JointVector, number: int, waypoint: Waypoint) -> Segment:
    if waypoint.is_instruction:
        return Segment(number=number, waypoint=waypoint, start=q, goal=q, path=None, knots=np.stack((q, q)))
    if waypoint.type in ("joint", "free"):
        goal = _joint_goal(model, q, waypoint)
        require_inside("goal", goal, model.limits.joint)
        return Segment(
            number=number, waypoint=waypoint, start=q, goal=goal, path=None, knots=np.stack((q, goal))
        )  # fmt: skip
    path = _path(model, q, waypoint)
    knots = np.stack((q, q)) if path.distance == 0.0 else _follow(model, q, path)
    goal = knots[-1]
    if waypoint.q is not None and (excess := np.abs(goal - waypoint.q)).max() > _BRANCH_TOLERANCE:
        joint = int(excess.argmax())
        raise PlanningError(
            f"the {waypoint.type} ends with joint {joint + 1} at {math.degrees(goal[joint]):.2f} deg and not at "
            f"{math.degrees(waypoint.q[joint]):.2f} deg: q is on another branch; use a joint move",
            share=1.0,
        ).coded("other_branch", joint=joint + 1)
    return Segment(number=number, waypoint=waypoint, start=q, goal=goal, path=path, knots=knots)


def _follow(model: RobotModel, q: JointVector, path: Path) -> JointPath:
    """Returns the joint angles at evenly spaced shares of a path that can be followed, shape (M + 1, n), [rad]."""
    shares, span = np.linspace(0.0, 1.0, _KNOTS + 1), f"on {100.0 / _KNOTS:g} % of the path"
    knots, infeasible = solve_path(model, q, path, shares, np.full(model.n, _STEP), span)
    return knots if infeasible is None else require_path(model, q, path)


def _joint_goal(model: RobotModel, q: JointVector, waypoint: Waypoint) -> JointVector:
    pose = waypoint.pose
    if waypoint.q is not None or pose is None:
        return np.array(waypoint.q)
    return np.array(model.inverse(pose, waypoint.psi, q).nearest(q))


def _path(model: RobotModel, q: JointVector, waypoint: Waypoint) -> Path:
    T = model.forward(q)
    goal, psi = waypoint.pose, waypoint.psi
    if waypoint.q is not None:
        goal = model.forward(waypoint.q)
        psi = model.arm_angle(waypoint.q) if model.redundancy else None
    psi_range = arm_angles(model, q, psi, waypoint.way or "shorter")
    if waypoint.type == "circle":
        assert waypoint.center is not None
        assert waypoint.axis is not None
        angle = math.tau if waypoint.angle is None else waypoint.angle
        orientation = waypoint.orientation or "held"
        return build_circle(T, waypoint.center, waypoint.axis, angle, *psi_range, orientation=orientation)
    if waypoint.type == "nullspace":
        return build_line(T, T, *psi_range)
    if waypoint.type == "retreat":
        assert waypoint.distance is not None
        goal = T @ Pose((0.0, 0.0, -waypoint.distance))
    assert goal is not None
    if waypoint.via is not None:
        if waypoint.via_wxyz is None:
            return build_arc(T, Pose(waypoint.via), goal, *psi_range, orientation="start_to_goal")
        return build_arc(T, Pose(waypoint.via, waypoint.via_wxyz), goal, *psi_range, orientation="through_via")
    return build_line(T, goal, *psi_range)
