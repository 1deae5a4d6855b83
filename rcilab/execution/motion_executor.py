"""Execution of motions and callbacks over a driver, with the conditions that stop them.

A planned motion is a stream of rows that can be replaced while it runs: for speed override, pause, or a stop on its
path. A row becomes a command of one of the five modes. Joint position and joint impedance take the angles themselves,
Cartesian position and Cartesian impedance the pose of the tool and, on a 7-axis arm, the arm angle. Torque mode takes
the torques of a computed-torque controller around the plan, with gravity and friction left to the robot as the manual
has it (4.3):

    tau = M (ddq_d + 2 D w (dq_d - dq) + w^2 (q_d - q)) + C dq

For an arm with rotors and damping in its description M has the rotors, and the damping times dq_d is added.
w = `TORQUE_FREQUENCY` and D = `TORQUE_DAMPING` are the same for every joint and deliberately small. This loop closes
over the network: with the jitter buffer of the virtual controller a torque acts about 45 ms after the state that it
answers, and a bandwidth much above 10 rad/s cannot be damped with that delay. The arm is compliant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, CommandFilter, JointPosition, JointTorque
from rcilab.core.errors import KinematicsError
from rcilab.core.limits import Limits
from rcilab.core.state import ControllerMode, Mode, RobotState
from rcilab.execution.control_loop import STATE_TIMEOUT, Callback, ControlLoop, StopCheck
from rcilab.execution.filters import RateLimiter
from rcilab.execution.motion_events import EventQueue
from rcilab.execution.recorder import CycleLog
from rcilab.makers.driver import StreamingDriver
from rcilab.motion import plan_stop
from rcilab.motion.motion_event import CycleEvent
from rcilab.motion.speed_scaling import Shift

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel

LONGEST_PAUSE = 120_000  # Cycles for which a motion can be held: every one of them is recorded.
HELD_TOO_LONG = "held for more than 120 s"
"""Reason for the end of a motion that is held for `LONGEST_PAUSE`."""
TORQUE_FREQUENCY = 6.0  # [rad/s] Below the 10 rad/s that the delay allows, see above.
TORQUE_DAMPING = 0.9  # Of critical: the delay takes some phase, so almost critical.
TORQUE_SHARE = 0.95  # Largest part of the torque limits that is commanded, so that rounding stays inside them.
SETTLING = 300  # Cycles that torque mode stays at the end: two time constants of the compliant arm.

Commander: TypeAlias = Callable[[JointPath, int, RobotState], Command]
"""`(rows, k, state) -> command`: what to send for row k of rows, shape (N, n), [rad]; beyond the last one, for it."""


class MotionExecutor:
    """Runs motions, one at a time, for a session or the control process. Owned by the driver's thread.

    Args:
        driver: The connection.
        log: Records every cycle.
        stop_check: Called in every cycle with the motion time; returns the reason to stop, or None.
        limits: Bounds of every command.
        state_timeout: Time without a state, while moving, that counts as a lost connection, [s].
        on_stopping: Called with the reason when a motion begins to stop before its end.
    """

    def __init__(
        self,
        driver: StreamingDriver,
        log: CycleLog,
        stop_check: StopCheck,
        limits: Limits,
        *,
        state_timeout: float = STATE_TIMEOUT,
        on_stopping: Callable[[str], object] | None = None,
    ) -> None:
        self._driver = driver
        self._log = log
        self._stop_check = stop_check
        self._limits = limits
        self._state_timeout = state_timeout
        self._on_stopping = on_stopping
        self._stream: MotionStream | None = None
        self._is_torque = False
        self._reason: str | None = None  # Why a torque motion is being stopped along its reference.

    def run(
        self,
        callback: Callback,
        mode: Mode,
        model: RobotModel,
        filters: Sequence[CommandFilter] = (),
        *,
        box: SafetyBox | None = None,
        collision_thresholds: JointVector | None = None,
    ) -> str | None:
        """Runs a motion to its end.

        A `MotionStream` in torque mode has a rate limiter, and it stops along its reference: without a commanded
        position, the reference stops and the torques make the arm follow it.

        Args:
            callback: A `MotionStream`, or any other callback.
            mode: Command mode.
            model: The arm.
            filters: Filters of every command.
            box: The controller's safety box, if known, for fault messages.
            collision_thresholds: Those of the controller, shape (n,), [N m], if known, for fault messages.

        Returns:
            None if it ran to its end, or the reason why it was stopped.

        Raises:
            ControlError: The controller stopped it.
            ConnectionLostError: The connection to the controller is lost.
            Exception: An exception of the callback; the arm was stopped.
        """
        self._stream = callback if isinstance(callback, MotionStream) else None
        self._is_torque, self._reason = mode == "torque", None
        if self._stream is not None and not self._driver.commands_arm_angle:
            self._stream.omit_arm_angle()
        if self._stream is not None and self._is_torque:
            filters = [*filters, RateLimiter(self._limits)]
        loop = ControlLoop(
            self._driver,
            self._limits,
            ControllerMode[mode.upper()],
            self._log,
            stop_check=self._check,
            state_timeout=self._state_timeout,
            model=model,
            filters=filters,
            box=box,
            collision_thresholds=collision_thresholds,
        )
        try:
            return loop.run(callback) or self._reason
        finally:
            self._stream = None

    def _check(self, t: float) -> str | None:
        """Returns the reason to stop the motion, or None; called in every cycle."""
        reason, stream = self._stop_check(t), self._stream
        if reason is None and stream is not None and stream.held > LONGEST_PAUSE:
            reason = HELD_TOO_LONG
        if reason is not None and self._reason is None:
            if self._on_stopping is not None:
                self._on_stopping(reason)
            if stream is not None and self._is_torque:
                self._reason = reason
                stream.stop()
                self._log.braking = True
        return None if self._reason else reason


class MotionStream:
    """The callback of a prepared motion: row k in controller cycle k. Owned by the control loop's thread.

    Args:
        rows: Joint angles, shape (N, n), [rad].
        mode: Command mode.
        model: The arm, with its tool and load.
        on_cycle: Called with the number of every cycle of the motion.
        events: What happens on the way.
    """

    def __init__(
        self,
        rows: JointPath,
        mode: Mode,
        model: RobotModel,
        on_cycle: Callable[[int], None] | None = None,
        events: EventQueue | None = None,
    ) -> None:
        self._rows = rows
        self._events = events
        self._ahead = 0  # Cycles of the motion that were left out, less those of waits.
        self._was_waiting = False
        self._first = 0  # Cycle of row 0.
        self._holds = False
        self._next: tuple[int, JointPath, bool] | None = None
        self._model = model
        self._mode: Mode = mode
        self._command = build_commander(mode, model)
        self._settling = SETTLING if mode == "torque" else 0
        self._on_cycle = on_cycle
        self.cycle = 0
        """Cycle of the motion of the newest command: waits do not count."""
        self.shifts: list[Shift] = []
        """Where the motion waited for an input or left cycles out."""
        self.held = 0
        """Number of cycles for which the arm has been held; 0: it moves."""

    def __call__(self, state: RobotState, t: float) -> Command:
        """Returns the command that answers a state."""
        cycle = self.cycle = self._advance(round(t / CYCLE_TIME))
        if self._next is not None and cycle >= self._next[0]:
            self._first, self._rows, self._holds = self._next
            self._next = None
        if self._on_cycle is not None:
            self._on_cycle(cycle)
        rows, last = self._rows, len(self._rows) - 1
        row = cycle - self._first
        # With further rows to follow, the arm is held at the last one.
        self.held = row - last if row > last and (self._holds or self._next is not None) else 0
        is_over = not self._holds and self._next is None and row >= last + self._settling
        is_over = is_over and (self._events is None or self._events.is_settled)
        command = self._command(rows, row, state)
        return replace(command, finished=True) if is_over else command

    def omit_arm_angle(self) -> None:
        """Sends poses without the arm angle from here on: the controller takes none."""
        if self._mode.startswith("cartesian"):
            self._command = _poses(self._model, has_psi=False)

    def _advance(self, now: int) -> int:
        """Returns the motion's cycle in a controller cycle, after the events up to it."""
        if self._events is None:
            return now
        cycle = now + self._ahead
        reached = self._events.advance(cycle, now)
        is_waiting = self._events.is_waiting
        if reached != cycle or is_waiting != self._was_waiting:
            self._ahead = reached - now
            if is_waiting != self._was_waiting or not is_waiting:
                self.shifts.append(Shift(now, reached, is_waiting))
            self._was_waiting = is_waiting
        return reached

    def switch(self, first: int, rows: JointPath, *, holds: bool, events: Sequence[CycleEvent] = ()) -> bool:
        """Replaces the following rows; returns False, without effect, if they do not continue the stream.

        Args:
            first: Cycle of the motion of their first row, in the future; they must continue the present rows.
            rows: Shape (N, n), [rad].
            holds: Whether the arm is held in the last row, before the goal.
            events: All events of the motion, with the cycles that they have then.
        """
        if first <= self.cycle + 1 or not self._continues_stream(first, rows):
            return False
        self._next = (first, rows, holds)
        if self._events is not None:
            self._events.exchange(events)
        return True

    def _continues_stream(self, first: int, rows: JointPath) -> bool:
        """Returns whether rows continue the stream without a jump: the caller may have planned from outdated rows."""
        start, before, _ = self._next if self._next is not None else (math.inf, self._rows, False)
        if first <= start:
            start, before = self._first, self._rows
        step = rows[0] - before[min(first - 1 - int(start), len(before) - 1)]
        return bool((np.abs(step) <= CYCLE_TIME * self._model.limits.joint.velocity).all())

    def stop(self) -> None:
        """Stops from here, every joint as fast as its limits allow, and ends there.

        For torque mode, which has no commanded position: the reference stops, and the torques make the arm follow it.
        """
        stop = plan_stop(self._model.limits.joint, *_reference(self._rows, self.cycle - self._first)).q
        self._rows, self._first, self._holds, self._next = stop, self.cycle, False, None


def build_commander(mode: Mode, model: RobotModel) -> Commander:
    """Returns the function that turns rows into commands of a mode.

    Args:
        mode: Command mode.
        model: The arm, with the tool and load of the controller.
    """
    if mode == "torque":
        return _torques(model)
    return _poses(model, has_psi=bool(model.redundancy)) if mode.startswith("cartesian") else _angles


def _angles(rows: JointPath, k: int, state: RobotState) -> Command:
    return JointPosition(rows[min(k, len(rows) - 1)])


def _poses(model: RobotModel, *, has_psi: bool) -> Commander:
    def command(rows: JointPath, k: int, state: RobotState) -> Command:
        q = rows[min(k, len(rows) - 1)]
        try:
            psi = model.arm_angle(q) if has_psi else None
        except KinematicsError:  # At a singularity; the controller holds its own.
            psi = None
        return CartesianPosition(model.forward(q).matrix, psi)

    return command


def _torques(model: RobotModel) -> Commander:
    stiffness, damping = TORQUE_FREQUENCY**2, 2.0 * TORQUE_DAMPING * TORQUE_FREQUENCY
    largest = TORQUE_SHARE * model.limits.joint.torque
    motion_torque = model.rigid_body.motion_torque
    rotors, friction = model.description.rotor_inertia, model.description.damping

    def command(rows: JointPath, k: int, state: RobotState) -> Command:
        q, dq, ddq = _reference(rows, k)
        ddq = ddq + damping * (dq - state.dq) + stiffness * (q - state.q)
        tau = motion_torque(state.q, state.dq, ddq)
        if rotors is not None:
            tau = tau + rotors * ddq
        if friction is not None:
            tau = tau + friction * dq
        return JointTorque(np.clip(tau, -largest, largest))

    return command


def _reference(rows: JointPath, k: int) -> tuple[Array, Array, Array]:
    """Returns position, velocity and acceleration of row k by backward differences, with standstill before and after.

    The first torque is then zero, as the torque rate requires.
    """
    last = len(rows) - 1
    now, before, earlier = (rows[min(max(row, 0), last)] for row in (k, k - 1, k - 2))
    return now, (now - before) / CYCLE_TIME, (now - 2.0 * before + earlier) / CYCLE_TIME**2
