"""The session with one arm: the same class for a real robot, `connect`, and a simulated one, `simulate`."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell, require_cell
from rcilab.cell.wire_rounding import is_same_load, is_same_tool
from rcilab.conformance.certificate import Certificate, require_certificate
from rcilab.conformance.check import check
from rcilab.conformance.free_elbow import resulting_motion
from rcilab.conformance.speed_scaling_check import plan_start_with_override
from rcilab.core.arrays import JointVector, as_number, described
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.closeable import Closeable
from rcilab.core.command import CommandFilter
from rcilab.core.errors import ConnectionLostError, InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox, require_box
from rcilab.core.spatial import Pose, as_pose
from rcilab.core.state import Mode, RobotState, require_mode
from rcilab.execution.command_validation import find_start_mismatch
from rcilab.execution.control_loop import Callback
from rcilab.execution.filters import LowPass, RateLimiter
from rcilab.execution.motion_events import EventQueue
from rcilab.execution.motion_executor import MotionStream
from rcilab.execution.motion_runner import (
    MotionProgress,
    MotionRunner,
    Progress,
    RunListener,
    follow_poses,
    report_progress,
)
from rcilab.execution.session_lock import SessionLock
from rcilab.execution.simulation_control import SimulationControl
from rcilab.execution.speed_override import SpeedOverride, StreamRows
from rcilab.i18n.translator import Remark
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import (
    ConfiguredArm,
    StreamingDriver,
    require_signal,
    require_signals,
    require_timeout,
)
from rcilab.makers.maker import (
    all_makers,
    capabilities_of,
    commanded_start,
    find_missing_feature,
    require_feature,
    require_parts,
    start_tolerance_of,
    timing_of,
)
from rcilab.model.dynamics.payload import POINT_MASS
from rcilab.motion import Motion, plan_joint, require_motion
from rcilab.motion.cartesian import arm_angles, follow_path, schedule
from rcilab.motion.joint import DEFAULT_SPEED, S_PROFILE_VELOCITY, JointLaw
from rcilab.motion.motion_event import cycle_events
from rcilab.motion.path import build_arc, build_line
from rcilab.motion.speed_scaling import require_speed_override
from rcilab.recording.run import Run

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion.path import Path

ON_REQUEST = Remark("on request", "on_request")
"""Why a motion was stopped, when nothing else is given."""
_sessions: weakref.WeakSet[RobotSession] = weakref.WeakSet()
_sessions_lock = threading.Lock()


def open_sessions() -> list[RobotSession]:
    """Returns the open sessions of this process; thread-safe."""
    with _sessions_lock:
        sessions = list(_sessions)
    return [session for session in sessions if not session.is_closed]


class RobotSession(Closeable):
    """A connected arm: its state, power, configuration, and motions at 1 kHz. Created by `connect` and `simulate`.

    The commands of the maker's protocol are in the attribute with the name of its address scheme:
    `robot.rci.set_filters(...)` for `rci://`.

    While a motion runs, `stop`, `close`, `state`, `power_off`, which ends the motion, and the commands that the
    controller accepts during a motion may be called, from any thread and from a callback. Other calls are refused and
    do not affect the motion. A session remains usable after faults: call `recover()`.

    Args:
        driver: The connection.
        arm: The configuration of the robot.
        lock: The lock of the connection; closes it with the session.
        runner: Runs motions on the connection.
        simulation: The simulation control of a virtual robot; None without a simulation port.
    """

    def __init__(
        self,
        driver: StreamingDriver,
        arm: ConfiguredArm,
        lock: SessionLock,
        runner: MotionRunner,
        simulation: SimulationControl | None,
    ) -> None:
        self._driver = driver
        self._arm = arm
        self._lock = lock
        self._runner = runner
        self._simulation = simulation
        self._commands = driver.open_commands(arm, lock)
        self._streamed: tuple[MotionStream, SpeedOverride[bool]] | None = None
        """Stream and speed override of the running `execute`."""
        with _sessions_lock:
            _sessions.add(self)

    def __getattr__(self, name: str) -> Any:
        """Returns the commands of the maker's protocol for the name of its address scheme."""
        commands, scheme = self.__dict__.get("_commands"), ""
        if commands is not None:
            scheme = self._driver.scheme
            if name == scheme:
                return commands
        hint = f"; it is .{scheme}.{name}" if scheme and hasattr(type(commands), name) else ""
        if scheme and name in (maker.scheme for maker in all_makers()):
            hint = f"; the requests of this robot's controller are in .{scheme}"
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}", name=name, obj=self)

    def __dir__(self) -> list[str]:
        """Includes the name of the address scheme, for completion."""
        return sorted({*super().__dir__(), self._driver.scheme})

    @property
    def model(self) -> RobotModel:
        """The arm, with the tool, the load and the soft limits set by this session."""
        return self._arm.model

    @property
    def n(self) -> int:
        """Number of joints."""
        return self._driver.n

    @property
    def safety_box(self) -> SafetyBox | None:
        """The safety box of the tool, if set in this session; motions are checked with it."""
        return self._arm.safety_box

    @property
    def cell(self) -> Cell | None:
        """The cell of the arm, if set in this session; motions are checked with it."""
        return self._arm.cell

    @property
    def address(self) -> str:
        """Address of the robot."""
        return self._driver.name

    @property
    def simulation(self) -> SimulationControl:
        """Control of a virtual robot's simulation: `robot.simulation.push([0, 0, -20, 0, 0, 0])`.

        Raises:
            UsageError: It is a real robot, or the simulation port of the virtual one is not known.
        """
        if self._simulation is None:
            raise UsageError(
                f"{self._driver.name}: no simulation port is known; simulate() always has one, and connect() reads it "
                "from the address: add ?world_port=PORT, which rcilab controller prints (world HOST:PORT)"
            )
        return self._simulation

    @property
    def world(self) -> SimulationControl:
        """The same as `simulation`."""
        return self.simulation

    @property
    def is_moving(self) -> bool:
        """Whether a motion runs, in any thread; see also `progress` for a motion of `execute`."""
        return self._lock.is_moving

    @property
    def is_closed(self) -> bool:
        """Whether the session was closed."""
        return self._lock.is_closing

    def on_run(self, listener: RunListener) -> Callable[[], None]:
        """Adds a listener that is called at the end of every motion; returns the function that removes it.

        Args:
            listener: Called in the thread that ran the motion, with its run and the error that ended it, or None.
        """
        return self._runner.on_run(listener)

    @property
    def state(self) -> RobotState:
        """The newest state; inside a callback, the one passed to it."""
        with self._lock.acquire_unless_moving() as is_acquired:
            if is_acquired or self._driver.latest is None:
                return self.receive_state()
        return self._driver.latest

    def receive_states(self, timeout: float = 1.0) -> list[RobotState]:
        """Returns every state received since the last call, oldest first; waits for the first one.

        Args:
            timeout: Timeout, [s].

        Raises:
            ConnectionLostError: No state was received.
            UsageError: The session is closed, or a motion runs.
        """
        require_timeout(timeout)
        with self._lock.acquire("receive_states"):
            states = self._driver.poll(timeout)
        if not states:
            raise self._no_state(timeout)
        return states

    def receive_state(self, timeout: float = 1.0, max_age: float = 0.0) -> RobotState:
        """Returns a state that was sent after this call; older ones in the socket are dropped.

        Args:
            timeout: Timeout, [s].
            max_age: Largest age of the state, [s]: a newest state that is not older is returned without waiting. 0
                accepts only a state sent after the call.

        Raises:
            ConnectionLostError: No state was received.
            UsageError: The session is closed, or a motion runs; `state` returns the newest state then.
        """
        require_timeout(timeout)
        if not as_number(max_age, "max_age", "s") >= 0.0:
            raise InvalidValueError("max_age", max_age, "must not be below 0 [s]")
        with self._lock.acquire("receive_state"):
            while self._driver.poll(0.0):
                pass
            if self._driver.latest is not None and self._driver.age <= max_age:
                return self._driver.latest
            states = self._driver.poll(timeout)
        if not states:
            raise self._no_state(timeout)
        return states[-1]

    def power_on(self) -> None:
        """Switches the motors on; where the interface cannot (Franka's), checks that the arm is ready for a motion.

        Raises:
            CommandRejectedError: The controller refuses, or the arm is not ready; the message contains the reason.
        """
        with self._lock.acquire("power_on"):
            self._driver.power(True)

    def power_off(self) -> None:
        """Switches the motors off, which ends a running motion.

        Raises:
            CommandRejectedError: The interface cannot (Franka's).
        """
        with self._lock.acquire_unless_moving() as is_acquired:
            if is_acquired:
                self._driver.power(False)
                return
        self._driver.power(False, alongside=True)

    def is_powered(self) -> bool:
        """Returns whether the motors are on; also during a motion, from any thread and from a callback."""
        with self._lock.acquire_unless_moving() as is_acquired:
            if is_acquired:
                return self._driver.is_powered()
        return self._driver.is_powered(alongside=True)

    def set_tool(self, T_flange_tool: Pose) -> None:
        """Sets the tool by its pose in the flange frame; `model` includes it from then on."""
        self.configure(RobotConfiguration(tool=as_pose(T_flange_tool, "T_flange_tool")))

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike = POINT_MASS) -> None:
        """Sets the load at the flange; `model` includes it from then on.

        Args:
            mass: [kg], up to the arm's payload.
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2]; that of a point mass, zero, by default.
        """
        require_feature(self.model, "load")
        self._commands.set_load(mass, center_of_mass, inertia)

    def set_safety_box(self, box: SafetyBox) -> None:
        """Sets the safety box of the tool's origin, and whether it is active."""
        self.configure(RobotConfiguration(box=require_box(box)))

    def set_cell(self, cell: Cell | None, *, apply: bool = False) -> None:
        """Sets the cell that motions are checked with; they are refused while its tool or load is not the controller's.

        Args:
            cell: The cell of this arm; None: without one.
            apply: Whether its tool, and the load of tool and held part, are sent to a controller that has others.

        Raises:
            InvalidValueError: It is not a cell, or that of another arm.
            CommandRejectedError: The controller refused tool or load; the cell is as before.
            UsageError: A motion runs.
        """
        if cell is not None:
            require_cell(cell).require_arm(self.model)
            if apply:
                own, carried = self.model, cell.applied_to(self.model)
                tool = None if is_same_tool(carried.T_flange_tool, own.T_flange_tool) else carried.T_flange_tool
                self.configure(
                    RobotConfiguration(tool=tool, load=None if is_same_load(carried.load, own.load) else carried.load)
                )
        with self._lock.acquire("set_cell"):
            self._arm.cell = cell

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output by its number, from 0."""
        require_feature(self.model, "signals")
        self._commands.set_output(require_signal(signal, capabilities_of(self.model).outputs), level)

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input, by its number, from 0."""
        require_feature(self.model, "signals")
        return self._commands.read_input(require_signal(signal, capabilities_of(self.model).inputs))

    def reboot(self) -> None:
        """Restarts the controller and closes the session: connect again once the controller is ready."""
        require_feature(self.model, "reboot")
        self._commands.reboot()

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration, part by part; after a refusal the earlier parts remain in effect.

        Raises:
            ModelError: The arm lacks a part.
            CommandRejectedError: The controller refused a part; the error names it.
            UsageError: A motion runs.
        """
        self._commands.configure(require_parts(self.model, configuration))

    def execute(
        self,
        motion: Motion,
        certificate: Certificate | None = None,
        progress: Progress | None = None,
        *,
        mode: Mode = "joint_position",
        speed_override: float = 1.0,
    ) -> Run:
        """Checks a motion by the conditions of the mode, streams it and returns its run.

        From another thread, `pause`, `resume` and `set_speed_override` change its speed, and `progress` returns its
        progress. In torque and impedance modes the arm is compliant and ends next to its goal: `Run.goal_error`. Where
        poses are sent without the arm angle (FR3), the plan of the run has the joint angles that they lead to.

        Args:
            motion: The motion; it must begin at the commanded angles of the arm, `state.q_c`.
            certificate: From an earlier `check(motion, model, mode=mode, cell=robot.cell)`: then only its validity is
                verified.
            progress: Called with time and duration about 20 times a second.
            mode: Command mode: the same motion as joint angles, as poses of the tool, or as torques.
            speed_override: Initial speed override, 0.1 to 1; `set_speed_override` changes it later.

        Raises:
            InvalidValueError: The speed override is out of range; nothing moved.
            PlanningError: With this override the motion would violate a condition; nothing moved.
            ConformanceError: The motion violates a condition; nothing moved.
            CertificateError: The certificate does not match; nothing moved.
            UsageError: The motion does not start at the arm's position; nothing moved.
            ControlError: The controller stopped it; see `.faults` and `.run`, and call `recover()`.
            ConnectionLostError: The connection to the controller is lost.
        """
        require_motion(motion)
        require_certificate(certificate)
        require_feature(self.model, require_mode(mode))
        require_speed_override(speed_override)
        with self._lock.begin_motion("execute"):
            start = commanded_start(motion.q[0], self.receive_state().q_c, self.model)
            mismatch = find_start_mismatch(motion.q[0], start, start_tolerance_of(self.model))
            if mismatch is not None:
                raise UsageError(mismatch)
            if certificate is None:
                self._require_allowed(motion, start, mode)
            else:
                certificate.verify(motion, self.model, start, self.safety_box, mode=mode, cell=self.cell)
            motion = resulting_motion(motion, self.model, mode)
            scaled = plan_start_with_override(motion, speed_override, self.model, mode)
            planned = scaled.as_motion()
            events = None
            if motion.events:
                require_signals(motion.events, self.model)
                events = EventQueue(cycle_events(scaled), self._driver, capabilities_of(self.model).inputs)
            stream = MotionStream(scaled.q, mode, self.model, report_progress(planned, progress), events)
            override = SpeedOverride(StreamRows(stream))
            override.begin(scaled, self.model, mode)
            self._streamed = stream, override
            try:
                return self._runner.run(stream, mode, planned, override=override)
            finally:
                self._streamed = None

    @property
    def progress(self) -> MotionProgress | None:
        """Progress of the motion that `execute` runs in another thread; None without one."""
        if (streamed := self._streamed) is None:
            return None
        stream, override = streamed
        scaled, cycle = override.motion, stream.cycle
        assert scaled is not None  # It has begun.
        return MotionProgress(
            time=cycle * CYCLE_TIME,
            duration=scaled.duration,
            plan_time=scaled.plan_time_at(cycle),
            plan_duration=scaled.motion.duration,
            speed_override=scaled.override,
            mode=override.mode,
        )

    def pause(self) -> None:
        """Holds the motion that `execute` runs in another thread, on its path and within all limits.

        Raises:
            UsageError: No such motion runs.
            PlanningError: It ends before it could be held.
        """
        self._change_speed_override(0.0)

    def resume(self, speed_override: float = 1.0) -> None:
        """Resumes a held motion; see `set_speed_override`."""
        self.set_speed_override(speed_override)

    def set_speed_override(self, speed_override: float) -> None:
        """Sets the speed override of the motion that `execute` runs in another thread; the change is checked.

        Args:
            speed_override: 0.1 to 1.

        Raises:
            InvalidValueError: The override is out of range.
            UsageError: No such motion runs.
            PlanningError: The change is not possible within the limits from here; the motion continues unchanged.
        """
        self._change_speed_override(require_speed_override(speed_override))

    def _change_speed_override(self, speed_override: float) -> None:
        if (streamed := self._streamed) is None:
            raise UsageError("no motion of execute() is in progress whose speed override could change").coded(
                "override_idle"
            )
        streamed[1].change(speed_override)

    def control(
        self,
        callback: Callback,
        mode: Mode = "joint_position",
        *,
        cut_off: float | None = None,
        rate_limit: str | None = None,
    ) -> Run:
        """Runs a callback in every controller cycle until it returns a command with `finished=True`.

        The first command must be the present position, `JointPosition(state.q_c)` or
        `CartesianPosition(state.T_base_tool_c)`; torques begin within one cycle's rate of zero. t counts controller
        cycles since the first call, in seconds, so a lost packet does not stretch time. With a filter or a limiter the
        motion ends when the sent command has reached the last one.

        A tool that starts outside its safety box may only move inwards, as with `execute`: the controller stops a
        motion that moves farther out, or through another face.

        Args:
            callback: `(state, t) -> JointPosition | CartesianPosition | JointTorque`, depending on the mode.
            mode: Command mode.
            cut_off: Cut-off frequency of a low-pass filter of the commands, [Hz]; the clients of ROKAE and Franka use
                100. None: no filter.
            rate_limit: Keeps the commands inside the limits of velocity, acceleration, jerk or torque rate. "manual":
                those of the manual; after a jump the commands brake ahead of it. "sdk": on an xMate the same limiter
                with the Cartesian limits of the vendor's; on a Franka arm libfranka's own limiter with its bounds,
                which clips, so that a jump is overshot and swings for long, without a low pass for ever. (libfranka
                has it on by default up to 0.9, and off from 0.10 on.) Poses keep the tool's limits, which may not be
                enough for the joints. None: no limiter.

        Raises:
            ControlError: The controller stopped the motion; see `.faults` and `.run`, and call `recover()`.
            ConnectionLostError: The connection to the controller is lost.
            InvalidValueError: A command was not valid; the arm was stopped.
            Exception: An exception of the callback; the arm was stopped.
        """
        require_feature(require_feature(self.model, "streaming"), require_mode(mode))
        period = timing_of(self.model).command_cycles
        filters = self._open_filters(cut_off, rate_limit, period)
        if not callable(callback):
            raise InvalidValueError("callback", described(callback), "must be a function (state, t) -> command")
        with self._lock.begin_motion("control"):
            return self._runner.run(callback, mode, filters=filters)

    def _open_filters(self, cut_off: float | None, rate_limit: str | None, period: int) -> list[CommandFilter]:
        limits = self.model.limits
        own = None if rate_limit is None else self._driver.open_filter(limits, rate_limit, cut_off)
        if own is not None:
            return [own]
        filters: list[CommandFilter] = [] if cut_off is None else [LowPass(cut_off, period)]
        if rate_limit is not None:
            filters.append(RateLimiter(self._driver.select_limits(limits, rate_limit), period))
        return filters

    def move_j(self, goal: ArrayLike, speed: float = DEFAULT_SPEED, progress: Progress | None = None) -> Run:
        """Moves to joint angles by the manual's S profile and returns at the end: the vendor's MOVEJ.

        An arm whose maker has no such profile moves by "jerk_limited", see `plan_joint`. Unlike the vendor's, it starts
        at the commanded angles, a move to the present angles ends at once, the speed is bounded, and the motion is
        checked before it starts.

        Args:
            goal: Joint angles, shape (n,), [rad].
            speed: Part of 1 rad/s (1.25 for the last three joints) and 2.5 rad/s^2, 0.001 to 1.
            progress: Called with time and duration about 20 times a second.

        Raises:
            PlanningError: The goal, or the arm, is outside the joint limits.
            ConformanceError: The motion violates a condition; nothing moved.
            ControlError: The controller stopped it; call `recover()`.
        """
        with self._lock.begin_motion("move_j"):
            state = self.receive_state()
            law: JointLaw = "s_profile" if self.model.n in S_PROFILE_VELOCITY else "jerk_limited"
            motion = plan_joint(self.model, state.q_c, goal, speed=speed, law=law)
            self._require_allowed(motion, state.q_c)
            stream = MotionStream(motion.q, "joint_position", self.model, report_progress(motion, progress))
            return self._runner.run(stream, "joint_position", motion)

    def move_l(
        self, goal: Pose, speed: float = DEFAULT_SPEED, psi: float | None = None, progress: Progress | None = None
    ) -> Run:
        """Moves the tool on a line to a pose by the manual's S profile and returns at the end: MOVEL.

        The session sends poses, and the controller computes the joint angles (Cartesian position mode); an arm without
        that mode receives joint angles. Position, orientation and arm angle run in proportion, so a large rotation on a
        short line is fast. If the tool only rotates, the path is the angle about any axis; the vendor's is the same for
        base z only. A move with identical start and goal, on which the vendor's never returns, ends at once. The joint
        motion is planned and checked first.

        Args:
            goal: Pose of the tool in base.
            speed: Part of 1 m/s and 2.5 m/s^2, 0.001 to 1; of 1 rad/s and 2.5 rad/s^2 if the tool only rotates.
            psi: Arm angle of a 7-axis arm at the goal, [rad]; None: the controller holds its own.
            progress: Called with time and duration about 20 times a second.

        Raises:
            PlanningError: A pose on the path is out of reach or singular; the message contains the pose and the reason.
            ConformanceError: The joints would violate a condition; nothing moved.
            ControlError: The controller stopped it; call `recover()`.
        """
        with self._lock.begin_motion("move_l"):
            state = self.receive_state()
            angles = arm_angles(self.model, state.q_c, psi)
            path = build_line(self.model.forward(state.q_c), goal, *angles)
            return self._move_along(path, state, speed, psi is not None, progress)

    def move_c(
        self, via: Pose, goal: Pose, speed: float = DEFAULT_SPEED, psi: float | None = None,
        progress: Progress | None = None,
    ) -> Run:  # fmt: skip
        """Moves the tool on the arc through `via` to a pose by the manual's S profile and returns at the end: MOVEC.

        As in the vendor's, the orientation changes from start to goal and that of `via` is ignored. Three positions on
        a line raise an error. See also `move_l`.

        Args:
            via: A pose whose position lies on the arc.
            goal: Pose of the tool in base.
            speed: Part of 1 m/s and 2.5 m/s^2, 0.001 to 1.
            psi: Arm angle of a 7-axis arm at the goal, [rad]; None: the controller holds its own.
            progress: Called with time and duration about 20 times a second.

        Raises:
            PlanningError: The positions define no circle, or a pose on the path is out of reach or singular.
            ConformanceError: The joints would violate a condition; nothing moved.
            ControlError: The controller stopped it; call `recover()`.
        """
        with self._lock.begin_motion("move_c"):
            state = self.receive_state()
            angles = arm_angles(self.model, state.q_c, psi)
            path = build_arc(self.model.forward(state.q_c), via, goal, *angles)
            return self._move_along(path, state, speed, psi is not None, progress)

    def stop(self, reason: str = ON_REQUEST) -> None:
        """Stops a running motion within the limits; `execute` or `control` then returns its run.

        One that the controller plans is stopped if a call of this session waits for its end: that call raises an error.

        May be called from another thread or from a callback. Does nothing if no motion is being checked or is running.

        Args:
            reason: Value of `Run.stopped`; the first one counts.
        """
        self._lock.stop(reason)

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone.

        Raises:
            ManualRecoveryError: The arm is too far outside its range or its safety box.
            CommandRejectedError: The controller refuses; the message contains the reason.
            DeadlineError: It accepted, but the faults remained.
        """
        with self._lock.acquire("recover"):
            self._driver.recover()

    def close(self) -> None:
        """Stops a running motion within the limits and ends the connection. May be called twice.

        The call that runs the motion returns its run. When called from a callback, the connection ends with the motion.
        """
        self._lock.close()

    def __repr__(self) -> str:
        return f"<RobotSession {self.model.name} at {self._driver.name}{', closed' if self.is_closed else ''}>"

    def _no_state(self, timeout: float) -> ConnectionLostError:
        return ConnectionLostError(
            f"{self._driver.name}: no state within {timeout:g} s; check that the controller is running and the cable "
            "is connected, then connect again"
        )

    def _require_allowed(self, motion: Motion, start: JointVector, mode: Mode = "joint_position") -> None:
        report = check(motion, self.model, start=start, box=self.safety_box, mode=mode, cell=self.cell).require()
        if self.cell is not None:  # It was checked with the tool and the load of the cell.
            assert report.certificate is not None
            report.certificate.verify(motion, self.model, start, self.safety_box, mode=mode, cell=self.cell)

    def _move_along(
        self, path: Path, state: RobotState, speed: float, with_psi: bool, progress: Progress | None
    ) -> Run:
        """Streams a path after checking its joint motion: its poses, to an arm that cannot take them its angles.

        Poses without an arm angle are only sent to a controller that holds its own, as the joint motion does.
        """
        motion = follow_path(self.model, state.q_c, path, speed)
        is_free = bool(self.model.redundancy) and not self._driver.commands_arm_angle
        if is_free or find_missing_feature(self.model, "cartesian_position") is not None:
            self._require_allowed(motion, state.q_c)
            stream = MotionStream(motion.q, "joint_position", self.model, report_progress(motion, progress))
            return self._runner.run(stream, "joint_position", motion)
        self._require_allowed(motion, state.q_c, "cartesian_position")
        sends_psi = with_psi or not self._driver.holds_arm_angle
        callback = follow_poses(path, schedule(path, speed), sends_psi, report_progress(motion, progress))
        return self._runner.run(callback, "cartesian_position", motion)
