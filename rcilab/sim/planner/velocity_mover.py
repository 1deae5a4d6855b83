"""On-line motion with constant velocities, of the joints or of the tool."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.limits import Limits
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import angle_text
from rcilab.motion.online import Jog
from rcilab.motion.twist import RAMP_PART, Frame
from rcilab.sim.planner.joint_movers import StopMover
from rcilab.sim.planner.mover import MotionState
from rcilab.sim.planner.planner_event import Refusal, RefusalReason
from rcilab.sim.planner.section_bounds import joint_bounds
from rcilab.sim.planner.target import JointSpeed, ToolSpeed

_ABOVE = 1.001  # Part of the present acceleration that the bound is at least: it must be inside.
_BLOCKED_BELOW = 0.01  # Part of its twist at which the tool counts as stopped; a tuning value.
_AT_END = 2e-3  # [rad] From the end of its range, where a joint has stopped, or almost; a tuning value.
_SLOWEST = 0.01  # Part of its acceleration and jerk that a joint may use at least, also where its change is small.


class VelocityMover:
    """Moves with joint velocities or a twist of the tool until the next command, or for a time.

    Args:
        model: The arm with its tool.
        limits: Its limits.
        state: Where it begins.

    Raises:
        PlanningError: The arm stands outside the range of a joint.
    """

    def __init__(self, model: RobotModel, limits: Limits, state: MotionState) -> None:
        self._model, self._limits = model, limits
        self._used: Limits | None = None  # By the jog.
        self._jog: Jog | None = None
        self._stop: StopMover | None = StopMover(limits.joint, state)  # Before the command.
        self._command: Callable[[Jog], None] = Jog.stop
        self._end: Callable[[Jog], None] = Jog.stop  # After the time of the command.
        self._is_stopping = True
        self._is_twist = False
        self._cycles: int | None = None  # Until it stops.
        if self._stop.is_stationary:
            self._jog, self._stop = Jog(model, state.q, limits=limits), None

    @property
    def state(self) -> MotionState:
        """Where the joints are and how they move."""
        jog = self._jog
        if jog is not None:
            return MotionState(jog.q.tolist(), jog.dq.tolist(), jog.ddq.tolist())
        assert self._stop is not None
        return self._stop.state

    @property
    def is_stationary(self) -> bool:
        """Whether the arm stands and is not to move."""
        return self._is_stopping and self._jog is not None and self._jog.is_stationary

    @property
    def obstruction(self) -> Refusal | None:
        """Why the tool has stopped, or almost, before the end of its twist; None: it has not, or joints move."""
        jog = self._jog
        if self._is_stopping or not self._is_twist or jog is None or jog.part >= _BLOCKED_BELOW:
            return None
        return _BLOCKED if jog.is_damped else self._find_end(jog)

    def set_joint_velocity(
        self, dq: Sequence[float], speed: JointSpeed, *, is_synchronized: bool, duration: float | None
    ) -> None:
        """Moves the joints with constant velocities from the next step on.

        Args:
            dq: n finite numbers, [rad/s].
            speed: Bounds of the joints.
            is_synchronized: Whether all joints reach their velocity at the same time.
            duration: Time after which it stops, [s]; None: it does not.
        """
        joint, state = self._limits.joint, self.state
        bounds = joint_bounds(joint, speed)
        excess = float((np.abs(np.array(dq)) / bounds.velocity).max())
        wanted = np.array(dq) / max(1.0, excess)
        parts: float | Array = 1.0
        if is_synchronized:
            changes = np.abs(wanted - state.dq)
            parts = np.maximum(changes / (changes.max() or 1.0), _SLOWEST)
        present = np.minimum(_ABOVE * np.abs(np.array(state.ddq)), joint.acceleration)
        acceleration = np.maximum(parts * bounds.acceleration, present)
        limits = replace(joint, acceleration=readonly_copy(acceleration), jerk=readonly_copy(parts * bounds.jerk))
        self._is_twist = False
        self._begin(replace(self._limits, joint=limits), lambda jog: jog.set_joint_velocity(wanted), any(dq), duration)
        still = [0.0] * len(wanted)
        self._end = lambda jog: self.set_joint_velocity(still, speed, is_synchronized=is_synchronized, duration=None)

    def set_twist(self, twist: Sequence[float], speed: ToolSpeed, frame: Frame, duration: float | None) -> None:
        """Moves the tool with a constant twist from the next step on.

        Args:
            twist: Six finite numbers, linear first, [m/s, rad/s].
            speed: Bounds of the tool.
            frame: Axes of the twist.
            duration: Time after which it stops, [s]; None: it does not.

        Raises:
            InvalidValueError: The frame is unknown.
        """
        cartesian = self._limits.cartesian
        wanted = {  # A change of the twist uses `RAMP_PART` of these.
            "translation_velocity": speed.velocity,
            "translation_acceleration": None if speed.acceleration is None else speed.acceleration / RAMP_PART,
            "translation_jerk": None if speed.jerk is None else speed.jerk / RAMP_PART,
            "rotation_velocity": speed.rotation_velocity,
            "rotation_acceleration": (
                None if speed.rotation_acceleration is None else speed.rotation_acceleration / RAMP_PART
            ),
            "rotation_jerk": None if speed.rotation_jerk is None else speed.rotation_jerk / RAMP_PART,
        }
        inside = {name: min(x, getattr(cartesian, name)) for name, x in wanted.items() if x is not None}
        limits = replace(self._limits, cartesian=replace(cartesian, **inside))
        self._end = lambda jog: jog.set_twist(np.zeros(6), frame=frame)
        self._is_twist = True
        self._begin(limits, lambda jog: jog.set_twist(twist, frame=frame), any(twist), duration)

    def end(self) -> None:
        """Stops as after the time of its command: a tool on its line."""
        self._cycles = 0

    def step(self) -> list[float]:
        """Advances one cycle and returns the joint angles, n plain floats, [rad]."""
        stop = self._stop
        if stop is not None:
            q = stop.step()
            if stop.is_stationary:
                self._jog, self._stop, self._used = Jog(self._model, q, limits=self._limits), None, self._limits
                self._command(self._jog)
            return q
        assert self._jog is not None
        if self._cycles is not None:
            self._cycles -= 1
            if self._cycles < 0:
                self._cycles = None
                self._is_stopping = True
                self._end(self._jog)
                return self.step()
        return self._jog.step().tolist()

    def _find_end(self, jog: Jog) -> Refusal | None:
        """Finds a joint that stands at the end of its range, or almost, on the side to which it moves."""
        joint = self._limits.joint
        for number, (q, dq, lower, upper) in enumerate(
            zip(jog.q.tolist(), jog.dq.tolist(), joint.lower.tolist(), joint.upper.tolist(), strict=True), 1
        ):
            bound = lower if q - lower < _AT_END and dq <= 0.0 else upper if upper - q < _AT_END and dq >= 0.0 else None
            if bound is not None:
                text = f"joint {number} is at the end of its range, {angle_text(bound)}: the tool cannot move on"
                remark = Remark(text, "range_end", joint=number, value=q, bound=bound, unit="rad")
                return Refusal(
                    reason=RefusalReason.JOINT_RANGE, remark=remark, share=1.0, joint=number, value=q, bound=bound
                )
        return None

    def _begin(self, limits: Limits, command: Callable[[Jog], None], is_moving: bool, duration: float | None) -> None:
        self._is_stopping = not is_moving
        self._cycles = None if duration is None else round(duration / CYCLE_TIME)
        self._command = command
        for allowed in (limits, self._limits):
            try:
                command(self._jog_inside(allowed))
            except PlanningError:  # A joint could not stop inside its range, or inside its velocity, with these.
                continue
            self._stop = None
            return
        self._jog, self._stop = None, StopMover(self._limits.joint, self.state)

    def _jog_inside(self, limits: Limits) -> Jog:
        """Returns the jog that continues inside these limits."""
        if self._jog is None or self._used is None or not _are_equal(limits, self._used):
            self._jog = Jog(self._model, *self.state, limits=limits)
            self._used = limits
        return self._jog


_BLOCKED = Refusal(
    reason=RefusalReason.UNREACHABLE,
    remark=Remark(
        "the tool cannot move on with this velocity: it is at the end of its reach, or at a singular pose",
        "twist_blocked",
    ),
    share=1.0,
)


def _are_equal(a: Limits, b: Limits) -> bool:
    if a.cartesian != b.cartesian:
        return False
    return all(
        np.array_equal(getattr(a.joint, name), getattr(b.joint, name)) for name in ("velocity", "acceleration", "jerk")
    )
