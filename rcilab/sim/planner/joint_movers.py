"""On-line motions of the joints: to angles that may change, to standstill, and along streamed angles."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits
from rcilab.model.robot_model import RobotModel
from rcilab.motion import _ruckig
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.sim.planner.braking import stop_distance
from rcilab.sim.planner.mover import MotionState
from rcilab.sim.planner.section_bounds import joint_bounds
from rcilab.sim.planner.stream_filter import StreamFilter, StreamMode
from rcilab.sim.planner.stream_speed import StreamSpeed
from rcilab.sim.planner.target import JointSpeed

_STANDSTILL = (1e-9, 1e-6)  # [rad/s], [rad/s^2] Rounding of the curve.
_THERE = 1e-7  # [rad] ruckig reaches a goal within 1e-8.
_NEAR = 1e-6  # [rad] From the streamed angles: beyond it the joints catch up with them.
_ROUNDING = 1e-12  # [rad], [rad/s].
_END = 5e-4  # [rad] Inside its range, where a joint that moves stops at the latest: more than rounding.
_LEAST_SPEED = 0.01  # Of the largest one, by which a joint at that speed still catches up; a tuning value.
_CATCH_UP = 0.1  # Of their velocity, by which a joint catches up with smoothed angles that may stop; a tuning value.
_FASTEST = JointSpeed()
_SLOW = 2e-4  # [rad/s] Relative to angles that move: a slower joint that is near follows them.
_ROUNDED, _ROUNDED_JERK = 1.25, 3.0  # Shares of the largest acceleration and jerk; tuned for angles in 0.001 deg.


class StopMover:
    """Stops every joint by itself, as fast as the limits allow.

    Args:
        limits: Of the joints.
        state: Where it begins.
    """

    def __init__(self, limits: JointLimits, state: MotionState) -> None:
        bounds = joint_bounds(limits, _FASTEST)
        self._axes = _ruckig.Stepper(*state, bounds.acceleration.tolist(), bounds.jerk.tolist())
        self._still = [0.0] * len(state.q)

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        return _state_of(self._axes)

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands."""
        return _stands(self._axes)

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        if not self.is_stationary:
            self._axes.step_to_velocity(self._still)
        return list(self._axes.q)


class JointMover:
    """Moves to joint angles that may change at any time; all joints arrive together.

    Args:
        limits: Of the joints.
        state: Where it begins.
    """

    def __init__(self, limits: JointLimits, state: MotionState) -> None:
        self._limits = limits
        self._stop: StopMover | None = StopMover(limits, state)  # Before the curve.
        self._curve: PiecewisePolynomial | None = None
        self._t = 0.0
        self._goal, self._speed = list(state.q), _FASTEST

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        if self._stop is not None:
            return self._stop.state
        assert self._curve is not None
        q, dq, ddq, _ = self._curve.at(self._t)
        if self._t >= self._curve.duration:
            return MotionState(list(self._goal), [0.0] * len(dq), [0.0] * len(dq))
        return MotionState(q.tolist(), dq.tolist(), ddq.tolist())

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands at its goal."""
        return self._curve is not None and self._stop is None and self._t >= self._curve.duration

    def set_goal(self, q: Sequence[float], speed: JointSpeed) -> None:
        """Moves to these joint angles from the next step on, n finite numbers, [rad].

        Where a joint would leave its range along the path, all stop first.

        Raises:
            PlanningError: No curve leads there from the present state; the last goal stays.
        """
        state = self.state
        before = self._goal, self._speed
        self._goal, self._speed = list(q), speed
        try:
            self._plan(state)
        except PlanningError:
            self._goal, self._speed = before
            raise
        self._stop = None
        assert self._curve is not None
        (lowest, _), (highest, _) = self._curve.extremes()
        limits = self._limits
        if (lowest < np.minimum(limits.lower, state.q)).any() or (highest > np.maximum(limits.upper, state.q)).any():
            self._stop = StopMover(limits, state)

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        stop = self._stop
        if stop is not None:
            q = stop.step()
            if stop.is_stationary:
                self._stop = None
                self._plan(stop.state)
            return q
        assert self._curve is not None
        self._t += CYCLE_TIME
        if self._t >= self._curve.duration:
            return list(self._goal)
        return self._curve.at(self._t)[0].tolist()

    def _plan(self, state: MotionState) -> None:
        bounds = joint_bounds(self._limits, self._speed)
        q, dq, ddq = (np.array(part) for part in state)
        limits = bounds.velocity, bounds.acceleration, bounds.jerk
        self._curve = _ruckig.plan_profile(q, np.array(self._goal), *limits, dq, ddq)
        self._t = 0.0


class StreamMover:
    """Moves every joint by itself to the newest streamed angles, smoothed, with the largest acceleration and jerk.

    Attributes:
        target: The newest angles, [rad].

    Args:
        model: The arm with its tool.
        limits: Of the joints.
        state: Where it begins.
    """

    def __init__(self, model: RobotModel, limits: JointLimits, state: MotionState) -> None:
        self._model, self._limits = model, limits
        bounds = joint_bounds(limits, _FASTEST)
        self._bounds: tuple[list[float], list[float]] = bounds.acceleration.tolist(), bounds.jerk.tolist()
        self._axes = _ruckig.Stepper(*state, *self._bounds)
        self._velocity: list[float] = bounds.velocity.tolist()
        self._ends = [
            (low + _END, high - _END, stop_distance(v, a, a, j))  # The longest stop.
            for low, high, v, a, j in zip(
                limits.lower.tolist(), limits.upper.tolist(), self._velocity, *self._bounds, strict=True
            )
        ]
        self._filter = StreamFilter(state.q, "direct", 0.0)
        self._tool: StreamSpeed | None = None
        self.target = list(state.q)
        self._line_velocity = [0.0] * len(state.q)
        self._is_on_line = False
        self._is_off = False  # Whether it approaches the angles to follow.
        self._before = list(state.q)  # What was to be followed in the last cycle.
        self._past: list[list[float]] = []  # The last angles, the newest first, while they are smoothed.
        self._is_stationary: bool | None = None  # None: not known yet. Asked for many times a cycle.

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        return _state_of(self._axes)

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands at the newest angles."""
        if self._is_stationary is None:
            axes = self._axes
            is_there = all(abs(a - b) < _THERE for a, b in zip(axes.q, self.target, strict=True))
            self._is_stationary = is_there and self._filter.is_settled and _stands(axes)
        return self._is_stationary

    def take(
        self, q: list[float], speed: JointSpeed, mode: StreamMode, smoothing: float, tool_speed: float | None = None
    ) -> None:
        """Takes the newest angles, n finite numbers, [rad].

        Args:
            q: The angles.
            speed: Of the joints.
            mode: How they are followed.
            smoothing: From 0 to 1.
            tool_speed: Of the tool in mode "linear" where targets came late, [m/s]; None: any.
        """
        if (mode, smoothing) != (self._filter.mode, self._filter.smoothing):
            self._filter = StreamFilter(self._axes.q, mode, smoothing)
            q0, dq, ddq = self.state
            self._past = [
                [x - k * CYCLE_TIME * (v - 0.5 * k * CYCLE_TIME * a) for x, v, a in zip(q0, dq, ddq, strict=True)]
                for k in range(3)
            ]
        self._velocity = joint_bounds(self._limits, speed).velocity.tolist()
        self.target = q
        if tool_speed is None:
            self._tool = None
        elif self._tool is None or self._tool.largest != tool_speed:
            self._tool = StreamSpeed(self._model, tool_speed)
        self._filter.take(q, 0.0 if self._tool is None else self._tool.take(self._filter.output, q))
        self._is_stationary = None

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        if self._tool is not None:
            self._tool.step()
        if self._filter.mode in ("direct", "linear") and self.is_stationary:
            return list(self._axes.q)
        self._is_stationary = None
        q = self._filter.step()
        if self._filter.mode == "linear":
            before = self.state
            dq = self._filter.velocity
            was_on_line, self._is_on_line = self._is_on_line, self._stays_on_line(q, dq)
            if not self._is_on_line:
                if was_on_line:  # Where a line ends, the joints brake; they would turn back before that jerk is undone.
                    self._axes.set_state(before.q, before.dq, [0.0] * len(q))
                self._step_along(
                    q, [min(max(v, -top), top) for v, top in zip(dq, self._velocity, strict=True)], self._velocity
                )
                self._keep_slow(before)
            elif self._tool is not None:
                self._tool.reach()
            self._keep_inside(before, q)
        elif self._filter.mode == "direct":
            self._axes.step_to_positions(q, self._velocity)
        else:
            before = self.state
            if self._is_off or not self._takes(q):
                self._chase(q)
            self._keep_inside(before, q)
        now = list(self._axes.q)
        self._past, self._before = [now, *self._past[:2]], q
        return now

    def _chase(self, q: Sequence[float]) -> None:
        """Catches up with smoothed angles, until the joints are at them and move as they do."""
        dq = [(x - x1) / CYCLE_TIME for x, x1 in zip(q, self._before, strict=True)]
        axes = self._axes
        bounds = [
            v_max
            if v * (goal - x) <= 0.0
            else min(v_max, max((1.0 + _CATCH_UP) * abs(v), sqrt(2.0 * a_max * abs(goal - x))))
            for x, goal, v, v_max, a_max in zip(axes.q, q, dq, self._velocity, self._bounds[0], strict=True)
        ]
        self._step_along(q, dq, bounds)
        self._is_off = any(abs(x - x1) > _NEAR for x, x1 in zip(axes.q, q, strict=True)) or any(
            abs(v - v1) > _SLOW for v, v1 in zip(axes.dq, dq, strict=True)
        )

    def _stays_on_line(self, q: Sequence[float], dq: list[float]) -> bool:
        """Advances to these angles if the joints are next to them and may follow; returns whether they are."""
        axes, h = self._axes, CYCLE_TIME
        ddq = [(new - old) / h for new, old in zip(dq, self._line_velocity, strict=True)]
        self._line_velocity = dq
        for goal, v, a, x, v_max, a_max in zip(q, dq, ddq, axes.q, self._velocity, self._bounds[0], strict=True):
            if abs(goal - x - h * v) > _NEAR or abs(v) > v_max or abs(a) > a_max:
                return False
        if any(abs(v - old) > a_max * h for v, old, a_max in zip(dq, axes.dq, self._bounds[0], strict=True)):
            return False
        axes.set_state(q, [v + 0.5 * h * a for v, a in zip(dq, ddq, strict=True)], ddq)
        return True

    def _keep_inside(self, before: MotionState, q: Sequence[float]) -> None:
        """Lets a joint that could no longer stop inside its range move to the angle as to a standing one instead.

        Args:
            before: The state at the start of this cycle.
            q: The angles to follow.
        """
        axes = self._axes
        if all(low + room < x < high - room for x, (low, high, room) in zip(axes.q, self._ends, strict=True)):
            return
        after = self.state
        stops = [
            low <= x - stop_distance(-v, -a, a_max, j_max) and x + stop_distance(v, a, a_max, j_max) <= high
            for x, v, a, a_max, j_max, (low, high, _) in zip(*after, *self._bounds, self._ends, strict=True)
        ]
        if all(stops):
            return
        axes.set_state(*before)
        axes.step_to_positions(q, self._velocity)
        mixed = [
            [new if is_kept else old for is_kept, new, old in zip(stops, kept, braked, strict=True)]
            for kept, braked in zip(after, self.state, strict=True)
        ]
        axes.set_state(*mixed)
        self._is_off = True

    def _keep_slow(self, before: MotionState) -> None:
        """Shortens the step of this cycle to one that joints and tool may move; the joints accelerate less then.

        Args:
            before: The state at the start of this cycle.
        """
        axes = self._axes
        share = 1.0 if self._tool is None else self._tool.share(before.q, axes.q)
        for x, x1, v_max in zip(before.q, axes.q, self._velocity, strict=True):
            if share * abs(x1 - x) > v_max * CYCLE_TIME:
                share = v_max * CYCLE_TIME / abs(x1 - x)
        if share < 1.0:
            dq = [share * v for v in axes.dq]
            ddq = [(v - v1) / CYCLE_TIME for v, v1 in zip(dq, before.dq, strict=True)]
            axes.set_state([x + share * (x1 - x) for x, x1 in zip(before.q, axes.q, strict=True)], dq, ddq)

    def _step_along(self, q: Sequence[float], dq: Sequence[float], velocity: Sequence[float]) -> None:
        """Advances to angles that themselves move, and catches up with them.

        In axes that move along, they are a standing target.

        Args:
            q: The angles.
            dq: Their velocities.
            velocity: The largest ones of the joints.
        """
        axes, h = self._axes, CYCLE_TIME
        behind = [_without_rounding(x - (goal - h * v)) for x, goal, v in zip(axes.q, q, dq, strict=True)]
        slower = [_without_rounding(x - v) for x, v in zip(axes.dq, dq, strict=True)]
        bounds = [
            max(v_max - v if x < 0.0 else v_max + v, _LEAST_SPEED * v_max)
            for x, v, v_max in zip(behind, dq, velocity, strict=True)
        ]
        axes.set_state(behind, slower, axes.ddq)
        axes.step_to_positions([0.0] * len(q), bounds)
        angles = [goal + x for goal, x in zip(q, axes.q, strict=True)]
        axes.set_state(angles, [v + x for v, x in zip(dq, axes.dq, strict=True)], axes.ddq)

    def _takes(self, q: Sequence[float]) -> bool:
        """Advances to these angles if that is inside the bounds by differences; returns whether it is.

        Otherwise the joints would brake for every target along the path. Accelerations may be a little larger: those of
        a plan at its bounds are rounded.
        """
        h = CYCLE_TIME
        dq: list[float] = []
        ddq: list[float] = []
        for x, x1, x2, x3, v_max, a_max, j_max in zip(q, *self._past, self._velocity, *self._bounds, strict=True):
            v, a = (x - x1) / h, (x - 2.0 * x1 + x2) / h**2
            jerk = (x - x3 - 3.0 * (x1 - x2)) / h**3
            if not (abs(jerk) <= _ROUNDED_JERK * j_max and abs(a) <= _ROUNDED * a_max and abs(v) <= v_max):
                return False
            dq.append(v + 0.5 * a * h + jerk * h * h / 3.0)  # As in `derivatives_from_differences`.
            ddq.append(a + jerk * h)
        self._axes.set_state(q, dq, ddq)
        return True


def _without_rounding(x: float) -> float:
    """Returns zero for a difference that is rounding, from which ruckig finds no curve."""
    return 0.0 if abs(x) < _ROUNDING else x


def _state_of(axes: _ruckig.Stepper) -> MotionState:
    return MotionState(list(axes.q), list(axes.dq), list(axes.ddq))


def _stands(axes: _ruckig.Stepper) -> bool:
    slow, weak = _STANDSTILL
    return all(-slow < v < slow for v in axes.dq) and all(-weak < a < weak for a in axes.ddq)
