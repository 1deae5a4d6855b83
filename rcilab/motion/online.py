"""On-line re-planning: a joint state that follows commands cycle by cycle and never leaves the limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_number, as_vector, readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion import _ruckig
from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.motion.jog_start import require_stoppable
from rcilab.motion.joint import MIN_SPEED
from rcilab.motion.twist import Frame, TwistController

POSITION_MARGIN = 1e-4  # [rad] How far inside its position limits a joint is brought to rest. Tuning value.

_LONGEST = 1000.0  # [s] Ruckig counts to 7600 s; a joint that would creep longer towards its limit stops first.
_STILL = (1e-9, 1e-6)  # [rad/s], [rad/s^2] Below these a joint is at rest: rounding of the curve.


class Jog:
    """Moves an arm by commands that may change in every cycle: a velocity, a twist of the tool, a target, a stop.

    Owned by the thread that runs the cycle: one `step` a cycle of 1 ms gives the joint angles to command. Whatever is
    asked for, and whenever, velocity, acceleration and jerk of every joint stay `LIMIT_MARGIN` inside the limits, and
    a joint that is led towards the end of its range stops `POSITION_MARGIN` inside it. A command that asks for
    more is not refused: it is followed as far as the limits allow, and `part` and `is_damped` say how far.

        jog = Jog(model, robot.state.q_c)
        jog.set_twist([0.05, 0, 0, 0, 0, 0], frame="tool")

        def callback(state, t):
            return JointPosition(q=jog.step() if t > 0 else jog.q)

    Args:
        model: The arm, with its tool.
        q: Commanded joint angles now, shape (n,), [rad].
        dq: Their velocities, shape (n,), [rad/s]; None is rest. Derivatives, not the backward differences that a robot
            reports: `derivatives_from_differences` converts.
        ddq: Their accelerations, shape (n,), [rad/s^2]; None is zero.
        speed: Part of the velocity limits, of the joints and of the tool, to use, from `MIN_SPEED` = 0.001 to 1.

    Raises:
        InvalidValueError: Not a model, not n finite numbers each, or a speed out of range.
        PlanningError: A joint is, or cannot help getting, outside its limits: there is only `plan_stop` then.
    """

    def __init__(
        self,
        model: RobotModel,
        q: ArrayLike,
        dq: ArrayLike | None = None,
        ddq: ArrayLike | None = None,
        *,
        speed: float = 1.0,
    ) -> None:
        self._model = require_model(model)
        n, limits = model.n, model.limits.joint
        start = as_vector(q, n, "q", "rad")
        velocity = as_vector(np.zeros(n) if dq is None else dq, n, "dq", "rad/s")
        acceleration = as_vector(np.zeros(n) if ddq is None else ddq, n, "ddq", "rad/s^2")
        speed = as_number(speed, "speed")
        if not MIN_SPEED <= speed <= 1.0:
            raise InvalidValueError(
                "speed", speed, f"must be from {MIN_SPEED:g} to 1: the part of the limits to use"
            ).coded("span", low=f"{MIN_SPEED:g}", high="1")
        require_stoppable(limits, start, velocity, acceleration)
        self._lower = (limits.lower + POSITION_MARGIN).tolist()
        self._upper = (limits.upper - POSITION_MARGIN).tolist()
        self._speeds: list[float] = (LIMIT_MARGIN * speed * limits.velocity).tolist()
        a: list[float] = (LIMIT_MARGIN * limits.acceleration).tolist()
        j: list[float] = (LIMIT_MARGIN * limits.jerk).tolist()
        let_go = [3.0 * a_max / j_max for a_max, j_max in zip(a, j, strict=True)]  # [s] To build up and take back a.
        self._joints = list(zip(self._lower, self._upper, a, let_go, j, strict=True))
        self._ranges = list(zip(self._lower, self._upper, strict=True))
        # Of all joints: the smallest acceleration, the longest time to let go, the largest change of speed by that.
        self._slowest = min(a), max(let_go), float((limits.acceleration**2 / (2.0 * LIMIT_MARGIN * limits.jerk)).max())
        self._tool = TwistController(model, self._lower, self._upper, self._speeds, a, j, speed)
        self._axes = _ruckig.Stepper(start.tolist(), velocity.tolist(), acceleration.tolist(), a, j)
        self._rest = [0.0] * n
        self._goal = self._rest
        self._part = 1.0
        self._advance: Callable[[], None] = self._brake

    @property
    def q(self) -> JointVector:
        """Joint angles now, shape (n,), [rad]."""
        return readonly_copy(self._axes.q)

    @property
    def dq(self) -> JointVector:
        """Joint velocities now, shape (n,), [rad/s]; derivatives of the curve."""
        return readonly_copy(self._axes.dq)

    @property
    def ddq(self) -> JointVector:
        """Joint accelerations now, shape (n,), [rad/s^2]."""
        return readonly_copy(self._axes.ddq)

    @property
    def is_at_rest(self) -> bool:
        """True when no joint moves; after `stop`, the arm may be left alone then."""
        slow, weak = _STILL
        return all(-slow < v < slow for v in self._axes.dq) and all(-weak < a < weak for a in self._axes.ddq)

    @property
    def part(self) -> float:
        """Part of the commanded velocity that the limits allowed in the last cycle, from 0 to 1; 1 for a target.

        The way up to speed does not count. A joint velocity is cut by the limits of the velocities, a twist also on
        the way to the end of a joint's range, so that the tool keeps its direction until it stands there.
        """
        return self._part

    @property
    def is_damped(self) -> bool:
        """True when the arm was so close to a singularity in the last cycle that the tool left the asked twist."""
        return self._advance == self._follow_twist and self._tool.is_damped

    def set_joint_velocity(self, dq: ArrayLike) -> None:
        """Moves with these joint velocities from now on.

        Velocities above the limits are lowered all by one factor. Every joint goes up to speed for itself, as fast as
        its limits allow; one that reaches the end of its range stays there while the others move on.

        Args:
            dq: Joint velocities, shape (n,), [rad/s].

        Raises:
            InvalidValueError: dq is not n finite numbers.
        """
        wanted = as_vector(dq, self._model.n, "dq", "rad/s").tolist()
        self._part = min([1.0, *(bound / abs(v) for v, bound in zip(wanted, self._speeds, strict=True) if v)])
        self._goal = [self._part * v for v in wanted]
        self._advance = self._keep_velocity

    def set_twist(self, twist: ArrayLike, *, frame: Frame = "base") -> None:
        """Moves the tool with this twist from now on.

        From one twist to the next the tool goes along the straight line between them, at half of what the joints can
        accelerate; from rest it moves in the asked direction at once. Where joints would pass a velocity limit or come
        to the end of their range, all are slowed down by one factor; what comes up too suddenly for that, at high
        speed near a singularity, bends the tool's way for a moment, never a joint's limits. Closer still, the
        direction that is lost is damped (`is_damped`), and a tool that would leave its line for that stops: at the
        edge of the reach it stands, and goes back as it came. A 7-axis arm takes the smallest joint velocities that
        give the twist.

        Args:
            twist: Velocity of the tool tip and angular velocity, shape (6,), linear first, [m/s, rad/s]; lowered as a
                whole where it passes the limits of the tool.
            frame: Axes in which it is given: those of the base, or those of the tool as it turns.

        Raises:
            InvalidValueError: twist is not six finite numbers, or the frame is unknown.
        """
        wanted = as_vector(twist, 6, "twist", "m/s, rad/s")
        self._tool.lead(wanted, frame, goes_on=self._advance == self._follow_twist)
        self._advance = self._follow_twist

    def set_target(self, q: ArrayLike) -> None:
        """Moves to these joint angles, to rest there; call it as often as the target moves.

        Every joint goes for itself as fast as its limits allow, so that a joint that is near waits for nobody; a
        straight line in joint space is what `plan_joint` gives. A target outside the range is followed to its end.

        Args:
            q: Joint angles, shape (n,), [rad].

        Raises:
            InvalidValueError: q is not n finite numbers.
        """
        wanted = as_vector(q, self._model.n, "q", "rad").tolist()
        self._goal = [
            min(max(angle, low), high) for angle, low, high in zip(wanted, self._lower, self._upper, strict=True)
        ]
        self._part = 1.0
        self._advance = self._go_to_target

    def stop(self) -> None:
        """Comes to rest from now on, every joint for itself as fast as its limits allow: the way `plan_stop` gives."""
        self._part = 1.0
        self._advance = self._brake

    def step(self) -> JointVector:
        """Goes on by one cycle and returns the joint angles to command, shape (n,), [rad].

        Raises:
            PlanningError: The planner found no way to stand still; seen with no state that the limits contain.
        """
        self._advance()
        return np.array(self._axes.q)

    def _brake(self) -> None:
        self._axes.towards_velocity(self._rest)

    def _go_to_target(self) -> None:
        self._axes.towards_ends(self._goal, self._speeds)

    def _keep_velocity(self) -> None:
        self._lead(self._goal)

    def _follow_twist(self) -> None:
        axes = self._axes
        wanted = self._tool.step(axes.q, axes.dq, axes.ddq)
        self._part = self._tool.part
        self._lead(wanted)

    def _lead(self, wanted: Sequence[float]) -> None:
        """Goes on towards joint velocities.

        Far from the end of its range a joint is led by velocity alone. Where it could not reach the wanted velocity
        and stop again, it is led to rest at the end of its range, with the wanted velocity as a bound. By induction
        the fastest stop from every state stays inside: it does at the start, and each kind of step keeps it so.
        """
        axes = self._axes
        if self._is_far_inside(wanted):
            axes.towards_velocity(wanted)
            return
        ends: list[float | None] = []
        velocities: list[float] = []
        by_velocity = True
        for v_c, q, v, a, (low, high, a_max, let_go, j_max) in zip(
            wanted, axes.q, axes.dq, axes.ddq, self._joints, strict=True
        ):
            end, room = (high, high - q) if v_c > 0.0 else (low, q - low)
            speed = abs(v_c)
            peak = max(speed, abs(v)) + a * a / (2.0 * j_max)
            # No longer than it takes to let go of a, to change over to v_c and to stop from there.
            if v_c == 0.0 or room > peak * ((abs(v_c - v) + peak) / a_max + let_go):
                ends.append(None)
                velocities.append(v_c)
            elif room <= 0.0 or speed * _LONGEST < room:
                ends.append(None)
                velocities.append(0.0)
            else:
                ends.append(end)
                velocities.append(speed)
                by_velocity = False
        if by_velocity:
            axes.towards_velocity(velocities)
        else:
            axes.towards_ends(ends, velocities)

    def _is_far_inside(self, wanted: Sequence[float]) -> bool:
        """Returns whether every joint has more room than any may need to get to its wanted velocity and to stop.

        Then each is led by velocity alone: what `_lead` finds joint by joint, at a fifth of the cost.
        """
        axes = self._axes
        a_max, let_go, more = self._slowest
        speed = max(max(wanted), -min(wanted), max(axes.dq), -min(axes.dq))
        peak = speed + more
        room = peak * ((2.0 * speed + peak) / a_max + let_go)
        for q, (low, high) in zip(axes.q, self._ranges, strict=True):
            if not low + room < q < high - room:
                return False
        return True
