"""The planner of a controller that plans motions by itself, cycle by cycle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from math import dist, inf

import numpy as np

from rcilab.core.arrays import as_vector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, KinematicsError, PlanningError
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel
from rcilab.motion.differences import derivatives_from_differences
from rcilab.motion.twist import Frame
from rcilab.sim.planner.joint_movers import JointMover, StopMover, StreamMover
from rcilab.sim.planner.mover import MotionState, Mover
from rcilab.sim.planner.path_motion import PathMotion
from rcilab.sim.planner.planner_event import EventKind, PlannerEvent, PlannerStep, Refusal, RefusalReason
from rcilab.sim.planner.preparation import PlannedArm, find_outside, refusal_of
from rcilab.sim.planner.section import PoseSolver
from rcilab.sim.planner.stream_filter import StreamMode
from rcilab.sim.planner.target import ArcTarget, JointSpeed, JointTarget, PauseTarget, SplineTarget, Target, ToolSpeed
from rcilab.sim.planner.tool_mover import ToolMover
from rcilab.sim.planner.velocity_mover import VelocityMover

_FASTEST, _FASTEST_TOOL = JointSpeed(), ToolSpeed()
_LONGEST_PAUSE = 1e6  # [s]
_LARGEST_ANGLE = 1e4  # [rad] Of a circle with many turns.


class PlannerState(Enum):
    """What a planner does."""

    IDLE = "stands, with nothing to do"
    MOVING = "moves, or is about to"
    PAUSED = "stands on its path until `resume`"


class Planner:
    """Moves an arm by targets and commands that may come at any time. Owned by the loop of the controller.

    `step` is called once a cycle of 1 ms, and returns joint angles inside the limits of position, velocity,
    acceleration and jerk. Every other method returns at once, and acts from the next step on.

        planner = Planner(model, model.limits, arm.commanded.q)
        planner.add(LineTarget(id=1, pose=pose, speed=ToolSpeed(velocity=0.1), blend=Blend(radius=0.02)))
        q, events = planner.step()

    There are three kinds of motion. A command of one kind ends the others: queued targets are discarded, and what moves
    continues smoothly into the new motion. Only queued targets begin at standstill: they wait for it.

    * Queued targets (`add`), one after the other along exact paths, with `pause`, `resume`, `end`, `clear_queue`,
      `skip` and an override. Events report which began, ended or were refused.
    * On-line commands: `move_joints`, `move_tool`, `set_joint_velocity`, `set_twist`. The newest one counts.
    * Servo: `servo_joints`, `servo_tool`, `follow_joints`, `follow_tool`: the newest target, nothing planned ahead.

    Args:
        model: The arm with its tool.
        limits: Its limits for these motions; finite, above zero.
        q: Joint angles of the stationary arm, n plain floats, [rad].
        slows_down: Whether a path of the tool is followed more slowly where a joint would exceed its limits. False: it
            keeps its speed, and the checks of the arm report the joint.
    """

    def __init__(self, model: RobotModel, limits: Limits, q: Sequence[float], *, slows_down: bool = True) -> None:
        self._arm = PlannedArm(model, limits, PoseSolver(model), slows_down)
        self._override = 1.0
        self._pending: list[PlannerEvent] = []
        self._queue = PathMotion(self._arm, q)
        self._mover: Mover | None = None
        self._obstruction: Refusal | None = None  # Of an on-line line that has ended before its goal.
        self._q = list(q)
        self._past = (self._q,) * 3  # The last angles, the newest first.

    def reset(self, q: Sequence[float]) -> None:
        """Discards all targets and stands at other joint angles, after something else has moved or stopped the arm.

        Args:
            q: Joint angles of the stationary arm, n plain floats, [rad].
        """
        self._pending += self._queue.discard()
        self._queue = PathMotion(self._arm, q)
        self._queue.set_override(self._override)
        self._mover = self._obstruction = None
        self._q = list(q)
        self._past = (self._q,) * 3

    def place(self, q: Sequence[float]) -> None:
        """Sets where the standing arm is before a motion begins, n plain floats, [rad]; queued targets wait.

        An on-line command from elsewhere is dropped.
        """
        if list(q) != self._q:
            self._q, self._mover = list(q), None
            self._past = (self._q,) * 3
            self._queue.begin_at(q)

    def configure(self, model: RobotModel, limits: Limits) -> None:
        """Sets another tool, load or other limits; at standstill, without targets.

        Args:
            model: The arm with its tool.
            limits: Its limits for these motions.
        """
        self._arm = PlannedArm(model, limits, PoseSolver(model), self._arm.slows_down)
        self.reset(self._q)

    @property
    def state(self) -> PlannerState:
        """What it does."""
        if self._mover is not None:
            if not self._mover.is_stationary:
                return PlannerState.MOVING
        elif self._queue.is_paused and self._queue.is_stationary:
            return PlannerState.PAUSED
        return PlannerState.IDLE if self._queue.is_idle else PlannerState.MOVING

    @property
    def obstruction(self) -> Refusal | None:
        """Why an on-line motion of the tool has stopped, or almost, before its goal or the end of its twist."""
        return self._mover.obstruction if isinstance(self._mover, VelocityMover) else self._obstruction

    @property
    def q(self) -> list[float]:
        """Joint angles of the last cycle, n plain floats, [rad]."""
        return list(self._q)

    @property
    def queued(self) -> int:
        """Number of targets that have not ended, the running one among them."""
        return self._queue.queued

    @property
    def current(self) -> Target | None:
        """The target that has begun and not ended; None without one."""
        return self._queue.current

    @property
    def end_q(self) -> list[float] | None:
        """Joint angles at the end of the queue, n plain floats, [rad]; None: they are not known yet."""
        is_moving = self._mover is not None and not self._mover.is_stationary
        return None if is_moving else self._queue.end_q if self.queued else self.q

    @property
    def streamed(self) -> list[float] | None:
        """The newest streamed angles, n plain floats, [rad]; None while another motion, or none, is followed."""
        mover = self._mover
        return mover.target if isinstance(mover, StreamMover) else None

    @property
    def progress(self) -> float:
        """Share of the path of the current target, 0 to 1; 1 without one."""
        return self._queue.progress

    def add(self, target: Target) -> None:
        """Appends a target to the queue.

        Its path and the angles of the joints along it are computed in the next cycles, ahead of its turn. If it cannot
        be followed, the event REFUSED reports it when its turn comes, and those behind it are discarded.

        Raises:
            InvalidValueError: A value of it is not valid.
        """
        self._require(target)
        self._queue.add(target)

    def pause(self) -> None:
        """Stops on the path of the queued targets, inside their speed; `resume` continues on it."""
        self._queue.pause()

    def resume(self) -> None:
        """Continues after `pause`."""
        self._queue.resume()

    def set_override(self, part: float) -> None:
        """Multiplies the velocities of queued targets, the running one too; above 0, up to 1.

        Raises:
            InvalidValueError: It is not.
        """
        if not 0.0 < part <= 1.0:
            raise InvalidValueError("override", part, "must be above 0, up to 1")
        self._override = part
        self._queue.set_override(part)

    def end(self) -> None:
        """Stops on the path, inside the speed of the target, and discards all targets (slow stop)."""
        if isinstance(self._mover, VelocityMover):
            self._mover.end()
            self._pending += self._queue.discard()
        elif self._mover is not None:
            self.stop()
        elif self._queue.is_stationary:
            self._pending += self._queue.discard()
        else:
            self._queue.end()

    def stop(self) -> None:
        """Stops every joint by itself, as fast as the limits allow, and discards all targets."""
        self._take_over(StopMover(self._arm.limits.joint, self._running_state()))

    def clear_queue(self) -> None:
        """Discards the targets to which the path does not lead yet; the running one continues."""
        self._pending += self._queue.clear_queue()

    def skip(self) -> None:
        """Discards the current target of the standing arm, after `pause`; those after it begin where the arm is."""
        self._pending += self._queue.skip()

    def move_joints(self, q: Sequence[float], speed: JointSpeed = _FASTEST) -> Refusal | None:
        """Moves to joint angles from the running state; all joints arrive together.

        Args:
            q: n finite numbers, [rad].
            speed: Of the joints.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: q is not n finite numbers.
            PlanningError: No curve leads there from the running state; the motion in progress continues.
        """
        goal = as_vector(q, self._arm.model.n, "q", "rad").tolist()
        _require_speed(speed, self._arm.model.n)
        refusal = self._outside(goal)
        if refusal is None:
            mover = self._mover
            if isinstance(mover, JointMover):
                mover.set_goal(goal, speed)
            else:
                mover = JointMover(self._arm.limits.joint, self._running_state())
                mover.set_goal(goal, speed)
                self._take_over(mover)
        return refusal

    def move_tool(self, pose: Pose, speed: ToolSpeed = _FASTEST_TOOL) -> Refusal | None:
        """Moves the tool to a pose from the running state, on a straight line if it stands or moves along that line.

        Args:
            pose: Pose of the tool in base.
            speed: Of the tool.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: A speed is not valid.
        """
        _require_speed(speed, self._arm.model.n)
        if isinstance(self._mover, ToolMover):
            return self._mover.set_goal(pose, speed)
        mover = ToolMover(self._arm, self._running_state())
        refusal = mover.set_goal(pose, speed)
        if refusal is None:
            self._take_over(mover)
        return refusal

    def set_joint_velocity(
        self,
        dq: Sequence[float],
        *,
        speed: JointSpeed = _FASTEST,
        is_synchronized: bool = True,
        duration: float | None = None,
    ) -> Refusal | None:
        """Moves the joints with constant velocities until the next command; at the end of its range a joint stops.

        Args:
            dq: n finite numbers, [rad/s].
            speed: Its acceleration and jerk apply; velocities above its velocity are all reduced by one factor.
            is_synchronized: Whether all joints reach their velocity at the same time.
            duration: Time after which it stops, [s]; None: it does not.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: dq is not n finite numbers, or a speed is not valid.
        """
        desired = as_vector(dq, self._arm.model.n, "dq", "rad/s").tolist()
        _require_speed(speed, self._arm.model.n)
        return self._move_by_velocity(
            lambda mover: mover.set_joint_velocity(desired, speed, is_synchronized=is_synchronized, duration=duration)
        )

    def set_twist(
        self,
        twist: Sequence[float],
        *,
        speed: ToolSpeed = _FASTEST_TOOL,
        frame: Frame = "base",
        duration: float | None = None,
    ) -> Refusal | None:
        """Moves the tool with a constant twist until the next command, more slowly where a joint cannot follow.

        Args:
            twist: Velocity of the tool tip and angular velocity, linear first, [m/s, rad/s].
            speed: Its accelerations and jerks apply; a twist above its velocities is reduced.
            frame: Axes of the twist: those of the base, or the moving ones of the tool.
            duration: Time after which it stops, [s]; None: it does not.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: The twist is not six finite numbers, the frame is unknown, or a speed is not valid.
        """
        desired = as_vector(twist, 6, "twist", "m/s, rad/s").tolist()
        _require_speed(speed, self._arm.model.n)
        return self._move_by_velocity(lambda mover: mover.set_twist(desired, speed, frame, duration))

    def servo_joints(
        self,
        q: Sequence[float],
        *,
        mode: StreamMode = "direct",
        velocity: float | None = None,
        tool_speed: float | None = None,
    ) -> Refusal | None:
        """Moves every joint by itself to the newest angles, with the largest acceleration and jerk.

        Args:
            q: n finite numbers, [rad].
            mode: "direct", or "linear" for a stream that is followed one period later.
            velocity: Of every joint, above zero, [rad/s]; None: the limits.
            tool_speed: Which the tool does not pass to make up for targets of a "linear" stream that come late or
                together, above zero, [m/s]; None: any.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: q is not n finite numbers, or the velocity is not valid.
        """
        return self.follow_joints(q, mode=mode, velocity=velocity, tool_speed=tool_speed)

    def servo_tool(
        self,
        pose: Pose,
        *,
        mode: StreamMode = "direct",
        velocity: float | None = None,
        tool_speed: float | None = None,
        max_step: float | None = None,
    ) -> Refusal | None:
        """Moves every joint by itself to the angles of the newest pose, as `servo_joints`.

        Args:
            pose: Pose of the tool in base.
            mode: As for `servo_joints`.
            velocity: Of every joint, above zero, [rad/s]; None: the limits.
            tool_speed: As for `servo_joints`.
            max_step: Largest distance from the last pose, [m]; None: any.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: The velocity is not valid.
        """
        return self.follow_tool(pose, mode=mode, velocity=velocity, tool_speed=tool_speed, max_step=max_step)

    def follow_joints(
        self,
        q: Sequence[float],
        *,
        mode: StreamMode = "direct",
        smoothing: float = 0.0,
        velocity: float | None = None,
        tool_speed: float | None = None,
    ) -> Refusal | None:
        """Follows streamed joint angles, smoothed, as `servo_joints`.

        Args:
            q: n finite numbers, [rad].
            mode: As they come, on a curve through them, or low-pass filtered.
            smoothing: Of the curve or the filter, 0 to 1.
            velocity: Of every joint, above zero, [rad/s]; None: the limits.
            tool_speed: As for `servo_joints`.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: A value is not valid.
        """
        goal = as_vector(q, self._arm.model.n, "q", "rad").tolist()
        speed = JointSpeed(velocity=velocity)
        _require_speed(speed, self._arm.model.n)
        if not 0.0 <= smoothing <= 1.0:
            raise InvalidValueError("smoothing", smoothing, "must be from 0 to 1")
        refusal = self._outside(goal)
        if refusal is not None:
            return refusal
        mover = self._mover
        if not isinstance(mover, StreamMover):
            mover = StreamMover(self._arm.model, self._arm.limits.joint, self._running_state())
            self._take_over(mover)
        mover.take(goal, speed, mode, smoothing, tool_speed)
        return None

    def follow_tool(
        self,
        pose: Pose,
        *,
        mode: StreamMode = "direct",
        smoothing: float = 0.0,
        velocity: float | None = None,
        tool_speed: float | None = None,
        max_step: float | None = None,
    ) -> Refusal | None:
        """Follows streamed poses of the tool by the nearest joint angles, smoothed, as `follow_joints`.

        Args:
            pose: Pose of the tool in base.
            mode: As for `follow_joints`.
            smoothing: As for `follow_joints`.
            velocity: Of every joint, above zero, [rad/s]; None: the limits.
            tool_speed: As for `servo_joints`.
            max_step: Largest distance from the last pose, [m]; None: any.

        Returns:
            Why the command is refused, without effect; None: it is followed.

        Raises:
            InvalidValueError: A value is not valid.
        """
        model = self._arm.model
        near = self._q if self.streamed is None else self.streamed
        if max_step is not None:
            step = dist(model.forward(near).parts[1], pose.parts[1])
            if step > max_step:
                remark = Remark(
                    f"the pose is {1e3 * step:.4g} mm from the last one, more than {1e3 * max_step:.4g} mm",
                    "target_step",
                    value=step,
                    bound=max_step,
                    unit="m",
                )
                return Refusal(reason=RefusalReason.STEP, remark=remark, value=step, bound=max_step)
        try:
            goal = self._arm.solver.next_to(pose, near)
        except KinematicsError as error:
            return refusal_of(error, 1.0)
        return self.follow_joints(goal, mode=mode, smoothing=smoothing, velocity=velocity, tool_speed=tool_speed)

    def take_events(self) -> tuple[PlannerEvent, ...]:
        """Returns the events since the last step, for a cycle without one."""
        events, self._pending = self._pending, []
        return tuple(events)

    def step(self) -> PlannerStep:
        """Advances one cycle."""
        events = [*self.take_events()]
        try:
            if self._mover is not None:
                self._q = self._mover.step()
                if isinstance(self._mover, ToolMover) and self._mover.obstruction is not None:
                    obstruction = self._mover.obstruction
                    self.stop()
                    self._obstruction = obstruction
                if self._queue.queued and self._mover.is_stationary:
                    self._mover = None
                    self._queue.begin_at(self._q)
            else:
                self._q, more = self._queue.step()
                events += more
        except KinematicsError as error:  # Between two samples that were reachable.
            current = self._queue.current
            if current is not None:
                events.append(PlannerEvent(current.id, EventKind.REFUSED, refusal_of(error, self.progress)))
            self.stop()
        self._past = (self._q, *self._past[:2])
        return PlannerStep(self._q, tuple(events))

    def _running_state(self) -> MotionState:
        try:
            return self._queue.state if self._mover is None else self._mover.state
        except KinematicsError:  # Near a pose that cannot be reached.
            q, q1, q2 = (np.array(row) for row in self._past)
            dq, ddq = derivatives_from_differences((q - q1) / CYCLE_TIME, (q - 2.0 * q1 + q2) / CYCLE_TIME**2)
            return MotionState(q.tolist(), dq.tolist(), ddq.tolist())

    def _take_over(self, mover: Mover) -> None:
        """Moves by another mover from the next step on; all targets are discarded."""
        self._mover, self._obstruction = mover, None
        self._pending += self._queue.discard()

    def _move_by_velocity(self, command: Callable[[VelocityMover], None]) -> Refusal | None:
        mover = self._mover
        if not isinstance(mover, VelocityMover):
            try:
                mover = VelocityMover(self._arm.model, self._arm.limits, self._running_state())
            except PlanningError as error:
                remark = Remark(str(error), "target_outside")
                return Refusal(reason=RefusalReason.JOINT_RANGE, remark=remark)
        command(mover)
        self._take_over(mover)
        return None

    def _outside(self, q: Sequence[float]) -> Refusal | None:
        limits = self._arm.limits.joint
        return find_outside(q, list(zip(limits.lower.tolist(), limits.upper.tolist(), strict=True)), 1.0)

    def _require(self, target: Target) -> None:
        n = self._arm.model.n
        if isinstance(target, JointTarget):
            if (target.q is None) == (target.pose is None):
                raise InvalidValueError("joint target", target.id, "needs joint angles or a pose, and not both")
            if target.q is not None:
                as_vector(target.q, n, "q", "rad")
        elif isinstance(target, PauseTarget):
            if not 0.0 <= target.seconds < _LONGEST_PAUSE:
                problem = f"must be 0 or more, below {_LONGEST_PAUSE:g} [s]"
                raise InvalidValueError("pause", target.seconds, problem)
        elif isinstance(target, SplineTarget):
            if not target.poses:
                raise InvalidValueError("poses", (), "must be at least one")
        elif isinstance(target, ArcTarget) and target.angle is not None and not 0.0 < target.angle < _LARGEST_ANGLE:
            raise InvalidValueError("angle", target.angle, f"must be above 0, below {_LARGEST_ANGLE:g} [rad]")
        if not isinstance(target, PauseTarget):
            _require_speed(target.speed, n)


def _require_speed(speed: JointSpeed | ToolSpeed, n: int) -> None:
    for name in speed.__slots__:
        value: float | tuple[float, ...] | None = getattr(speed, name)
        numbers = value if isinstance(value, tuple) else () if value is None else (value,)
        if isinstance(value, tuple) and len(value) != n:
            raise InvalidValueError(name, value, f"must be one number, or {n}")
        if not all(0.0 < x < inf for x in numbers):
            raise InvalidValueError(name, value, "must be above zero and finite")
