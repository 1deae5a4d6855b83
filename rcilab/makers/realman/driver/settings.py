"""The requests of the interface as methods in SI units: settings, signals, and motions that the controller plans.

A parameter of a joint is set while the joint is disabled, and the joint is enabled again; the arm must stand still.
Tool, load and work frame are set in a frame with the name `FRAME`, which is created when it is needed; frames with
other names stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, described, readonly_copy
from rcilab.core.errors import CommandRejectedError, ControlError, InvalidValueError, RcilabError
from rcilab.core.fault import FaultCode
from rcilab.core.spatial import IDENTITY, Pose, as_pose
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, SoftJointLimits, tool_limits_of
from rcilab.makers.driver import SignalRequest, require_signal
from rcilab.makers.realman.bounds import (
    ANGLE_STEP,
    FASTEST_TOOL,
    FIRST_TOOL_FRAME,
    FIRST_WORK_FRAME,
    HEAVIEST_LOAD,
    INPUTS,
    LARGEST_JOINT_ACCELERATION,
    LONGEST_TOOL,
    MOST_SENSITIVE,
    OUTPUTS,
    STRONGEST_TOOL,
)
from rcilab.makers.realman.driver.connection import RealManConnection
from rcilab.makers.realman.wire.units import (
    degrees_for_client,
    millidegrees_from_angles,
    millirpm_from_speed,
    pose_for_client,
    pose_from_client,
    speed_for_client,
    speed_from_millirpm,
)
from rcilab.makers.setting_values import bounded_vector
from rcilab.model.dynamics.payload import NO_LOAD, Payload
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

FRAME: Final = "rcilab"
"""Name of the tool frame and of the work frame that are set here."""
_AXES = ("x", "y", "z")
_TOOL_LIMITS = ("line_speed", "line_acc", "angular_speed", "angular_acc")
_MILLIMETRE = 1e-3  # [m]
_TRUNCATED = 3e-4  # [kg], [m/s], [rad/s] and so on: the library truncates to thousandths.
_STEP = math.radians(ANGLE_STEP)  # [rad]
_MOVED = 1e-3  # [rad]
_FRESH = 3  # States after which one shows the effect of a request: the first may be older.
_STATE_TIMEOUT = 1.0  # [s]
_ENABLED = 3.0  # [s]
_SAME = 1e-6  # Share of a limit: more than the rounding of single precision.
_ROUNDED = 1e-3  # Share of a speed: more than the rounding of one that was set, to 0.001 RPM.
_LARGEST_ACCELERATION = speed_from_millirpm(LARGEST_JOINT_ACCELERATION)
_BLOCK, _LAST, _NO_BLEND = 1, 0, 0
"""Arguments of motions: wait for the end, no further motion is connected, no rounded corner."""


class ToolSetting(NamedTuple):
    """A tool frame of the controller."""

    name: str
    T_flange_tool: Pose
    load: Payload


class RealManSettings:
    """The requests of a connection.

    Refusals raise `CommandRejectedError`, a broken connection `ConnectionLostError`; arguments of the wrong shape, not
    finite or out of range raise `InvalidValueError` and are not sent.

    Args:
        connection: The connection.
        arm_name: Name of its arm.
    """

    def __init__(self, connection: RealManConnection, arm_name: str) -> None:
        self._link = connection
        self._client = connection.client
        self._is_moving = False  # While a call waits for a motion of the controller.
        self._is_stopped = False  # By `stop`, since that call began.
        self._joints = tuple(f"joint {number}" for number in range(1, connection.n + 1))
        self._own = describe_robot(arm_name).limits.joint
        self.tool = self._read_tool()

    @property
    def api(self) -> Any:
        """The client of the maker's library, for what is not here: angles in degrees, lengths in metres, not checked.

        Do not use it while a motion of this session runs.
        """
        return self._client.api

    @property
    def library(self) -> Any:
        """The module of the maker's library, with its structures."""
        return self._client.library

    def set_tool(self, T_flange_tool: Pose) -> None:
        """Sets the pose of the tool in the flange frame, at most 1 m away, and keeps the load."""
        tool = as_pose(T_flange_tool, "T_flange_tool")
        _require_near("T_flange_tool", tool.position)
        self._set_tool_frame(tool, self.tool.load)

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load of the tool frame, and keeps its pose.

        Args:
            mass: [kg].
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2]; the controller does not take it.
        """
        kilograms = float(bounded_vector("mass", [mass], ("",), "kg", 0.0, HEAVIEST_LOAD)[0])
        center = bounded_vector("center_of_mass", center_of_mass, _AXES, "m")
        _require_near("center_of_mass", center)
        load = Payload(mass=kilograms, center_of_mass=center) if kilograms else NO_LOAD
        self._set_tool_frame(self.tool.T_flange_tool, load)

    def set_work_frame(self, T_base_work: Pose) -> None:
        """Sets the frame of the controller's own poses; those of this session stay in base."""
        frame = as_pose(T_base_work, "T_base_work")
        api = self.api
        with self._request("set_work_frame"):
            if frame.is_close(IDENTITY, 0.0):
                self._call(api.rm_change_work_frame, FIRST_WORK_FRAME)
            else:
                names = self._call(api.rm_get_total_work_frame)["work_names"]
                send = api.rm_update_work_frame if FRAME in names else api.rm_set_manual_work_frame
                self._call(send, FRAME, pose_for_client(frame))
                self._call(api.rm_change_work_frame, FRAME)
            self._link.ask(self._link.read_work_frame)
            self.await_states()

    def set_joint_ranges(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets the ranges of the joints (set_joint_min_pos, set_joint_max_pos).

        Args:
            lower: Shape (n,), [rad], inside the arm's own range.
            upper: Shape (n,), [rad].
        """
        own = self._own
        margin = math.radians(ANGLE_STEP)
        low = bounded_vector("lower", lower, self._joints, "rad", own.lower - margin, own.upper)
        high = bounded_vector("upper", upper, self._joints, "rad", own.lower, own.upper + margin)
        for joint in np.flatnonzero(low >= high).tolist():
            raise InvalidValueError(
                f"lower, joint {joint + 1}", float(low[joint]), f"must be below {high[joint]:g} [rad]"
            )
        api = self.api
        with self._request("set_joint_ranges"):
            least = self._read_vector(api.rm_get_joint_min_pos)
            largest = self._read_vector(api.rm_get_joint_max_pos)
            wire = millidegrees_from_angles
            changes: list[tuple[int, Callable[..., int], float]] = []
            for joint, (a, b) in enumerate(zip(degrees_for_client(low), degrees_for_client(high), strict=True)):
                ends = [(joint, api.rm_set_joint_min_pos, a), (joint, api.rm_set_joint_max_pos, b)]
                if low[joint] >= largest[joint]:  # The upper end goes first, so that the range is never empty.
                    ends.reverse()
                if wire((low[joint], high[joint])) != wire((least[joint], largest[joint])):
                    changes += ends
            self._set_joints(changes)

    def set_joint_velocities(self, velocity: ArrayLike) -> None:
        """Sets the largest speeds of the joints (set_joint_max_speed).

        Args:
            velocity: Shape (n,), [rad/s], at most the arm's own.
        """
        values = bounded_vector("velocity", velocity, self._joints, "rad/s", 0.0, self._own.velocity * (1.0 + _SAME))
        self._set_speeds(
            "set_joint_velocities", self.api.rm_get_joint_max_speed, self.api.rm_set_joint_max_speed, values
        )

    def set_joint_accelerations(self, acceleration: ArrayLike) -> None:
        """Sets the largest accelerations of the joints (set_joint_max_acc).

        Args:
            acceleration: Shape (n,), [rad/s^2], at most 500 RPM/s; the maker recommends at least 1.5 times the speed,
                in RPM/s and RPM.
        """
        values = bounded_vector("acceleration", acceleration, self._joints, "rad/s^2", 0.0, _LARGEST_ACCELERATION)
        self._set_speeds(
            "set_joint_accelerations", self.api.rm_get_joint_max_acc, self.api.rm_set_joint_max_acc, values
        )

    def set_tool_limits(
        self, velocity: float, acceleration: float, rotation_velocity: float, rotation_acceleration: float
    ) -> None:
        """Sets the largest speeds and accelerations of the tool.

        Args:
            velocity: Up to 10 m/s.
            acceleration: Up to 100 m/s^2.
            rotation_velocity: Up to 10 rad/s.
            rotation_acceleration: Up to 100 rad/s^2.
        """
        api = self.api
        wanted = (
            (api.rm_set_arm_max_line_speed, "velocity", velocity, FASTEST_TOOL, "m/s"),
            (api.rm_set_arm_max_line_acc, "acceleration", acceleration, STRONGEST_TOOL, "m/s^2"),
            (api.rm_set_arm_max_angular_speed, "rotation_velocity", rotation_velocity, FASTEST_TOOL, "rad/s"),
            (api.rm_set_arm_max_angular_acc, "rotation_acceleration", rotation_acceleration, STRONGEST_TOOL, "rad/s^2"),
        )
        checked = [
            (call, float(bounded_vector(label, [value], ("",), unit, 0.0, most)[0]))
            for call, label, value, most, unit in wanted
        ]
        with self._request("set_tool_limits"):
            for call, value in checked:
                self._call(call, value + _TRUNCATED)
            self.await_states()

    def set_collision_stage(self, stage: int) -> None:
        """Sets the sensitivity to collisions, from 0 (off) to 8."""
        if isinstance(stage, bool) or not isinstance(stage, int) or not 0 <= stage <= MOST_SENSITIVE:
            raise InvalidValueError("stage", described(stage), f"does not exist; there are 0 to {MOST_SENSITIVE}")
        with self._request("set_collision_stage"):
            self._call(self.api.rm_set_collision_state, stage)

    def set_self_collision(self, on: bool) -> None:
        """Switches the controller's watch on self-collisions on or off; a new controller has it off."""
        with self._request("set_self_collision"):
            self._call(self.api.rm_set_self_collision_enable, bool(on))

    def set_joint_enabled(self, joint: int, on: bool) -> None:
        """Enables or disables a joint, from 1; a disabled one is held by its brake, and the arm takes no motion."""
        if isinstance(joint, bool) or not isinstance(joint, int) or not 1 <= joint <= self._link.n:
            raise InvalidValueError("joint", described(joint), f"does not exist; there are 1 to {self._link.n}")
        with self._request("set_joint_enabled"):
            self._call(self.api.rm_set_joint_en_state, joint, int(bool(on)))
            self.await_states()

    def enable_all(self) -> None:
        """Enables every joint that is disabled."""
        with self._request("enable_all"):
            enabled = self._read_vector(self.api.rm_get_joint_en_state)
            for joint in np.flatnonzero(enabled == 0.0).tolist():
                self._call(self.api.rm_set_joint_en_state, joint + 1, 1)
            self._link.wait(lambda: self._link.is_enabled, _ENABLED)

    def clear_errors(self) -> None:
        """Clears the errors of the system and of every joint."""
        api = self.api
        with self._request("clear_errors"):
            self._call(api.rm_clear_system_err)
            flags = self._call(api.rm_get_joint_err_flag)["err_flag"][: self._link.n]
            for joint, word in enumerate(flags, 1):
                if word:
                    self._call(api.rm_set_joint_clear_err, joint)
            self.await_states()

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output of the controller, 0 to 3: its DO1 to DO4."""
        number = require_signal(signal, OUTPUTS)
        with self._request("set_output"):
            self._call(self.api.rm_set_do_state, number + 1, int(level))

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input of the controller, 0 to 3: its DI1 to DI4."""
        number = require_signal(signal, INPUTS)
        with self._request("read_input"):
            return bool(self._call(self.api.rm_get_io_input)[number])

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for a digital signal during a motion; see `StreamingDriver`."""
        request, api = self._client.request, self.api
        if level is None:
            number = require_signal(signal, INPUTS)
            return self._link.post(request, api.rm_get_io_input).reading(lambda levels: bool(levels[number]))
        number = require_signal(signal, OUTPUTS)
        return self._link.post(request, api.rm_set_do_state, number + 1, int(level))

    def read_limits(self) -> RobotConfiguration:
        """Returns the limits in force in the controller: ranges, speeds and accelerations of joints and tool."""
        api = self.api
        with self._request("read_limits"):
            velocity = self._stricter(np.minimum, api.rm_get_joint_max_speed, api.rm_get_joint_drive_max_speed)
            acceleration = self._stricter(np.minimum, api.rm_get_joint_max_acc, api.rm_get_joint_drive_max_acc)
            low = self._stricter(np.maximum, api.rm_get_joint_min_pos, api.rm_get_joint_drive_min_pos)
            high = self._stricter(np.minimum, api.rm_get_joint_max_pos, api.rm_get_joint_drive_max_pos)
            tool = [self._call(getattr(api, f"rm_get_arm_max_{name}")) for name in _TOOL_LIMITS]
            stage = self._call(api.rm_get_collision_stage)
        control = ControllerParameters(
            joint_velocity=tuple(velocity.tolist()),
            joint_acceleration=tuple(acceleration.tolist()),
            tool_limits=tuple(tool),
            collision_stage=(float(stage),),
        )
        joints = SoftJointLimits(lower=tuple(low.tolist()), upper=tuple(high.tolist()))
        return RobotConfiguration(joints=joints, control=control)

    def with_limits(self, model: RobotModel) -> RobotModel:
        """Returns the model with the limits in force in the controller; its ranges are not wider than before."""
        found, joint = self.read_limits(), model.limits.joint
        assert found.joints is not None
        assert found.control is not None
        control = ControllerParameters(
            joint_velocity=_snapped(found.control["joint_velocity"], joint.velocity),
            joint_acceleration=_snapped(found.control["joint_acceleration"], joint.acceleration),
            tool_limits=_snapped(found.control["tool_limits"], tool_limits_of(model.limits)),
        )
        limited = RobotConfiguration(control=control).applied_to(model)
        low, high = np.array(found.joints.lower), np.array(found.joints.upper)
        lower, upper = np.maximum(joint.lower, low - _STEP), np.minimum(joint.upper, high + _STEP)
        if np.array_equal(lower, joint.lower) and np.array_equal(upper, joint.upper):
            return limited
        return limited.with_joint_limits(np.maximum(joint.lower, low), np.minimum(joint.upper, high))

    def move_j(self, goal: ArrayLike, speed: float = 0.35, *, wait: bool = True) -> None:
        """Moves to joint angles, planned by the controller (movej).

        Args:
            goal: Joint angles, shape (n,), [rad].
            speed: That no joint exceeds, up to that of the fastest one, [rad/s]; the controller takes whole percent.
            wait: Whether to return when the arm has arrived, not at once.
        """
        q = bounded_vector("goal", goal, self._joints, "rad")
        with self._request("movej"):
            fastest = float(np.radians(self._read_vector(self.api.rm_get_joint_max_speed).max()))
            percent = _percent(speed, fastest, "rad/s")
            self._move(self.api.rm_movej, degrees_for_client(q.tolist()), percent, _NO_BLEND, _LAST, wait=wait)

    def move_p(self, goal: Pose, speed: float = 0.35, *, wait: bool = True) -> None:
        """Moves to joint angles of a pose in base, planned by the controller (movej_p); see `move_j`."""
        with self._request("movej_p"):
            fastest = float(np.radians(self._read_vector(self.api.rm_get_joint_max_speed).max()))
            percent = _percent(speed, fastest, "rad/s")
            self._move(self.api.rm_movej_p, self._in_work_frame("goal", goal), percent, _NO_BLEND, _LAST, wait=wait)

    def move_l(self, goal: Pose, speed: float = 0.1, *, wait: bool = True) -> None:
        """Moves the tool on a line to a pose in base, planned by the controller (movel).

        Args:
            goal: Pose of the tool in base; orientations are rounded to 1 mrad.
            speed: Up to the largest speed of the tool, [m/s]; the controller takes whole percent of it.
            wait: Whether to return when the arm has arrived, not at once.
        """
        with self._request("movel"):
            percent = self._tool_percent(speed)
            self._move(self.api.rm_movel, self._in_work_frame("goal", goal), percent, _NO_BLEND, _LAST, wait=wait)

    def move_c(self, via: Pose, goal: Pose, speed: float = 0.1, *, wait: bool = True) -> None:
        """Moves the tool on the arc through `via` to a pose in base, (movec): see `move_l`."""
        with self._request("movec"):
            percent = self._tool_percent(speed)
            poses = self._in_work_frame("via", via), self._in_work_frame("goal", goal)
            self._move(self.api.rm_movec, *poses, percent, _NO_BLEND, 0, _LAST, wait=wait)

    def pause(self) -> None:
        """Holds the motion that the controller plans; from any thread."""
        self._client.request(self.api.rm_set_arm_pause)

    def resume(self) -> None:
        """Continues it; from any thread."""
        self._client.request(self.api.rm_set_arm_continue)

    def stop(self) -> None:
        """Stops the arm on its path and drops the motions behind; from any thread."""
        self._is_stopped = True
        self._client.request(self.api.rm_set_arm_slow_stop)

    def close(self) -> None:
        """Stops a motion that the controller plans, if this connection waits for one."""
        if self._is_moving:
            with suppress(RcilabError):
                self.stop()

    def await_states(self) -> None:
        """Returns once states have arrived that were sent after this call, or none comes any more."""
        while self._link.poll(0.0):
            pass
        for _ in range(_FRESH):
            self._link.on_states(self._link.poll(_STATE_TIMEOUT))

    def require_not_paused(self, name: str) -> None:
        """Requires that the controller holds no paused motion, by the newest state.

        Args:
            name: Name of the request in errors.

        Raises:
            CommandRejectedError: It does.
        """
        if self._link.is_paused:
            raise CommandRejectedError(
                name,
                "a motion of this controller is paused",
                "robot.realman.resume() continues it, robot.realman.stop() ends it",
                reason="motion_paused",
            )

    def _set_tool_frame(self, tool: Pose, load: Payload) -> None:
        api, client = self.api, self._client
        with self._request("set_tool_frame"):
            if tool.is_close(IDENTITY, 0.0) and not load.mass:
                self._call(api.rm_change_tool_frame, FIRST_TOOL_FRAME)
            else:
                center = pose_for_client(Pose(load.center_of_mass))[:3]  # In metres; it is read back in millimetres.
                numbers = tuple(pose_for_client(tool)), load.mass + _TRUNCATED, *center
                names = self._call(api.rm_get_total_tool_frame)["tool_names"]
                send = api.rm_update_tool_frame if FRAME in names else api.rm_set_manual_tool_frame
                self._call(send, client.library.rm_frame_t(FRAME, *numbers))
                self._call(api.rm_change_tool_frame, FRAME)
            self.tool = self._link.ask(self._read_tool)
            self.await_states()

    def _read_tool(self) -> ToolSetting:
        frame = self._client.request(self.api.rm_get_current_tool_frame)
        center = readonly_copy([_MILLIMETRE * frame[axis] for axis in _AXES])
        mass = frame["payload"]
        load = Payload(mass=mass, center_of_mass=center) if mass > 0.0 else NO_LOAD
        return ToolSetting(frame["name"], pose_from_client(frame["pose"]), load)

    def _set_speeds(self, name: str, read: Callable[[], Any], send: Callable[[int, float], int], values: Array) -> None:
        with self._request(name):
            before = np.radians(self._read_vector(read)).tolist()
            self._set_joints(
                [
                    (joint, send, speed_for_client(value))
                    for joint, value in enumerate(values.tolist())
                    if millirpm_from_speed(value) != millirpm_from_speed(before[joint])
                ]
            )

    def _set_joints(self, changes: Sequence[tuple[int, Callable[[int, float], int], float]]) -> None:
        """Sets values of joints, counted from 0, each while its joint is disabled; enables those that were enabled."""
        if not changes:
            return
        api = self.api
        self._link.wait(lambda: self._link.is_still, _STATE_TIMEOUT)
        enabled = self._read_vector(api.rm_get_joint_en_state)
        joints = sorted({joint for joint, _, _ in changes})
        try:
            for joint in joints:
                self._call(api.rm_set_joint_en_state, joint + 1, 0)
            for joint, send, value in changes:
                self._call(send, joint + 1, value)
        finally:
            for joint in joints:
                if enabled[joint]:
                    self._call(api.rm_set_joint_en_state, joint + 1, 1)
        is_enabled = bool(enabled.all())
        self._link.wait(lambda: self._link.is_enabled is is_enabled, _ENABLED)

    def _stricter(self, choose: np.ufunc, *calls: Callable[[], Any]) -> Array:
        """Returns the stricter one of controller and drives, [rad] and seconds."""
        return np.radians(choose(*(self._read_vector(call) for call in calls)))

    def _read_vector(self, call: Callable[[], Any]) -> Array:
        """Returns n numbers that the controller reports."""
        return np.array(self._call(call)[: self._link.n], dtype=np.float64)

    def _call(self, call: Callable[..., Any], *values: Any) -> Any:
        return self._link.ask(self._client.request, call, *values)

    def _tool_percent(self, speed: float) -> int:
        return _percent(speed, float(self._call(self.api.rm_get_arm_max_line_speed)), "m/s")

    def _in_work_frame(self, name: str, pose: object) -> list[float]:
        T_base_tool = as_pose(pose, name)  # type: ignore[arg-type]  # Checked there.
        return pose_for_client(self._link.T_base_work.inverse() @ T_base_tool)

    def _move(self, call: Callable[..., int], *values: Any, wait: bool) -> None:
        """Commands a motion, as the last argument whether its end is awaited; Ctrl-C stops it.

        Raises:
            CommandRejectedError: The controller refuses, or holds a paused motion, behind which it would wait.
            ControlError: It ended before its goal.
        """
        self.await_states()
        self.require_not_paused(call.__name__)
        if not wait:
            self._call(call, *values, 0)
            return
        self._is_stopped = False
        with self._motion():
            self._move_to_end(call, *values)

    def _move_to_end(self, call: Callable[..., int], *values: Any) -> None:
        start = self._link.latest
        assert start is not None  # A connection begins with a state.
        self._is_moving, ended_early = True, False
        try:
            self._call(call, *values, _BLOCK)
        except CommandRejectedError:
            self.await_states()
            latest = self._link.latest
            has_moved = latest is not None and float(np.abs(latest.q - start.q).max()) > _MOVED
            if not (has_moved or self._is_stopped):
                raise
            ended_early = True
        except KeyboardInterrupt:
            self.stop()
            raise
        finally:
            self._is_moving = False
        self.await_states()
        latest = self._link.latest
        if ended_early or self._is_stopped or (latest is not None and latest.faults):
            raise self._stopped_error(() if latest is None else latest.faults)

    def _stopped_error(self, faults: tuple[FaultCode, ...]) -> ControlError:
        if not faults:
            return ControlError(f"{self._link.name}: the motion was stopped before its end", ())
        found = f"{faults[0].manual_name}: {faults[0].cause}. {faults[0].remedy}"
        return ControlError(f"{self._link.name}: the controller stopped the arm: {found}", faults)

    @contextmanager
    def _request(self, name: str) -> Iterator[None]:
        """Surrounds every request but those from any thread."""
        yield

    @contextmanager
    def _motion(self) -> Iterator[None]:
        """Surrounds the wait for a motion of the controller."""
        yield


def _snapped(values: ArrayLike, own: ArrayLike) -> tuple[float, ...]:
    """Returns numbers that the controller reports, and those of the model where they differ by their rounding only."""
    read, known = np.array(values, dtype=np.float64), np.array(own, dtype=np.float64)
    return tuple(np.where(np.isclose(read, known, rtol=_SAME), known, read).tolist())


def _percent(speed: float, fastest: float, unit: str) -> int:
    """Returns a speed in whole percent of the fastest one, rounded down."""
    value = float(bounded_vector("speed", [speed], ("",), unit, 0.01 * fastest, fastest * (1.0 + _ROUNDED))[0])
    return max(1, min(100, math.floor(100.0 * value / fastest * (1.0 + _SAME))))


def _require_near(name: str, position: ArrayLike) -> None:
    length = float(np.linalg.norm(position))
    if not length <= LONGEST_TOOL:
        raise InvalidValueError(
            name, round(length, 6), f"m from the flange is farther than {LONGEST_TOOL:g} m; give metres"
        )
