"""From a wanted twist of the tool to joint velocities, cycle by cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np

from rcilab.core.arrays import Array, Matrix
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.model.kinematics.forward import build_chain
from rcilab.model.kinematics.jacobian import tool_jacobian
from rcilab.model.robot_model import RobotModel
from rcilab.motion import _ruckig

if TYPE_CHECKING:
    from rcilab.model.dynamics.symmetric_solver import SymmetricSolver

Frame: TypeAlias = Literal["base", "tool"]
"""Axes in which a twist is given; its point is the tool tip in both."""

DAMPED_BELOW = 0.02
"""Singular value of the Jacobian under which a direction is damped, metres and radians taken as they are. Reason: a
tenth of all configurations of the xMates is that close to a singularity, their homes are at 0.15 and above."""

RAMP_PART = 0.5
"""Part of the joints' acceleration and jerk that changes of the twist use. Reason: the rest is for the bending of the
joints' curves, so that the tool keeps its direction."""

TOOL_MARGIN = 0.99
"""Part of the tool's velocity limits that a twist uses. Reason: joints follow each cycle's velocity with a lag of up
to acceleration^2 / (2 jerk), some mm/s at the tool, and not all of them with the same."""

MISSED_PART = 0.1
"""Part of a twist that the tool misses where it stops on the way into a singularity: it is 6 degrees off its line."""

_LOOK = 1e-3  # [rad] How far the fastest joint is moved to see whether a singularity comes nearer.
_CHANGE = RAMP_PART * CYCLE_TIME  # [s] Times an acceleration: how much a velocity may change in a cycle.
_IDENTITY = np.eye(6)
_SAME = 1e-9  # [m/s, rad/s] Twists closer than this are the same; as a number, a weight closer to 1 is 1.
_SLOWEST = 1e-12  # [rad/s] Below this a joint stands.


class TwistController:
    """Turns one twist after another into joint velocities. Owned by the thread that runs the cycle.

    Attributes:
        is_damped: Whether the last step was so close to a singularity that the tool leaves the twist.
        part: Part of the wanted twist that the last step gave, from 0 to 1.

    Args:
        model: The arm, with its tool.
        lower: Joint angles to stop at, [rad].
        upper: Likewise, [rad].
        velocity: Bounds of the joints, [rad/s].
        acceleration: Bounds, [rad/s^2].
        jerk: Bounds, [rad/s^3].
        speed: Part of the tool's velocity limits to use, in (0, 1].
    """

    def __init__(
        self,
        model: RobotModel,
        lower: Sequence[float],
        upper: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
        speed: float,
    ) -> None:
        from rcilab.model.dynamics.symmetric_solver import SymmetricSolver  # Loads for 0.1 s.

        tool = model.limits.cartesian
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
        self._in_tool = False
        self._goal = np.zeros(6)
        self._line = np.zeros((6, 2))  # The twist at the first step, and from there to the goal.
        self._norms = (0.0, 0.0)
        self._weight = 1.0
        self._solver = SymmetricSolver(6)
        self._blend = _ruckig.Stepper([0.0], [0.0], [0.0], [1.0], [1.0])
        self._begins = False
        self._cut = 1.0
        self._allowed = 1.0
        self._last: list[float] | None = None
        self.is_damped = False
        self.part = 1.0

    def lead(self, twist: Array, frame: Frame, *, goes_on: bool) -> None:
        """Takes another wanted twist: the next step starts towards it, from the twist that the tool has then.

        Args:
            twist: Shape (6,), linear first, [m/s, rad/s].
            frame: Its axes.
            goes_on: Whether the tool followed this object in the last cycle: the same twist again changes nothing then.

        Raises:
            InvalidValueError: The frame is unknown.
        """
        if frame not in get_args(Frame):
            raise InvalidValueError("frame", frame, f"is unknown; known: {', '.join(get_args(Frame))}")
        norms = zip(self._speeds, _norms(twist), strict=True)
        self._cut = min([1.0, *(bound / norm for bound, norm in norms if norm > bound)])
        goal, in_tool = self._cut * twist, frame == "tool"
        if goes_on and in_tool == self._in_tool and np.array_equal(goal, self._goal):
            return
        self._goal, self._in_tool = goal, in_tool
        self._weight = 0.0
        self._begins = True
        self._allowed = 1.0
        self._last = None

    def step(self, q: Sequence[float], dq: Sequence[float], ddq: Sequence[float]) -> list[float]:
        """Returns joint velocities to go on with, plain floats, [rad/s].

        Args:
            q: Joint angles, [rad].
            dq: Joint velocities, [rad/s].
            ddq: Joint accelerations, [rad/s^2].
        """
        J, rotation = tool_jacobian(self._chain, q, self._T_flange_tool)
        if self._in_tool:
            # Rows are the same vectors in other axes, so that everything below holds in those, too.
            R = np.array(rotation).reshape(3, 3)
            J = J.T.reshape(-1, 3).dot(R).reshape(-1, 6).T
        inverse, self.is_damped = damped_inverse(J, self._solver)
        wanted = None if self._weight == 1.0 else self._blended(J, inverse, dq, ddq)
        if wanted is None:
            wanted = inverse.dot(self._goal).tolist()
        fidelity = 1.0
        if self.is_damped:
            fidelity = self._fidelity(J, inverse, q, wanted)
            wanted = [fidelity * v for v in wanted]
        # While the twist changes, so do the joint velocities, on purpose.
        last = wanted if self._weight != 1.0 or self._last is None else self._last
        part = self._allowed = self._part_inside(q, wanted, last)
        self._last = wanted
        self.part = part * self._cut * fidelity
        return [part * v for v in wanted]

    def _fidelity(self, J: Matrix, inverse: Matrix, q: Sequence[float], wanted: Sequence[float]) -> float:
        """Returns the part of the velocities that is kept on the way into a singularity, 1 to 0; 1 on the way out.

        There the tool would leave the asked direction and slide along the edge of the reach, and come back by another
        way. It slows down instead as it misses the twist, and stands where it misses `MISSED_PART` of it.
        """
        length = float(np.linalg.norm(self._goal))
        fastest = max(map(abs, wanted))
        if length < _SAME or fastest < _SLOWEST:
            return 1.0
        missed = float(np.linalg.norm(self._goal - J.dot(inverse.dot(self._goal)))) / length
        ahead = [angle + _LOOK / fastest * v for angle, v in zip(q, wanted, strict=True)]
        J_ahead, _ = tool_jacobian(self._chain, ahead, self._T_flange_tool)
        if np.linalg.eigvalsh(J_ahead.dot(J_ahead.T))[0] >= np.linalg.eigvalsh(J.dot(J.T))[0]:
            return 1.0
        return max(0.0, 1.0 - missed / MISSED_PART)

    def _blended(self, J: Matrix, inverse: Matrix, dq: Sequence[float], ddq: Sequence[float]) -> list[float] | None:
        """Returns joint velocities for the twist of this cycle; None when it is the goal.

        It is on the straight line from the twist at the first step to the goal.
        """
        line = self._line
        if self._begins:
            line[:, 0] = J.dot(dq)
            line[:, 1] = self._goal - line[:, 0]
            self._norms = _norms(line[:, 1])
        norms = self._norms
        if max(norms) < _SAME:
            self._weight = 1.0
            return None
        starts, strides = inverse.dot(line).T.tolist()
        rate = rate_change = math.inf  # [1/s], [1/s^2]
        for stride, (a_max, j_max) in zip([*strides, *norms], self._bounds, strict=True):
            if stride := abs(stride):
                rate = a_max / stride if rate * stride > a_max else rate
                rate_change = j_max / stride if rate_change * stride > j_max else rate_change
        blend = self._blend
        if self._begins:
            # What the tool accelerates along the line already goes on; the rest is for the joints to lose.
            change = line[:, 1]
            running = float(change.dot(J.dot(ddq)) / change.dot(change))
            blend.place([0.0], [0.0], [min(max(running, -rate), rate)])
            self._begins = False
        blend.limit([rate], [rate_change])
        blend.towards_velocity([1.0])
        (weight,), (slope,) = blend.dq, blend.ddq
        self._weight = 1.0 if abs(weight - 1.0) < _SAME and abs(slope) < _SAME * rate_change else weight
        return [start + weight * stride for start, stride in zip(starts, strides, strict=True)]

    def _part_inside(self, q: Sequence[float], wanted: Sequence[float], last: Sequence[float]) -> float:
        """Returns the part of joint velocities that keeps their bounds and can be taken back before a range ends.

        Where the joint velocities of the twist change along the way, near singularities above all, it is also so slow
        that the joints can follow: at the part p of the twist they accelerate by p^2 times the bend of their curve.
        """
        part, before = 1.0, self._allowed
        time = rate = rate_change = math.inf  # [s], [1/s], [1/s^2] All joints as one: velocities as parts of `wanted`.
        bend = 1.0  # How much faster than they may the joints accelerated in the last cycle, when above 1.
        for v, v_last, angle, (low, high, v_max, a_max, j_max) in zip(wanted, last, q, self._joints, strict=True):
            speed = abs(v)
            if speed > _SLOWEST:
                room = high - angle if v > 0.0 else angle - low
                # Comparisons cost a quarter of calls of min.
                part = v_max / speed if part * speed > v_max else part
                time = room / speed if time * speed > room else time
                rate = a_max / speed if rate * speed > a_max else rate
                rate_change = j_max / speed if rate_change * speed > j_max else rate_change
            if (growth := abs(v - v_last) * before) > (allowed := _CHANGE * a_max):
                bend = max(bend, growth / allowed)
        if time == math.inf:
            return 1.0
        time -= part * CYCLE_TIME
        if time <= 0.0:
            return 0.0
        rate *= RAMP_PART
        part = min(part, before + rate * CYCLE_TIME, _fastest_before(time, rate, RAMP_PART * rate_change))
        return min(part, before / math.sqrt(bend)) if bend > 1.0 else part


def damped_inverse(J: Matrix, solver: SymmetricSolver) -> tuple[Matrix, bool]:
    """Returns the matrix that turns a twist into the smallest joint velocities, and whether it is damped.

    Damped least squares with numerical filtering (Maciejewski and Klein 1988; Siciliano et al., Robotics, 2009, 3.5):
    a direction whose singular value s is below s0 = `DAMPED_BELOW` is driven by s / s0^2 instead of 1 / s, which fades
    to nothing at the singularity itself; every other direction is exact.

    Args:
        J: Jacobian, shape (6, n).
        solver: Of six equations.

    Returns:
        Shape (n, 6), and True when a direction was damped.
    """
    A = J.dot(J.T)  # For so small matrices half the cost of the operator.
    B = solver.solve(A, _IDENTITY)
    elements = B.ravel()
    # The Frobenius norm is no smaller than the largest eigenvalue of the inverse, 1 / s^2 of the smallest s. It has to
    # be that of B: in the product with J a direction that is lost altogether would cancel.
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
    lost = a / j
    return 0.5 * a * (math.sqrt(lost * lost + 8.0 * distance / a) - lost)


def _norms(twist: Array) -> tuple[float, float]:
    a, b, c, d, e, f = twist.tolist()
    return math.sqrt(a * a + b * b + c * c), math.sqrt(d * d + e * e + f * f)
