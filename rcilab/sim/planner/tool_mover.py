"""On-line motion of the tool to a pose that may change at any time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, hypot, pi, sin, tau

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose, rotation_between, rotation_from_wxyz
from rcilab.motion import _ruckig
from rcilab.motion.hermite import central_state
from rcilab.sim.planner.braking import stop_distance
from rcilab.sim.planner.mover import MotionState
from rcilab.sim.planner.planner_event import Refusal
from rcilab.sim.planner.preparation import PlannedArm, find_outside, refusal_of
from rcilab.sim.planner.section_bounds import Bounds, joint_bounds, tool_bounds
from rcilab.sim.planner.target import JointSpeed, ToolSpeed

_STEP = 1e-4  # [s] Of finite differences of poses.
_SAMPLE_LENGTH = 0.06  # [m] Between the poses at which a new plan is checked; a tuning value.
_SAMPLE_ANGLE = 0.3  # [rad] The same for the orientation.
_FEWEST, _MOST = 2, 8  # Of these poses.
_SMALL = 1e-9  # [m], [rad] A shorter distance has no direction.
_SAMPLED = 0.9  # Part of the joints' limits that is used where a plan is known from a few samples.


class ToolMover:
    """Moves the tool to a pose, from any moving state.

    Position and rotation vector, relative to the goal, go to zero together. From standstill, or from a motion along
    this line, the tool moves on the straight line and turns about one axis.

    Attributes:
        obstruction: Why the arm cannot go on to the goal; None: it can. It is to be stopped.

    Args:
        arm: The arm.
        state: Where it begins.
    """

    def __init__(self, arm: PlannedArm, state: MotionState) -> None:
        self.obstruction: Refusal | None = None
        self._arm = arm
        self._q, self._dq = list(state.q), list(state.dq)
        limits = arm.limits.joint
        self._ends = list(zip(limits.lower.tolist(), limits.upper.tolist(), strict=True))
        self._rates = list(zip(limits.acceleration.tolist(), limits.jerk.tolist(), strict=True))
        q, dq, ddq = (np.array(part) for part in state)
        self._poses: Callable[[float], Pose] = lambda t: arm.model.forward(q + t * dq + 0.5 * t * t * ddq)
        self._plan: _PosePlan | None = None
        self._t = 0.0

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        q, solver, t = self._q, self._arm.solver, self._t
        before, here, after = (np.array(solver.next_to(self._poses(t + side * _STEP), q)) for side in (-1.0, 0.0, 1.0))
        _, dq, ddq = central_state(before, here, after, step=_STEP)
        return MotionState(list(q), dq.tolist(), ddq.tolist())

    @property
    def is_stationary(self) -> bool:
        """Whether the tool stands at its goal."""
        return self._plan is None or self._t >= self._plan.duration

    def set_goal(self, pose: Pose, speed: ToolSpeed) -> Refusal | None:
        """Moves to a pose from the next step on.

        Returns:
            Why it is refused, without effect; None: it is followed.

        Raises:
            PlanningError: The state is far beyond the limits.
        """
        bounds = tool_bounds(self._arm.limits.cartesian, speed)
        around = [self._poses(self._t + side * _STEP) for side in (-1.0, 0.0, 1.0)]
        plan = _PosePlan(around, pose)
        plan.compute(bounds)
        found = self._sample(plan)
        if isinstance(found, Refusal):
            return found
        if self._arm.slows_down and plan.duration > 0.0:
            factors = self._excess(plan, found)
            if max(factors) > 1.0:
                v, a, j = factors
                plan.compute(Bounds(bounds.velocity / v, bounds.acceleration / a, bounds.jerk / j))
        self._plan, self._poses, self._t = plan, plan.at, 0.0
        return None

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        plan = self._plan
        if plan is not None and not self.is_stationary:
            t, before = self._t + CYCLE_TIME, self._q
            share = t / plan.duration
            try:
                self._q = self._arm.solver.next_to(plan.at(t), before)
            except KinematicsError as error:  # Between two samples that were reachable.
                self.obstruction = refusal_of(error, share)
                return list(before)
            self._t = t
            self.obstruction = self._find_leaving(before, share)
        return list(self._q)

    def _find_leaving(self, before: Sequence[float], share: float) -> Refusal | None:
        """Finds a joint that can only just stop inside its range.

        Args:
            before: The angles of the last cycle, [rad].
            share: Part of the path.
        """
        dq = [(x - x1) / CYCLE_TIME for x, x1 in zip(self._q, before, strict=True)]
        ends: list[float] = []
        for x, v, v1, bounds in zip(self._q, dq, self._dq, self._rates, strict=True):
            a = (v - v1) / CYCLE_TIME
            ends.append(x + stop_distance(v, a, *bounds) - stop_distance(-v, -a, *bounds))
        self._dq = dq
        return find_outside(ends, self._ends, share)

    def _sample(self, plan: _PosePlan) -> Refusal | list[list[float]]:
        """Returns why a plan cannot be followed, or joint angles at even times after the start."""
        count = min(max(_FEWEST, round(max(plan.length / _SAMPLE_LENGTH, plan.turn / _SAMPLE_ANGLE))), _MOST)
        rows: list[list[float]] = []
        q = self._q
        for number in range(1, count + 1):
            share = number / count
            try:
                q = self._arm.solver.next_to(plan.at(share * plan.duration), q)
            except KinematicsError as error:
                of_goal = self._error_at(plan.at(plan.duration))
                return refusal_of(error, share) if of_goal is None else refusal_of(of_goal, 1.0)
            refusal = find_outside(q, self._ends, share)
            if refusal is not None:
                return refusal
            rows.append(q)
        return rows

    def _error_at(self, pose: Pose) -> KinematicsError | None:
        """Returns why a pose has no joint angles; None: it has."""
        try:
            self._arm.solver.nearest(pose, self._q)
        except KinematicsError as error:
            return error
        return None

    def _excess(self, plan: _PosePlan, rows: list[list[float]]) -> list[float]:
        """Returns by what factors velocity, acceleration and jerk exceed the joints' bounds; 1 where they do not.

        Args:
            plan: The plan.
            rows: Joint angles at even times after the start.
        """
        inverses = np.linalg.pinv(np.array([self._arm.model.rigid_body.tool_jacobian(np.array(q)) for q in rows]))
        times = plan.times
        nearest = np.minimum((times / plan.duration * len(rows)).astype(np.intp), len(rows) - 1)
        joints = joint_bounds(self._arm.limits.joint, JointSpeed())
        factors: list[float] = []
        for order, bound in enumerate((joints.velocity, joints.acceleration, joints.jerk), start=1):
            rates = (inverses[nearest] @ plan.derivatives(times, order)[:, :, np.newaxis])[:, :, 0]
            factors.append(max(1.0, float((np.abs(rates) / (_SAMPLED * bound)).max())))
        return factors


class _PosePlan:
    """Position and rotation vector from a goal, in axes along the path to it, as functions of time.

    Args:
        around: Poses a step before, at, and a step after the start.
        goal: The pose.
    """

    def __init__(self, around: Sequence[Pose], goal: Pose) -> None:
        self._goal = goal
        positions = np.array([pose.parts[1] for pose in around]) - np.array(goal.parts[1])
        turns = np.array([rotation_between(goal.parts[0], pose.parts[0]) for pose in around])
        for row in (0, 2):  # Half a turn from the goal the vector is ambiguous: that next to the middle one.
            size = float(np.linalg.norm(turns[row]))
            if turns[row] @ turns[1] < 0.0 and size > 0.5 * pi:
                turns[row] *= 1.0 - tau / size
        self.length, self.turn = float(np.linalg.norm(positions[1])), float(np.linalg.norm(turns[1]))
        self._axes = _axes_along(positions[1]), _axes_along(turns[1])
        before, here, after = np.hstack((positions @ self._axes[0], turns @ self._axes[1]))
        start, velocity, acceleration = central_state(before, here, after, step=_STEP)
        self._start = start, _without_noise(velocity), _without_noise(acceleration, 1e-5)
        self._rows: list[list[float]] = [axis.tolist() for axis in (*self._axes[0].T, *self._axes[1].T)]

    def compute(self, bounds: Bounds) -> None:
        """Computes the motion inside bounds of translation and rotation.

        Raises:
            PlanningError: The start is far beyond them.
        """
        start, velocity, acceleration = self._start
        v, a, j = (np.repeat(bound, 3) for bound in (bounds.velocity, bounds.acceleration, bounds.jerk))
        self._curve = _ruckig.plan_profile(start, np.zeros(6), v, a, j, velocity, acceleration)

    @property
    def duration(self) -> float:
        """Time until the goal, [s]."""
        return self._curve.duration

    @property
    def times(self) -> Array:
        """Times at which derivatives are largest, and between them, shape (N,), [s]."""
        breaks = self._curve.breaks
        return np.concatenate((breaks, 0.5 * (breaks[1:] + breaks[:-1])))

    def derivatives(self, times: Array, order: int) -> Array:
        """Returns derivatives of position and rotation vector, base axes, at times, shape (N,), [s], to (N, 6)."""
        rates = self._curve.sample(times, order)
        return np.hstack((rates[:, :3] @ self._axes[0].T, rates[:, 3:] @ self._axes[1].T))

    def at(self, t: float) -> Pose:
        """Returns the pose at a time, [s]; before the start by the derivatives there."""
        if t >= self._curve.duration:
            return self._goal
        values, rates, changes, _ = self._curve.at(t)
        if t < 0.0:
            values = values + t * (rates + 0.5 * t * changes)
        a, b, c, d, e, f = values.tolist()
        u, v, w, k, m, n = self._rows
        x, y, z = (a * u[i] + b * v[i] + c * w[i] for i in range(3))
        rx, ry, rz = (d * k[i] + e * m[i] + f * n[i] for i in range(3))
        half = 0.5 * hypot(rx, ry, rz)
        scale = 0.5 * sin(half) / half if half > 0.0 else 0.5
        turn = Pose.from_parts(rotation_from_wxyz((cos(half), scale * rx, scale * ry, scale * rz)), (0.0, 0.0, 0.0))
        rotation, (px, py, pz) = self._goal.parts
        turned = turn @ Pose.from_parts(rotation, (0.0, 0.0, 0.0))
        return Pose.from_parts(turned.parts[0], (px + x, py + y, pz + z))


def _axes_along(vector: Array) -> Array:
    """Returns three perpendicular axes as columns, the first along a vector; any if it has no length."""
    size = float(np.linalg.norm(vector))
    if size < _SMALL:
        return np.eye(3)
    x, y, z = (vector / size).tolist()
    # Perpendicular to the axis of the base that is farthest from it.
    a, b, c = min(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)), key=lambda axis: -hypot(*axis))
    length = hypot(a, b, c)
    a, b, c = a / length, b / length, c / length
    return np.array(((x, a, y * c - z * b), (y, b, z * a - x * c), (z, c, x * b - y * a)))


def _without_noise(values: Array, threshold: float = 1e-8) -> Array:
    """Returns derivatives by finite differences, with those that are only rounding set to zero."""
    return np.where(np.abs(values) < threshold, 0.0, values)
