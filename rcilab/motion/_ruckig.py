"""Time-optimal, jerk-limited profiles by ruckig, as exact piecewise polynomials. No other file imports ruckig.

`intermediate_positions` is never set: a non-empty list would send the problem to a cloud service. Position bounds are
not given to ruckig either (its free edition does not enforce them), and its `position_extrema` ignores the time in
which a joint brakes back inside its bounds (seen with 0.19.4); `plan_joint` checks the curve instead.

Imported with this module and not at the first call (3 ms), because the first call may be a stop inside a cycle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ruckig
from ruckig import Result

from rcilab.core.arrays import Array, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.motion.piecewise import PiecewisePolynomial, join_pieces

_FACTORIALS = (1.0, 1.0, 2.0, 6.0)
_POSITION, _VELOCITY = ruckig.ControlInterface.Position, ruckig.ControlInterface.Velocity
_GOAL_TOLERANCE = 1e-13  # [rad] A larger difference from the goal is not rounding.
_LINE_TOLERANCE = 1e-12  # [rad/s, rad/s^2] Rounding of the derivatives of a motion along its line.


def plan_profile(
    start: JointVector,
    goal: JointVector,
    velocity: JointVector,
    acceleration: JointVector,
    jerk: JointVector,
    start_velocity: JointVector,
    start_acceleration: JointVector,
) -> PiecewisePolynomial:
    """Returns the fastest curve from a moving start to standstill at the goal, with all joints arriving together.

    If the joints start at standstill, or move along the straight line to the goal, they stay on it: the curve is the
    fastest one along the line as a single coordinate, with the bounds of the most restrictive joint. ruckig's own phase
    synchronisation leaves the straight line where one joint bounds the velocity and another the acceleration or jerk.

    Args:
        start: Joint angles at t = 0, shape (n,), [rad].
        goal: Joint angles at the end, shape (n,), [rad].
        velocity: Bounds, shape (n,), [rad/s].
        acceleration: Bounds, shape (n,), [rad/s^2].
        jerk: Bounds, shape (n,), [rad/s^3].
        start_velocity: Joint velocities at t = 0, shape (n,), [rad/s].
        start_acceleration: Joint accelerations at t = 0, shape (n,), [rad/s^2].

    Raises:
        PlanningError: ruckig found no curve; the message says why.
    """
    distance = goal - start
    longest = int(np.abs(distance).argmax())
    ratios = distance / (distance[longest] or 1.0)
    states = np.stack((start_velocity, start_acceleration))
    if distance[longest] != 0.0 and np.allclose(
        states, np.outer(states[:, longest], ratios), rtol=0.0, atol=_LINE_TOLERANCE
    ):
        with np.errstate(divide="ignore", over="ignore"):
            v, a, j = [(bound / np.abs(ratios)).min(keepdims=True) for bound in (velocity, acceleration, jerk)]
        one = slice(longest, longest + 1)
        line = _plan_synchronized(np.zeros(1), distance[one], v, a, j, start_velocity[one], start_acceleration[one])
        coefficients = ratios[:, np.newaxis] * line.coefficients
        coefficients[:, :, 0] += start
        return _corrected_to(goal, PiecewisePolynomial(line.breaks, coefficients))
    return _corrected_to(
        goal, _plan_synchronized(start, goal, velocity, acceleration, jerk, start_velocity, start_acceleration)
    )


def plan_standstill(
    q: JointVector, dq: JointVector, ddq: JointVector, acceleration: JointVector, jerk: JointVector
) -> PiecewisePolynomial:
    """Returns the curve on which every joint stops independently, as fast as its bounds allow.

    Args:
        q: Joint angles, shape (n,), [rad].
        dq: Joint velocities, shape (n,), [rad/s]; any finite value.
        ddq: Joint accelerations, shape (n,), [rad/s^2]; values outside the bounds are first reduced to them.
        acceleration: Bounds, shape (n,), [rad/s^2].
        jerk: Bounds, shape (n,), [rad/s^3].

    Raises:
        PlanningError: ruckig found no curve; the message says why.
    """
    problem = ruckig.InputParameter(len(q))
    problem.control_interface = ruckig.ControlInterface.Velocity
    problem.synchronization = ruckig.Synchronization.No
    problem.current_position = q.tolist()
    problem.current_velocity = dq.tolist()
    problem.current_acceleration = ddq.tolist()
    problem.max_acceleration = acceleration.tolist()
    problem.max_jerk = jerk.tolist()
    return _polynomial(_solve(problem))


class Stepper:
    """Moves every axis independently and time-optimally towards a velocity or a position, one cycle per call.

    Owned by the thread that runs the cycle. Ruckig computes a new curve only after a change of target or state.

    Attributes:
        q: Current positions, plain floats, [rad].
        dq: Current velocities, [rad/s].
        ddq: Current accelerations, [rad/s^2].

    Args:
        q: Positions at the start, [rad].
        dq: Velocities, [rad/s].
        ddq: Accelerations, [rad/s^2].
        acceleration: Bounds, [rad/s^2].
        jerk: Bounds, [rad/s^3].
    """

    q: list[float]
    dq: list[float]
    ddq: list[float]

    def __init__(
        self,
        q: Sequence[float],
        dq: Sequence[float],
        ddq: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
    ) -> None:
        n = len(q)
        self._ruckig = ruckig.Ruckig(n, CYCLE_TIME)
        self._out = ruckig.OutputParameter(n)
        problem = ruckig.InputParameter(n)
        problem.synchronization = ruckig.Synchronization.No
        problem.control_interface = _VELOCITY
        self._by_velocity = True
        self._standstill = [0.0] * n
        self._problem = problem
        self.set_state(q, dq, ddq)
        self.set_limits(acceleration, jerk)

    def set_state(self, q: Sequence[float], dq: Sequence[float], ddq: Sequence[float]) -> None:
        """Continues from another state, [rad], [rad/s], [rad/s^2]."""
        self.q, self.dq, self.ddq = list(q), list(dq), list(ddq)
        problem = self._problem
        problem.current_position, problem.current_velocity, problem.current_acceleration = self.q, self.dq, self.ddq

    def set_limits(self, acceleration: Sequence[float], jerk: Sequence[float]) -> None:
        """Sets the bounds, all above zero, [rad/s^2] and [rad/s^3]."""
        self._problem.max_acceleration = acceleration
        self._problem.max_jerk = jerk

    def step_to_velocity(self, dq: Sequence[float]) -> None:
        """Advances one cycle towards constant velocities, [rad/s]."""
        self._set_velocity_target(dq)
        self._step()

    def step_to_positions(self, ends: Sequence[float | None], dq: Sequence[float]) -> None:
        """Advances one cycle towards standstill at positions.

        Args:
            ends: Positions, [rad]; None for an axis that moves towards its velocity instead.
            dq: Velocity bound of an axis with a position, above zero; target velocity of any other, [rad/s].
        """
        problem = self._problem
        self._by_velocity = False
        problem.per_dof_control_interface = [_VELOCITY if end is None else _POSITION for end in ends]
        problem.target_position = [q if end is None else end for end, q in zip(ends, self.q, strict=True)]
        problem.target_velocity = [v if end is None else 0.0 for end, v in zip(ends, dq, strict=True)]
        problem.max_velocity = [1.0 if end is None else v for end, v in zip(ends, dq, strict=True)]
        self._step()

    def _step(self) -> None:
        """Advances one cycle; if ruckig finds no curve, every axis brakes in this cycle."""
        if not self._update():
            self._set_velocity_target(self._standstill)
            self._ruckig.reset()  # Otherwise it may continue its last curve from the state after that.
            if not self._update():
                raise PlanningError(
                    "no stop exists from this state; its velocities or accelerations are far beyond any robot's"
                )
        out = self._out
        self.q, self.dq, self.ddq = out.new_position, out.new_velocity, out.new_acceleration
        out.pass_to_input(self._problem)

    def _set_velocity_target(self, dq: Sequence[float]) -> None:
        if not self._by_velocity:
            self._problem.per_dof_control_interface = None
            self._by_velocity = True
        self._problem.target_velocity = dq

    def _update(self) -> bool:
        try:
            return self._ruckig.update(self._problem, self._out) in (Result.Working, Result.Finished)
        except (ruckig.RuckigError, ValueError):  # ValueError: a result that its Python binding does not know.
            return False


class PathStepper:
    """Advances a path length time-optimally to a position with a given velocity there, one cycle per call.

    Owned by the thread that runs the cycle. Past that position it continues with that velocity.

    Attributes:
        s: Current path length, in the unit of the path.
        ds: Its velocity, in that unit per second.
        dds: Its acceleration.

    Args:
        s: Path length at the start.
        ds: Velocity at the start.
        dds: Acceleration at the start.
    """

    def __init__(self, s: float = 0.0, ds: float = 0.0, dds: float = 0.0) -> None:
        self.s: float = s
        self.ds: float = ds
        self.dds: float = dds
        self._ruckig = ruckig.Ruckig(1, CYCLE_TIME)
        self._out = ruckig.OutputParameter(1)
        problem = ruckig.InputParameter(1)
        problem.current_position, problem.current_velocity, problem.current_acceleration = [s], [ds], [dds]
        self._problem = problem

    def aim_at(self, s: float, ds: float, velocity: float, acceleration: float, jerk: float) -> None:
        """Moves to a position from the next step on.

        Args:
            s: The position, in the unit of the path.
            ds: Velocity there, 0 to `velocity`.
            velocity: Bound along the path, above zero.
            acceleration: Bound, above zero.
            jerk: Bound, above zero.
        """
        problem = self._problem
        problem.control_interface = _POSITION
        problem.target_position, problem.target_velocity = [s], [ds]
        problem.max_velocity, problem.max_acceleration, problem.max_jerk = [velocity], [acceleration], [jerk]

    def change_to(self, ds: float, acceleration: float, jerk: float) -> None:
        """Changes to a constant velocity from the next step on, inside these bounds, above zero."""
        problem = self._problem
        problem.control_interface = _VELOCITY
        problem.target_velocity, problem.max_acceleration, problem.max_jerk = [ds], [acceleration], [jerk]

    def step(self) -> bool:
        """Advances one cycle; returns False, and does not move, where ruckig finds no curve."""
        out = self._out
        try:
            if self._ruckig.update(self._problem, out) not in (Result.Working, Result.Finished):
                return False
        except (ruckig.RuckigError, ValueError):  # As in `Stepper`.
            return False
        (self.s,), (self.ds,), (self.dds,) = out.new_position, out.new_velocity, out.new_acceleration
        out.pass_to_input(self._problem)
        return True


_REASONS: dict[Any, str] = {
    Result.Error: "the planner failed without a reason",
    Result.ErrorInvalidInput: "the request is not valid",
    Result.ErrorPositionalLimits: "a joint would pass its position limits",
    Result.ErrorExecutionTimeCalculation: "no profile reaches this goal from this start state",
    Result.ErrorSynchronizationCalculation: "the joints cannot be synchronized",
}


def _plan_synchronized(
    start: Array, goal: Array, velocity: Array, acceleration: Array, jerk: Array, start_velocity: Array,
    start_acceleration: Array,
) -> PiecewisePolynomial:  # fmt: skip
    """Returns ruckig's curve to standstill at the goal, with all coordinates in phase where possible."""
    problem = ruckig.InputParameter(len(start))
    problem.synchronization = ruckig.Synchronization.Phase
    problem.current_position = start.tolist()
    problem.current_velocity = start_velocity.tolist()
    problem.current_acceleration = start_acceleration.tolist()
    problem.target_position = goal.tolist()
    problem.max_velocity = velocity.tolist()
    problem.max_acceleration = acceleration.tolist()
    problem.max_jerk = jerk.tolist()
    return _polynomial(_solve(problem))


def _solve(problem: Any) -> Any:
    trajectory = ruckig.Trajectory(problem.degrees_of_freedom)
    try:
        result = ruckig.Ruckig(problem.degrees_of_freedom).calculate(problem, trajectory)
    except ruckig.RuckigError as error:
        reason = str(error).replace("[ruckig]", "").strip()
        raise PlanningError(f"no motion: {reason}; choose another start, goal or speed").coded("no_motion") from error
    except ValueError as error:  # Its Python binding does not know all of ruckig's results, such as -101.
        reason = "the motion would last longer than the planner can represent"
        raise PlanningError(f"no motion: {reason}; choose a higher speed").coded("too_long") from error
    if result not in (Result.Working, Result.Finished):
        reason = _REASONS.get(result, f"the planner returned {result!r}")
        raise PlanningError(f"no motion: {reason}; choose another start, goal or speed").coded("no_motion")
    return trajectory


def _polynomial(trajectory: Any) -> PiecewisePolynomial:
    """Returns the curve of a trajectory: for each joint up to two brake steps, seven steps, then standstill."""
    profiles: list[Any] = trajectory.profiles[0]
    dt = np.array([[*p.brake.t, *p.t] for p in profiles])
    steps = [
        [[*p.brake.p, *p.p], [*p.brake.v, *p.v[:7], 0.0], [*p.brake.a, *p.a[:7], 0.0], [*p.brake.j, *p.j, 0.0]]
        for p in profiles
    ]
    coefficients = np.array(steps).transpose(0, 2, 1) / _FACTORIALS
    starts = np.zeros(coefficients.shape[:2])
    np.cumsum(np.maximum(dt, 0.0), axis=1, out=starts[:, 1:])
    return join_pieces(starts, coefficients, float(trajectory.duration))


def _corrected_to(goal: JointVector, curve: PiecewisePolynomial) -> PiecewisePolynomial:
    """Returns the curve, corrected so that it ends exactly at `goal`.

    ruckig accepts profiles that error the goal by up to 1e-8 rad. A jump of that size in the last cycle would be a jerk
    of about 10 rad/s^3, so the error is spread over the whole motion as a cubic that starts and ends at standstill.
    """
    error = goal - curve.at_end()[0]
    if np.abs(error).max() < _GOAL_TOLERANCE:
        return curve
    total = curve.duration
    u = curve.breaks[:-1, np.newaxis] / total
    coefficients = curve.coefficients.copy()
    coefficients[:, :, 0] += error * u**2 * (3.0 - 2.0 * u)
    coefficients[:, :, 1] += error * 6.0 * u * (1.0 - u) / total
    coefficients[:, :, 2] += error * (3.0 - 6.0 * u) / total**2
    coefficients[:, :, 3] += error * -2.0 / total**3
    return PiecewisePolynomial(curve.breaks, coefficients)
