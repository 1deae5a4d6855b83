"""The requests of the interface as methods in SI units: settings, signals, and motions that the controller plans.

Setters need an arm that stands still. The controller reports a changed setting as a state in which nothing moves; an
arm that was ready is made so again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, described
from rcilab.core.errors import CommandRejectedError, ControlError, InvalidValueError, RcilabError, UsageError
from rcilab.core.safety_box import SafetyBox, require_straight
from rcilab.core.spatial import Pose, as_pose
from rcilab.makers.driver import SignalRequest, require_signal
from rcilab.makers.setting_values import bounded_vector
from rcilab.makers.ufactory.bounds import (
    COLLISION_SENSITIVITIES,
    INPUTS,
    JOINT_ACCELERATION,
    JOINT_JERK,
    JOINT_VELOCITY,
    LONGEST_TOOL,
    OUTPUTS,
    TEACH_SENSITIVITIES,
    TOOL_ACCELERATION,
    TOOL_JERK,
)
from rcilab.makers.ufactory.driver.client import describe_error, faults_of
from rcilab.makers.ufactory.driver.connection import XArmConnection
from rcilab.makers.ufactory.driver.state_reader import CHANGED, MOVING, PAUSED, READY, STOPPED
from rcilab.makers.ufactory.wire.poses import MILLIMETRE, pose_as_mm_rpy, pose_from_mm_rpy
from rcilab.model.dynamics.payload import Payload
from rcilab.motion.path import build_arc
from rcilab.robots import describe_robot

_AXES = ("x", "y", "z")
_FASTEST_TOOL = 1.0  # [m/s] The client library lowers a higher speed to it.
_HEAVIEST_LOAD = 20.0  # [kg] rcilab's own bound, for kilograms given as grams.
_QUIET = 5  # Reports without a motion until it has ended: the first ones may be older than its command.
_STANDS = 1.0  # [s] For a stopped arm to stand.
_BOUNDARY = (-32768, 32767)  # [mm] Numbers of 16 bits.
_ENDS, _FENCE = 1, 5  # Places in the answer of get_reduced_states.
_ROUNDING = 1e-6  # [mm] Rounding of lengths that are whole millimetres.
_SAME_ANGLE = 1e-6  # [rad]
_MODES = (0, 1, 2, 4, 5, 6, 7)
_READY, _PAUSE, _STOP = 0, 3, 4
"""States to set."""


class XArmSettings:
    """The requests of a connection.

    Refusals raise `CommandRejectedError`, a broken connection `ConnectionLostError`; arguments of the wrong shape, not
    finite or out of range raise `InvalidValueError` and are not sent.

    Args:
        connection: The connection.
        arm_name: Name of its arm.
    """

    def __init__(self, connection: XArmConnection, arm_name: str) -> None:
        self._link = connection
        self._client = connection.client
        self._is_moving = False  # While a call waits for motions of the controller.
        self._is_stopped = False  # By `stop`, since that call began.
        self._joints = tuple(f"joint {number}" for number in range(1, connection.n + 1))
        self._own_ranges = describe_robot(arm_name).limits.joint

    @property
    def api(self) -> Any:
        """The client of the maker's library, for what is not here: angles in radians, lengths in mm, nothing checked.

        Do not use it while a motion of this session runs.
        """
        return self._client.api

    @property
    def tool(self) -> Pose:
        """Pose of the tool in the flange frame, as the newest slow report has it."""
        return pose_from_mm_rpy(self._client.api.tcp_offset)

    @property
    def load(self) -> Payload:
        """The load, as the newest slow report has it; the controller has no inertia."""
        mass, center = self._client.api.tcp_load
        if not mass > 0.0:
            return Payload()
        return Payload(mass=mass, center_of_mass=MILLIMETRE * np.array(center[:3]), inertia=np.zeros((3, 3)))

    def set_tool(self, T_flange_tool: Pose) -> None:
        """Sets the pose of the tool in the flange frame (set_tcp_offset), at most 2 m away."""
        tool = as_pose(T_flange_tool, "T_flange_tool")
        _require_near("T_flange_tool", tool.position)
        self._set("set_tcp_offset", list(pose_as_mm_rpy(tool)), wait=False)

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load (set_tcp_load).

        Args:
            mass: [kg].
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2]; the controller does not take it.
        """
        kilograms = float(bounded_vector("mass", [mass], ("",), "kg", 0.0, _HEAVIEST_LOAD)[0])
        center = bounded_vector("center_of_mass", center_of_mass, _AXES, "m")
        _require_near("center_of_mass", center)
        self._set("set_tcp_load", kilograms, (center / MILLIMETRE).tolist())

    def set_user_frame(self, T_base_user: Pose) -> None:
        """Sets the frame of the controller's own poses (set_world_offset); those of this session stay in base."""
        frame = as_pose(T_base_user, "T_base_user")
        self._set("set_world_offset", list(pose_as_mm_rpy(frame)), wait=False)

    def set_gravity_direction(self, direction: ArrayLike) -> None:
        """Sets the direction of gravity in base, for an arm that does not stand upright, shape (3,)."""
        values = bounded_vector("direction", direction, _AXES, "1", -1.0, 1.0)
        self._set("set_gravity_direction", values.tolist(), wait=False)

    def read_boundary(self) -> SafetyBox | None:
        """Returns the boundary of the tool that the controller has; None: an old firmware does not report it whole."""
        states = self._call("get_reduced_states", is_radian=True)
        if len(states) <= _FENCE:
            return None
        ends = MILLIMETRE * np.array(states[_ENDS], float).reshape(3, 2)  # Largest and least.
        size = ends[:, 0] - ends[:, 1]
        if (size <= 0.0).any():
            return None
        return SafetyBox(size=tuple(size), T_base_box=Pose(ends.mean(axis=1)), active=bool(states[_FENCE]))

    def set_boundary(self, box: SafetyBox) -> None:
        """Sets the boundary of the tool (set_reduced_tcp_boundary), to whole millimetres inwards, and if it acts.

        Raises:
            InvalidValueError: The box is turned: the boundary has the axes of the base.
        """
        require_straight(box)
        middle, half = np.array(box.T_base_box.position), 0.5 * np.array(box.size)
        largest = np.floor((middle + half) / MILLIMETRE + _ROUNDING).clip(*_BOUNDARY)
        least = np.ceil((middle - half) / MILLIMETRE - _ROUNDING).clip(*_BOUNDARY)
        self._set("set_reduced_tcp_boundary", np.column_stack((largest, least)).ravel().astype(int).tolist())
        self._set("set_fence_mode", box.active)

    def set_joint_ranges(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets narrower ranges of the joints (set_reduced_joint_range) and reduced mode, which they act in.

        Args:
            lower: Shape (n,), [rad].
            upper: Shape (n,), [rad]; the arm's own ranges end reduced mode.
        """
        low = bounded_vector("lower", lower, self._joints, "rad")
        high = bounded_vector("upper", upper, self._joints, "rad")
        own = self._own_ranges
        is_reduced = bool((low > own.lower + _SAME_ANGLE).any() or (high < own.upper - _SAME_ANGLE).any())
        self._set("set_reduced_joint_range", np.column_stack((low, high)).ravel().tolist())
        self._set("set_reduced_mode", is_reduced)

    def set_motion_limits(
        self, joint_acceleration: float, joint_jerk: float, tool_acceleration: float, tool_jerk: float
    ) -> None:
        """Sets the largest accelerations and the jerks of motions that the controller plans.

        Args:
            joint_acceleration: Up to 20, [rad/s^2].
            joint_jerk: Up to 500, [rad/s^3].
            tool_acceleration: Up to 50, [m/s^2].
            tool_jerk: Up to 100, [m/s^3].
        """
        wanted = (
            ("set_joint_maxacc", "joint_acceleration", joint_acceleration, JOINT_ACCELERATION, "rad/s^2", 1.0),
            ("set_joint_jerk", "joint_jerk", joint_jerk, JOINT_JERK, "rad/s^3", 1.0),
            ("set_tcp_maxacc", "tool_acceleration", tool_acceleration, TOOL_ACCELERATION, "m/s^2", MILLIMETRE),
            ("set_tcp_jerk", "tool_jerk", tool_jerk, TOOL_JERK, "m/s^3", MILLIMETRE),
        )
        checked = [
            (name, float(bounded_vector(label, [value], ("",), unit, 0.0, most)[0]) / wire)
            for name, label, value, most, unit, wire in wanted
        ]
        for name, value in checked:
            self._set(name, value)

    def set_collision_sensitivity(self, value: int) -> None:
        """Sets the sensitivity to collisions, from 0 (off) to 5."""
        self._set("set_collision_sensitivity", _sensitivity(value, COLLISION_SENSITIVITIES), wait=False)

    def set_teach_sensitivity(self, value: int) -> None:
        """Sets the sensitivity to hand guiding, from 1 to 5."""
        self._set("set_teach_sensitivity", _sensitivity(value, TEACH_SENSITIVITIES), wait=False)

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output of the control box: 0 to 7 are CO0 to CO7, 8 to 15 DO0 to DO7."""
        number = require_signal(signal, OUTPUTS)
        with self._request("set_cgpio_digital"):
            self._call("set_cgpio_digital", number, int(level), sync=False)

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input of the control box: 0 to 7 are CI0 to CI7, 8 to 15 DI0 to DI7."""
        number = require_signal(signal, INPUTS)
        with self._request("get_cgpio_digital"):
            return bool(self._call("get_cgpio_digital", number))

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for a digital signal of the control box during a motion; see `StreamingDriver`."""
        request, api = self._client.request, self.api
        if level is None:
            name, number = "get_cgpio_digital", require_signal(signal, INPUTS)
            return self._link.post(request, name, api.get_cgpio_digital, number).reading(bool)
        name, number = "set_cgpio_digital", require_signal(signal, OUTPUTS)
        return self._link.post(request, name, api.set_cgpio_digital, number, int(level), sync=False)

    def set_mode(self, mode: int) -> None:
        """Sets a mode (0, 1, 2, 4, 5, 6 or 7) and makes the arm ready for its commands, as those of `api`."""
        if mode not in _MODES:
            raise InvalidValueError("mode", described(mode), f"does not exist; there are {', '.join(map(str, _MODES))}")
        with self._request("set_mode"):
            self._link.ask(self._client.enter, mode)

    def servo(self, q: JointVector) -> None:
        """Sends a target of mode 1; an arm that does not follow it has the reason in its reports."""
        self._client.request("set_servo_angle_j", self.api.set_servo_angle_j, q.tolist())

    def move_j(
        self, goal: ArrayLike, speed: float = 0.35, acceleration: float = 8.7, *, radius: float | None = None,
        wait: bool = True,
    ) -> None:  # fmt: skip
        """Moves to joint angles, planned by the controller (set_servo_angle, mode 0).

        Args:
            goal: Joint angles, shape (n,), [rad].
            speed: Of the fastest joint, up to pi, [rad/s].
            acceleration: Up to 20, [rad/s^2].
            radius: Of the arc to the next motion, [m]; None: the arm stops between them.
            wait: Whether to return when the queue has ended, not at once.
        """
        ranges = self._own_ranges
        q = bounded_vector("goal", goal, self._joints, "rad", ranges.lower, ranges.upper)
        options = _speed_options(speed, acceleration, JOINT_VELOCITY, JOINT_ACCELERATION, "rad", 1.0)
        self._move("set_servo_angle", wait, angle=q.tolist(), radius=_radius(radius), **options)

    def move_l(
        self, goal: Pose, speed: float = 0.1, acceleration: float = 2.0, *, radius: float | None = None,
        wait: bool = True,
    ) -> None:  # fmt: skip
        """Moves the tool on a line to a pose in base, planned by the controller (set_position, mode 0).

        Args:
            goal: Pose of the tool in base.
            speed: Up to 1, [m/s].
            acceleration: Up to 50, [m/s^2].
            radius: Of the arc to the next line, [m]; None: the arm stops between them.
            wait: Whether to return when the queue has ended, not at once.
        """
        options = _speed_options(speed, acceleration, _FASTEST_TOOL, TOOL_ACCELERATION, "m", MILLIMETRE)
        names = ("x", "y", "z", "roll", "pitch", "yaw")
        pose = dict(zip(names, self._in_user_frame("goal", goal), strict=True))
        self._move("set_position", wait, **pose, radius=_radius(radius), **options)

    def move_c(
        self, via: Pose, goal: Pose, speed: float = 0.1, acceleration: float = 2.0, *, wait: bool = True
    ) -> None:
        """Moves the tool on the arc through `via` to a pose in base, planned by the controller (move_circle, mode 0).

        Args:
            via: A pose whose position lies on the arc.
            goal: Pose of the tool at the end, in base.
            speed: Up to 1, [m/s].
            acceleration: Up to 50, [m/s^2].
            wait: Whether to return when the queue has ended, not at once.

        Raises:
            PlanningError: The positions define no circle.
            UsageError: Motions are in the queue: the start of the arc is where the arm stands.
        """
        options = _speed_options(speed, acceleration, _FASTEST_TOOL, TOOL_ACCELERATION, "m", MILLIMETRE)
        poses = self._in_user_frame("via", via), self._in_user_frame("goal", goal)
        with self._request("move_circle"):
            self._link.on_states(self._link.poll(0.1))
            start = self._link.latest
            assert start is not None  # A connection begins with a state.
            if self._link.shown.queued or self._link.shown.state == MOVING:
                raise UsageError("move_c begins where the arm stands: wait() for the motions before it")
            circle = build_arc(start.T_base_tool_c, via, goal).circle
            assert circle is not None  # Of every arc.
            share = 100.0 * circle.angle / (2.0 * math.pi)
            self._move("move_circle", wait, pose1=list(poses[0]), pose2=list(poses[1]), percent=share, **options)

    def wait(self) -> None:
        """Returns when the motions in the queue have ended; Ctrl-C stops them.

        Raises:
            ControlError: The controller stopped the arm, and its error; or `stop` did.
        """
        with self._request("wait"):
            self._await_end()

    def pause(self) -> None:
        """Holds the motions that the controller plans (set_state 3); from any thread."""
        self._set_state(_PAUSE)

    def resume(self) -> None:
        """Continues them (set_state 0); from any thread."""
        self._set_state(_READY)

    def stop(self) -> None:
        """Stops the arm and empties the queue (set_state 4), then makes it ready again; from any thread."""
        self._is_stopped = True
        self._set_state(_STOP)
        self._set_state(_READY)

    def close(self) -> None:
        """Stops a motion that the controller plans, if this connection waits for one."""
        if self._is_moving:
            with suppress(RcilabError):
                self._set_state(_STOP)

    def require_not_paused(self, name: str) -> None:
        """Requires that the controller holds no paused motions.

        Args:
            name: Name of the request in errors.

        Raises:
            CommandRejectedError: It does.
        """
        if self._call("get_state") == PAUSED:
            raise CommandRejectedError(
                name,
                "a motion of this controller is paused",
                "robot.xarm.resume() continues it, robot.xarm.stop() ends it",
                reason="motion_paused",
            )

    def _set_state(self, state: int) -> None:
        self._client.request("set_state", self.api.set_state, state)

    def _set(self, name: str, *values: Any, **options: Any) -> None:
        """Sends a setting and returns once the slow reports have it."""
        with self._request(name):
            was_ready = self._call("get_state") < STOPPED
            self._call(name, *values, **options)
            if was_ready:
                self._call("set_state", _READY)
            self._link.wait_for_slow_report()

    def _call(self, name: str, *values: Any, **options: Any) -> Any:
        """Returns the values of a request of the library by the name of its method."""
        return self._link.ask(self._client.request, name, getattr(self.api, name), *values, **options)

    def _in_user_frame(self, name: str, pose: object) -> tuple[float, ...]:
        T_base_tool = as_pose(pose, name)  # type: ignore[arg-type]  # Checked there.
        return pose_as_mm_rpy(self._link.T_base_user.inverse() @ T_base_tool)

    def _move(self, name: str, wait: bool, **arguments: Any) -> None:
        with self._request(name):
            self.require_not_paused(name)
            self._link.ask(self._client.command, name, getattr(self.api, name), wait=False, **arguments)
            if wait:
                self._await_end()

    def _await_end(self) -> None:
        quiet, link = 0, self._link
        while earlier := link.poll(0.0):  # From before the motion.
            link.on_states(earlier)
        self._is_moving, self._is_stopped = True, False
        try:
            with self._motion():
                while quiet < _QUIET:
                    states = link.poll(1.0)
                    link.on_states(states)
                    shown = link.shown
                    if self._is_stopped or (shown.state == STOPPED and self._is_still_stopped()):
                        link.wait(lambda: link.is_still, _STANDS)
                        raise self._stopped_error()
                    is_quiet = shown.state in (0, READY, CHANGED) and not shown.queued
                    quiet = quiet + len(states) if is_quiet else 0
        except KeyboardInterrupt:
            self.stop()
            raise
        finally:
            self._is_moving = False

    def _is_still_stopped(self) -> bool:
        """Returns whether the arm is stopped now: a report may be older than the command."""
        return bool(self._call("get_state") == STOPPED)

    def _stopped_error(self) -> ControlError:
        error = self._link.error
        faults = faults_of(error)
        if not error:
            return ControlError(f"{self._link.name}: the motion was stopped before its end", ())
        remedy = f". {faults[0].remedy}" if faults else ""
        text = f"{self._link.name}: the controller stopped the arm: {describe_error(error)}{remedy}"
        return ControlError(text, faults)

    @contextmanager
    def _request(self, name: str) -> Iterator[None]:
        """Surrounds every request but those from any thread."""
        yield

    @contextmanager
    def _motion(self) -> Iterator[None]:
        """Surrounds the wait for a motion of the controller."""
        yield


def _speed_options(
    speed: float, acceleration: float, fastest: float, strongest: float, unit: str, wire: float
) -> dict[str, float]:
    """Returns speed and acceleration in the units of the library, after checking them."""
    v = float(bounded_vector("speed", [speed], ("",), f"{unit}/s", 0.0, fastest)[0])
    a = float(bounded_vector("acceleration", [acceleration], ("",), f"{unit}/s^2", 0.0, strongest)[0])
    return {"speed": v / wire, "mvacc": a / wire}


def _radius(radius: float | None) -> float | None:
    if radius is None:
        return None
    return float(bounded_vector("radius", [radius], ("",), "m", 0.0, LONGEST_TOOL)[0]) / MILLIMETRE


def _sensitivity(value: object, levels: tuple[int, int]) -> int:
    least, largest = levels
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= largest:
        raise InvalidValueError("value", value, f"is no sensitivity; there are {least} to {largest}")
    return value


def _require_near(name: str, position: ArrayLike) -> None:
    length = float(np.linalg.norm(position))
    if not length <= LONGEST_TOOL:
        raise InvalidValueError(
            name, round(length, 6), f"m from the flange is farther than {LONGEST_TOOL:g} m; give metres"
        )
