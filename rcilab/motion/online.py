"""On-line motion generation: joint angles that follow changing commands, cycle by cycle, inside the limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import degrees, isfinite

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_number, as_vector, readonly_copy
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.limits import JointLimits, Limits
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion import _ruckig
from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.motion.end_velocity import braking_limits
from rcilab.motion.joint import MIN_SPEED
from rcilab.motion.stop import plan_stop
from rcilab.motion.tool_velocity import JointSpeedGovernor
from rcilab.motion.twist import Frame, TwistController

POSITION_MARGIN = 1e-4  # [rad] A joint stops this far inside its range: more than the curve's rounding.

_MAX_APPROACH_TIME = 1000.0  # [s] Ruckig represents 7600 s; a joint that would creep longer to its limit stops.
_THERE = 1e-9  # [rad] A joint this close to its target does not move any farther.
_LEAST_PART = 1e-3  # Of the speeds towards a target; below it the joints slow down first.
_STANDSTILL = (1e-9, 1e-6)  # [rad/s], [rad/s^2] Rounding of the curve.


class Jog:
    """Moves an arm by commands that may change in every cycle: a velocity, a twist of the tool, a target, a stop.

    Owned by the thread that runs the cycle: one `step` per cycle of 1 ms returns the joint angles to command. For any
    command at any time, velocity, acceleration and jerk of every joint stay `LIMIT_MARGIN` inside the limits, and a
    joint that moves towards the end of its range stops `POSITION_MARGIN` inside it. A command that exceeds a limit is
    not an error: it is followed as far as the limits allow; see `part` and `is_damped`. Where an arm bounds its
    velocities near the ends of the ranges, a joint stops farther inside, and all accelerate less (`braking_limits`).
    Where it bounds the tool's velocity (`Limits.joint_tool_velocity`), the joints are slower (`JointSpeedGovernor`), so
    that the tool keeps `TOOL_VELOCITY_PART` = 0.85 of the bound.

        jog = Jog(model, robot.state.q_c)
        jog.set_twist([0.05, 0, 0, 0, 0, 0], frame="tool")

        def callback(state, t):
            return JointPosition(q=jog.step() if t > 0 else jog.q)

    Args:
        model: The arm, with its tool.
        q: Current commanded joint angles, shape (n,), [rad].
        dq: Their velocities, shape (n,), [rad/s]; None is standstill. Derivatives, not the backward differences that
            a robot reports: `derivatives_from_differences` converts.
        ddq: Their accelerations, shape (n,), [rad/s^2]; None is zero.
        speed: Part of the velocity limits, of the joints and of the tool, to use, from `MIN_SPEED` = 0.001 to 1.
        limits: Limits to use; None: those of the model.

    Raises:
        InvalidValueError: Not a model, not n finite numbers each, or a speed out of range.
        PlanningError: A joint is outside its limits, or cannot stay inside them: use `plan_stop`.
    """

    def __init__(
        self,
        model: RobotModel,
        q: ArrayLike,
        dq: ArrayLike | None = None,
        ddq: ArrayLike | None = None,
        *,
        speed: float = 1.0,
        limits: Limits | None = None,
    ) -> None:
        self._model = require_model(model)
        bounds = model.limits if limits is None else limits
        n = model.n
        start = as_vector(q, n, "q", "rad")
        velocity = as_vector(np.zeros(n) if dq is None else dq, n, "dq", "rad/s")
        acceleration = as_vector(np.zeros(n) if ddq is None else ddq, n, "ddq", "rad/s^2")
        speed = as_number(speed, "speed")
        if not MIN_SPEED <= speed <= 1.0:
            raise InvalidValueError(
                "speed", speed, f"must be from {MIN_SPEED:g} to 1: the part of the limits to use"
            ).coded("span", low=f"{MIN_SPEED:g}", high="1")
        joint, from_ends = braking_limits(bounds.joint)
        require_stoppable(joint, start, velocity, acceleration)
        self._lower = (joint.lower + POSITION_MARGIN + from_ends).tolist()
        self._upper = (joint.upper - POSITION_MARGIN - from_ends).tolist()
        self._speeds: list[float] = (LIMIT_MARGIN * speed * joint.velocity).tolist()
        a: list[float] = (LIMIT_MARGIN * joint.acceleration).tolist()
        j: list[float] = (LIMIT_MARGIN * joint.jerk).tolist()
        reversal = [3.0 * a_max / j_max for a_max, j_max in zip(a, j, strict=True)]  # [s] To build up and remove a.
        self._joints = list(zip(self._lower, self._upper, a, reversal, j, strict=True))
        self._ranges = list(zip(self._lower, self._upper, strict=True))
        # Over all joints: smallest acceleration limit, longest reversal, largest change of speed during one.
        self._slowest = (
            min(a),
            max(reversal),
            float((joint.acceleration**2 / (2.0 * LIMIT_MARGIN * joint.jerk)).max()),
        )
        self._tool = TwistController(model, bounds.cartesian, self._lower, self._upper, self._speeds, a, j, speed)
        self._governor = None
        if isfinite(bounds.joint_tool_velocity):
            self._governor = JointSpeedGovernor(model, bounds.joint_tool_velocity, j)
        self._axes = _ruckig.Stepper(start.tolist(), velocity.tolist(), acceleration.tolist(), a, j)
        self._zero_velocity = [0.0] * n
        self._goal = self._zero_velocity
        self._part = self._commanded_part = 1.0
        self._advance: Callable[[], None] = self._brake

    @property
    def q(self) -> JointVector:
        """Current joint angles, shape (n,), [rad]."""
        return readonly_copy(self._axes.q)

    @property
    def dq(self) -> JointVector:
        """Current joint velocities, shape (n,), [rad/s]; derivatives of the curve."""
        return readonly_copy(self._axes.dq)

    @property
    def ddq(self) -> JointVector:
        """Current joint accelerations, shape (n,), [rad/s^2]."""
        return readonly_copy(self._axes.ddq)

    @property
    def is_stationary(self) -> bool:
        """True when no joint moves; after `stop` no further steps are needed."""
        slow, weak = _STANDSTILL
        return all(-slow < v < slow for v in self._axes.dq) and all(-weak < a < weak for a in self._axes.ddq)

    @property
    def part(self) -> float:
        """Part of the commanded velocity that the limits allowed in the last cycle, from 0 to 1; 1 for a target.

        The acceleration phase does not count. Joint velocities are reduced by the velocity limits, a twist also
        near the end of a joint's range, so that the tool keeps its direction until it stops there.
        """
        return self._part

    @property
    def is_damped(self) -> bool:
        """True when the arm was so close to a singularity in the last cycle that the tool left the commanded twist."""
        return self._advance == self._follow_twist and self._tool.is_damped

    def set_joint_velocity(self, dq: ArrayLike) -> None:
        """Moves with these joint velocities until the next command.

        Velocities above the limits are all reduced by one factor. Every joint accelerates independently, as fast as its
        limits allow; one that reaches the end of its range stays there while the others move on.

        Args:
            dq: Joint velocities, shape (n,), [rad/s].

        Raises:
            InvalidValueError: dq is not n finite numbers.
        """
        desired = as_vector(dq, self._model.n, "dq", "rad/s").tolist()
        part = min([1.0, *(bound / abs(v) for v, bound in zip(desired, self._speeds, strict=True) if v)])
        self._part = self._commanded_part = part
        self._goal = [part * v for v in desired]
        self._advance = self._keep_velocity

    def set_twist(self, twist: ArrayLike, *, frame: Frame = "base") -> None:
        """Moves the tool with this twist until the next command.

        From one twist to the next the tool's twist changes linearly, with half of the joints' acceleration limits; from
        standstill it moves in the commanded direction at once. Where joints would exceed a velocity limit or reach the
        end of their range, all are slowed down by one factor. At high speed near a singularity that can be too late:
        the joints keep their limits and the tool briefly leaves its path. Closer still, the lost direction is damped
        (`is_damped`), and a tool that would leave its line stops: at the limit of its reach it stops and can move back.
        A 7-axis arm uses the smallest joint velocities for the twist.

        Args:
            twist: Velocity of the tool tip and angular velocity, shape (6,), linear first, [m/s, rad/s]; scaled
                down as a whole if it exceeds the limits of the tool.
            frame: Axes of the twist: those of the base, or the moving ones of the tool.

        Raises:
            InvalidValueError: `twist` is not six finite numbers, or the frame is unknown.
        """
        desired = as_vector(twist, 6, "twist", "m/s, rad/s")
        self._tool.set_goal(desired, frame, is_continued=self._advance == self._follow_twist)
        self._advance = self._follow_twist

    def set_target(self, q: ArrayLike) -> None:
        """Moves to these joint angles and stops there; call it again whenever the target moves.

        Every joint moves independently, as fast as its limits allow; use `plan_joint` for a straight line in joint
        space. A target outside the range is followed to the end of the range.

        Args:
            q: Joint angles, shape (n,), [rad].

        Raises:
            InvalidValueError: q is not n finite numbers.
        """
        desired = as_vector(q, self._model.n, "q", "rad").tolist()
        self._goal = [
            min(max(angle, low), high) for angle, low, high in zip(desired, self._lower, self._upper, strict=True)
        ]
        self._part = 1.0
        self._advance = self._go_to_target

    def stop(self) -> None:
        """Stops every joint independently, as fast as its limits allow, as in `plan_stop`."""
        self._part = 1.0
        self._advance = self._brake

    def step(self) -> JointVector:
        """Advances one cycle and returns the joint angles to command, shape (n,), [rad].

        Raises:
            PlanningError: The planner found no stop; not observed with a state inside the limits.
        """
        self._advance()
        return np.array(self._axes.q)

    def _brake(self) -> None:
        if not self.is_stationary:  # It then stays exactly where it is.
            self._axes.step_to_velocity(self._zero_velocity)

    def _go_to_target(self) -> None:
        axes, speeds = self._axes, self._speeds
        if self._governor is not None:
            moving = [v if abs(b - a) > _THERE else 0.0 for a, b, v in zip(axes.q, self._goal, speeds, strict=True)]
            part = self._governor.part(moving, axes.dq, axes.ddq)
            if part < _LEAST_PART:
                axes.step_to_velocity(self._zero_velocity)
                return
            speeds = [part * v for v in speeds]
        axes.step_to_positions(self._goal, speeds)

    def _keep_velocity(self) -> None:
        goal = self._goal
        if self._governor is not None:
            axes = self._axes
            part = self._governor.part([abs(v) for v in goal], axes.dq, axes.ddq)
            goal = [part * v for v in goal]
            self._part = self._commanded_part * part
        self._step_to_velocity(goal)

    def _follow_twist(self) -> None:
        axes = self._axes
        desired = self._tool.step(axes.q, axes.dq, axes.ddq)
        self._part = self._tool.part
        self._step_to_velocity(desired)

    def _step_to_velocity(self, desired: Sequence[float]) -> None:
        """Advances one cycle towards joint velocities.

        Far from the end of its range a joint is controlled by velocity alone. Where it could not reach the commanded
        velocity and stop again, its target is standstill at the end of its range, with the commanded velocity as a
        bound. By induction the fastest stop from every state stays inside: it does at the start, and each kind of step
        preserves it.
        """
        axes = self._axes
        if self._is_far_inside(desired):
            axes.step_to_velocity(desired)
            return
        ends: list[float | None] = []
        velocities: list[float] = []
        by_velocity = True
        for v_c, q, v, a, (low, high, a_max, reversal, j_max) in zip(
            desired, axes.q, axes.dq, axes.ddq, self._joints, strict=True
        ):
            end, room = (high, high - q) if v_c > 0.0 else (low, q - low)
            speed = abs(v_c)
            peak = max(speed, abs(v)) + a * a / (2.0 * j_max)
            # An upper bound of the distance to remove a, to change to v_c and to stop from there.
            if v_c == 0.0 or room > peak * ((abs(v_c - v) + peak) / a_max + reversal):
                ends.append(None)
                velocities.append(v_c)
            elif room <= 0.0 or speed * _MAX_APPROACH_TIME < room:
                ends.append(None)
                velocities.append(0.0)
            else:
                ends.append(end)
                velocities.append(speed)
                by_velocity = False
        if by_velocity:
            axes.step_to_velocity(velocities)
        else:
            axes.step_to_positions(ends, velocities)

    def _is_far_inside(self, desired: Sequence[float]) -> bool:
        """Returns whether every joint has more range left than it can need to reach its velocity and stop.

        Then velocity control suffices for each joint, at a fifth of the cost of `_step_to_velocity`.
        """
        axes = self._axes
        a_max, reversal, brake_margin = self._slowest
        speed = max(max(desired), -min(desired), max(axes.dq), -min(axes.dq))
        peak = speed + brake_margin
        room = peak * ((2.0 * speed + peak) / a_max + reversal)
        for q, (low, high) in zip(axes.q, self._ranges, strict=True):
            if not low + room < q < high - room:
                return False
        return True


def require_stoppable(limits: JointLimits, q: JointVector, dq: JointVector, ddq: JointVector) -> None:
    """Requires a state inside the limits, from which the fastest stop stays inside them.

    Args:
        limits: Bounds of the joints.
        q: Joint angles, shape (n,), [rad].
        dq: Joint velocities, shape (n,), [rad/s].
        ddq: Joint accelerations, shape (n,), [rad/s^2].

    Raises:
        PlanningError: The message names the joint, the value and the bound.
    """
    # While full jerk removes the acceleration, the velocity still changes by ddq^2 / (2 jerk).
    peak = dq + ddq * np.abs(ddq) / (2.0 * limits.jerk)
    (lowest, _), (highest, _) = plan_stop(limits, q, dq, ddq).polynomial.extremes()
    for name, value, lower, upper, unit in (
        ("angle", q, limits.lower, limits.upper, "rad"),
        ("velocity", dq, -limits.velocity, limits.velocity, "rad/s"),
        ("acceleration", ddq, -limits.acceleration, limits.acceleration, "rad/s^2"),
        ("velocity once the acceleration is zero", peak, -limits.velocity, limits.velocity, "rad/s"),
        ("angle after the fastest stop", lowest, limits.lower, limits.upper, "rad"),
        ("angle after the fastest stop", highest, limits.lower, limits.upper, "rad"),
    ):
        outside = np.flatnonzero(~((lower < value) & (value < upper)))
        if outside.size:
            i = int(outside[0])
            x, bound = float(value[i]), float(upper[i] if value[i] >= upper[i] else lower[i])
            angle = f" ({degrees(x):.2f}°, limit {degrees(bound):.2f}°)" if unit == "rad" else ""
            raise PlanningError(
                f"joint {i + 1}: {name} {x:.4f} {unit} is not inside {bound:.4f} {unit}{angle}; "
                f"start from a state inside the limits, or brake with plan_stop"
            ).coded("jog_start", joint=i + 1)
