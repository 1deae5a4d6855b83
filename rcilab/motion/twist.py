"""Joint velocities for a desired twist of the tool, cycle by cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np

from rcilab.core.arrays import Array, Matrix
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import CartesianLimits
from rcilab.model.kinematics.forward import build_chain
from rcilab.model.kinematics.jacobian import tool_jacobian
from rcilab.model.robot_model import RobotModel
from rcilab.motion import _ruckig

if TYPE_CHECKING:
    from rcilab.model.dynamics.symmetric_solver import SymmetricSolver

Frame: TypeAlias = Literal["base", "tool"]
"""Axes of a twist; its reference point is the tool tip in both."""

DAMPED_BELOW = 0.02
"""Singular value of the Jacobian, in m and rad, below which a direction is damped. Reason: a tenth of all
configurations of the xMates are that close to a singularity; their home positions are at 0.15 and above."""

RAMP_PART = 0.5
"""Part of the joints' acceleration and jerk that changes of the twist use. Reason: the rest is for the curvature of the
joints' paths, so that the tool keeps its direction."""

TOOL_MARGIN = 0.98
"""Part of the tool's velocity limits that a twist uses. Reason: the joints lag each cycle's velocity by up to
acceleration^2 / (2 jerk), and by different amounts: some mm/s at the tool, up to 14 mm/s in 200 twists of an xArm6."""

MISSED_PART = 0.1
"""Part of a twist that the tool misses when it stops on the way into a singularity: it is 6 degrees off its line."""

_LEVER = 0.1  # [m] At which a turn that fewer than six joints cannot avoid counts as a velocity; a tuning value.
_LOOKAHEAD = 1e-3  # [rad] Step of the fastest joint to test whether a singularity comes closer.
_CHANGE = RAMP_PART * CYCLE_TIME  # [s] Times an acceleration: the change of a velocity allowed in a cycle.
_IDENTITY = np.eye(6)
_TWIST_TOLERANCE = 1e-9  # [m/s, rad/s] Twists closer than this are equal; also the tolerance of a weight of 1.
_MIN_SPEED = 1e-12  # [rad/s] Below this a joint is stationary.


class TwistController:
    """Computes joint velocities for changing twists. Owned by the thread that runs the cycle.

    Attributes:
        is_damped: Whether the last step was so close to a singularity that the tool leaves the twist.
        part: Part of the desired twist in the last step, from 0 to 1.

    Args:
        model: The arm, with its tool.
        tool: Bounds of the tool.
        lower: Lower ends of the joints' ranges, at which they stop, [rad].
        upper: Upper ends, [rad].
        velocity: Bounds of the joints, [rad/s].
        acceleration: Bounds, [rad/s^2].
        jerk: Bounds, [rad/s^3].
        speed: Part of the tool's velocity limits to use, in (0, 1].
    """

    def __init__(
        self,
        model: RobotModel,
        tool: CartesianLimits,
        lower: Sequence[float],
        upper: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
        speed: float,
    ) -> None:
        from rcilab.model.dynamics.symmetric_solver import SymmetricSolver  # The import takes 0.1 s.

        self._chain, self._T_flange_tool = build_chain(model.description.dh), model.T_flange_tool
        self._joints = list(zip(lower, upper, velocity, acceleration, jerk, strict=True))
        self._speeds = (TOOL_MARGIN * speed * tool.translation_velocity, TOOL_MARGIN * speed * tool.rotation_velocity)
        self._bounds = [
            (RAMP_PART * a_max, RAMP_PART * j_max)
            for a_max, j_max in (
                *zip(acceleration, jerk, strict=True),
                (tool.translation_acceleration, tool.translation_jerk),
                (tool.rotation_acceleration, tool.rotation_jerk),
            )
        ]
        # Fewer than six joints turn a tilted tool a little while they shift it: that is not the end of its reach.
        self._scale = np.array((1.0, 1.0, 1.0, *(3 * (_LEVER if model.n < 6 else 1.0,))))
        self._in_tool = False
        self._goal = np.zeros(6)
        self._line = np.zeros((6, 2))  # The twist at the first step, and its difference to the goal.
        self._norms = (0.0, 0.0)
        self._weight = 1.0
        self._solver = SymmetricSolver(6)
        self._blend = _ruckig.Stepper([0.0], [0.0], [0.0], [1.0], [1.0])
        self._is_first_step = False
        self._goal_scale = 1.0
        self._last_part = 1.0
        self._last_desired: list[float] | None = None
        self.is_damped = False
        self.part = 1.0

    def set_goal(self, twist: Array, frame: Frame, *, is_continued: bool) -> None:
        """Sets the desired twist; the next step starts a transition to it from the twist of the tool at that time.

        Args:
            twist: Shape (6,), linear first, [m/s, rad/s].
            frame: Axes of the twist.
            is_continued: Whether this controller moved the tool in the last cycle; the same twist then has no effect.

        Raises:
            InvalidValueError: The frame is unknown.
        """
        if frame not in get_args(Frame):
            raise InvalidValueError("frame", frame, f"is unknown; known: {', '.join(get_args(Frame))}")
        norms = zip(self._speeds, _norms(twist), strict=True)
        self._goal_scale = min([1.0, *(bound / norm for bound, norm in norms if norm > bound)])
        goal, in_tool = self._goal_scale * twist, frame == "tool"
        if is_continued and in_tool == self._in_tool and np.array_equal(goal, self._goal):
            return
        self._goal, self._in_tool = goal, in_tool
        self._weight = 0.0
        self._is_first_step = True
        self._last_part = 1.0
        self._last_desired = None

    def step(self, q: Sequence[float], dq: Sequence[float], ddq: Sequence[float]) -> list[float]:
        """Returns the joint velocities of the next cycle, plain floats, [rad/s].

        Args:
            q: Joint angles, [rad].
            dq: Joint velocities, [rad/s].
            ddq: Joint accelerations, [rad/s^2].
        """
        J, rotation = tool_jacobian(self._chain, q, self._T_flange_tool)
        if self._in_tool:
            # The rows are the same vectors in other axes, so everything below applies in those, too.
            R = np.array(rotation).reshape(3, 3)
            J = J.T.reshape(-1, 3).dot(R).reshape(-1, 6).T
        inverse, self.is_damped = damped_inverse(J, self._solver)
        desired = None if self._weight == 1.0 else self._blended(J, inverse, dq, ddq)
        if desired is None:
            desired = inverse.dot(self._goal).tolist()
        fidelity = 1.0
        if self.is_damped:
            fidelity = self._fidelity(J, inverse, q, desired)
            desired = [fidelity * v for v in desired]
        # While the twist changes, the joint velocities change intentionally.
        previous = desired if self._weight != 1.0 or self._last_desired is None else self._last_desired
        part = self._last_part = self._part_inside(q, desired, previous)
        self._last_desired = desired
        self.part = part * self._goal_scale * fidelity
        return [part * v for v in desired]

    def _fidelity(self, J: Matrix, inverse: Matrix, q: Sequence[float], desired: Sequence[float]) -> float:
        """Returns the factor on the velocities on the way into a singularity, 1 to 0; 1 on the way out.

        At full velocity the tool would leave the commanded direction, slide along the limit of its reach and return on
        another path. Instead it slows down as it misses the twist, and stops when it misses `MISSED_PART` of it.
        """
        length = float(np.linalg.norm(self._scale * self._goal))
        fastest = max(map(abs, desired))
        if length < _TWIST_TOLERANCE or fastest < _MIN_SPEED:
            return 1.0
        missed = float(np.linalg.norm(self._scale * (self._goal - J.dot(inverse.dot(self._goal))))) / length
        ahead = [angle + _LOOKAHEAD / fastest * v for angle, v in zip(q, desired, strict=True)]
        J_ahead, _ = tool_jacobian(self._chain, ahead, self._T_flange_tool)
        if np.linalg.eigvalsh(J_ahead.dot(J_ahead.T))[0] >= np.linalg.eigvalsh(J.dot(J.T))[0]:
            return 1.0
        return max(0.0, 1.0 - missed / MISSED_PART)

    def _blended(self, J: Matrix, inverse: Matrix, dq: Sequence[float], ddq: Sequence[float]) -> list[float] | None:
        """Returns joint velocities for the twist of this cycle, or None if it is the goal.

        The twist is on the straight line from that of the first step to the goal.
        """
        line = self._line
        if self._is_first_step:
            line[:, 0] = J.dot(dq)
            line[:, 1] = self._goal - line[:, 0]
            self._norms = _norms(line[:, 1])
        norms = self._norms
        if max(norms) < _TWIST_TOLERANCE:
            self._weight = 1.0
            return None
        starts, strides = inverse.dot(line).T.tolist()
        rate = rate_change = math.inf  # [1/s], [1/s^2]
        for stride, (a_max, j_max) in zip([*strides, *norms], self._bounds, strict=True):
            if stride := abs(stride):
                rate = a_max / stride if rate * stride > a_max else rate
                rate_change = j_max / stride if rate_change * stride > j_max else rate_change
        blend = self._blend
        if self._is_first_step:
            # The acceleration along the line continues; the joints remove the rest.
            change = line[:, 1]
            current_rate = float(change.dot(J.dot(ddq)) / change.dot(change))
            blend.set_state([0.0], [0.0], [min(max(current_rate, -rate), rate)])
            self._is_first_step = False
        blend.set_limits([rate], [rate_change])
        blend.step_to_velocity([1.0])
        (weight,), (slope,) = blend.dq, blend.ddq
        self._weight = (
            1.0 if abs(weight - 1.0) < _TWIST_TOLERANCE and abs(slope) < _TWIST_TOLERANCE * rate_change else weight
        )
        return [start + weight * stride for start, stride in zip(starts, strides, strict=True)]

    def _part_inside(self, q: Sequence[float], desired: Sequence[float], previous: Sequence[float]) -> float:
        """Returns the factor on joint velocities that keeps their bounds and allows a stop before the end of a range.

        Where the joint velocities of the twist change along the path, mainly near singularities, the factor is also so
        small that the joints can follow: at a factor p they accelerate by p^2 times the curvature of their path.
        """
        part, before = 1.0, self._last_part
        time = rate = rate_change = math.inf  # [s], [1/s], [1/s^2] Over all joints, relative to `desired`.
        excess = 1.0  # Ratio of the joints' acceleration in the last cycle to the allowed one, if above 1.
        for v, v_last, angle, (low, high, v_max, a_max, j_max) in zip(desired, previous, q, self._joints, strict=True):
            speed = abs(v)
            if speed > _MIN_SPEED:
                room = high - angle if v > 0.0 else angle - low
                # Comparisons take a quarter of the time of calls of min.
                part = v_max / speed if part * speed > v_max else part
                time = room / speed if time * speed > room else time
                rate = a_max / speed if rate * speed > a_max else rate
                rate_change = j_max / speed if rate_change * speed > j_max else rate_change
            if (change := abs(v - v_last) * before) > (max_change := _CHANGE * a_max):
                excess = max(excess, change / max_change)
        if time == math.inf:
            return 1.0
        time -= part * CYCLE_TIME
        if time <= 0.0:
            return 0.0
        rate *= RAMP_PART
        part = min(part, before + rate * CYCLE_TIME, _fastest_before(time, rate, RAMP_PART * rate_change))
        return min(part, before / math.sqrt(excess)) if excess > 1.0 else part


def damped_inverse(J: Matrix, solver: SymmetricSolver) -> tuple[Matrix, bool]:
    """Returns the inverse that gives the smallest joint velocities for a twist, and whether it is damped.

    Damped least squares with numerical filtering (Maciejewski and Klein 1988; Siciliano et al., Robotics, 2009, 3.5):
    a direction whose singular value s is below s0 = `DAMPED_BELOW` is multiplied by s / s0^2 instead of 1 / s, which
    is zero at the singularity itself; every other direction is exact.

    Args:
        J: Jacobian, shape (6, n).
        solver: Solver for six equations.

    Returns:
        Shape (n, 6), and True if a direction is damped.
    """
    A = J.dot(J.T)  # For matrices this small, half the time of the operator.
    B = solver.solve(A, _IDENTITY)
    elements = B.ravel()
    # The Frobenius norm is at least the largest eigenvalue of the inverse, 1 / s^2 of the smallest s. It must be that
    # of B: in the product with J a completely lost direction would cancel.
    if elements.dot(elements) < DAMPED_BELOW**-4 and solver.has_solved:
        return J.T.dot(B), False
    squares, U = np.linalg.eigh(A)
    weights = 1.0 / np.maximum(squares, DAMPED_BELOW**2)
    return J.T.dot((U * weights).dot(U.T)), bool(squares[0] < DAMPED_BELOW**2)


def _fastest_before(distance: float, a: float, j: float) -> float:
    """Returns the velocity from which a stop at acceleration a and jerk j takes this distance.

    With a trapezoid of acceleration d = v / 2 (v / a + a / j), with a triangle d = v sqrt(v / j).
    """
    if distance < a**3 / j**2:
        return (distance * distance * j) ** (1.0 / 3.0)
    time = a / j
    return 0.5 * a * (math.sqrt(time * time + 8.0 * distance / a) - time)


def _norms(twist: Array) -> tuple[float, float]:
    a, b, c, d, e, f = twist.tolist()
    return math.sqrt(a * a + b * b + c * c), math.sqrt(d * d + e * e + f * f)
