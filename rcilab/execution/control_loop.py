"""The 1 kHz loop: the robot's states are its clock, each state gets one answer, and there is one stop path."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, CommandFilter, JointPosition, JointTorque
from rcilab.core.errors import (
    CommandRejectedError,
    ConnectionLostError,
    ControlError,
    DeadlineError,
    InvalidValueError,
    PlanningError,
    RcilabError,
)
from rcilab.core.limits import Limits
from rcilab.core.state import ControllerMode, RobotMode, RobotState
from rcilab.execution.call_times import CallTimes
from rcilab.execution.command_validation import describe_distance, distance_to, require_command, require_start
from rcilab.execution.filters import is_near
from rcilab.execution.interrupts import DeferredInterrupts
from rcilab.execution.recorder import CycleLog
from rcilab.execution.stop_planner import CartesianStopPlanner, JointStopPlanner, StopPlanner, TorqueStopPlanner
from rcilab.makers.driver import StreamingDriver
from rcilab.makers.maker import timing_of

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel

STATE_TIMEOUT = 0.1  # [s] Without a state while moving: a lost connection; five times the loss a controller bridges.
LOCAL_STATE_TIMEOUT = 1.0  # [s] The same for a controller on this machine, which pauses both ends when it is busy.
CATCH_UP = 20  # Cycles: the largest number of lost commands that a controller bridges (manual 4.6: 10 to 20).
MODE_TIMEOUT = 3.0  # [s] For the controller to show the requested modes; virtual ones take 0.2 to 1.05 s.
STOP_TIMEOUT = 1.0  # [s] For the response to StopMove after an error.
FILTER_CYCLES = 5000  # Cycles for the filters to reach the last command.
SETTLE_CYCLES = 200  # Cycles between two checks that the controller still approaches the last command.
ARRIVAL_TOLERANCE = 1e-6  # [rad], [m] From the last command; far below the resolution of an arm.
_APPROACH = 0.95  # Share of a distance left after SETTLE_CYCLES with a low pass filter; 0.88 at 0.1 Hz.
STANDSTILL_TIMEOUT = 1.0  # [s] For the controller's own stop; the slowest joint needs 0.3 s from full speed.
_MIN_TORQUE = 1e-3  # [N m] Smaller torques have no effect on the arm.
_MIN_CHANGE = 1e-9  # [rad], [N m] Smaller changes of commanded values are rounding, or the end of an earlier motion.
_NEAR_CYCLES = 2  # Consecutive cycles of a filter at its command until it counts as settled.
RECORD_CYCLES = 50  # Cycles in a ControlError, as in the vendor's client.

Callback: TypeAlias = Callable[[RobotState, float], Command]
"""`(state, t) -> command`; t counts controller cycles since the first call, [s]."""
StopCheck: TypeAlias = Callable[[float], str | None]
"""`(t) -> reason`; called in every cycle, returns the reason to stop the motion, or None."""

_COMMANDS: dict[ControllerMode, type[Command]] = {
    ControllerMode.JOINT_POSITION: JointPosition,
    ControllerMode.JOINT_IMPEDANCE: JointPosition,
    ControllerMode.CARTESIAN_POSITION: CartesianPosition,
    ControllerMode.CARTESIAN_IMPEDANCE: CartesianPosition,
    ControllerMode.TORQUE: JointTorque,
}


class ControlLoop:
    """One motion from its start to its end. Owned by the thread that calls `run`.

    Args:
        driver: The connection.
        limits: Bounds of the arm, for stopping.
        mode: Control mode of the controller.
        log: Records every cycle.
        stop_check: Returns the reason to stop, or None; called in every cycle.
        model: The arm, for stopping a tool within the limits of its joints.
        filters: Filters of a callback's commands, in this order.
        box: The controller's safety box, if known, for fault messages.
        collision_thresholds: Those of the controller, shape (n,), [N m], if known, for fault messages.
        state_timeout: Time without a state that counts as a lost connection, [s].
    """

    def __init__(
        self,
        driver: StreamingDriver,
        limits: Limits,
        mode: ControllerMode,
        log: CycleLog,
        *,
        stop_check: StopCheck,
        model: RobotModel,
        filters: Sequence[CommandFilter],
        box: SafetyBox | None = None,
        collision_thresholds: JointVector | None = None,
        state_timeout: float = STATE_TIMEOUT,
    ) -> None:
        if mode not in _COMMANDS:
            raise InvalidValueError("mode", mode, f"must be one of {[m.name for m in _COMMANDS]}")
        self._driver = driver
        self._listener = driver.on_states
        self._model = model
        self._has_psi = bool(model.redundancy) and driver.commands_arm_angle
        self._limits = limits
        self._mode = mode
        self._kind = _COMMANDS[mode]
        self._log = log
        self._stop_check = stop_check
        self._state_timeout = state_timeout
        self._filters = tuple(filters)
        self._box = box
        self._thresholds = collision_thresholds
        self._first_id = 0
        self._first_q_c = self._first_tau_c = np.zeros(0)
        self._answered_id = -1
        self._t = math.nan
        self._calls = CallTimes()
        self._command: Command | None = None
        self._first_command: Command | None = None
        self._has_moved = False  # A command differs from the first one, or is a torque.
        self._is_executed = False  # The controller's commanded values have changed since the start.
        self._pending: deque[RobotState] = deque()
        self._stop_row: int | None = None  # Number of the first row after the fault, or after the last command.
        self._interrupts = DeferredInterrupts()
        self._stop_planner = _build_stop_planner(self._kind, limits, model)

    def run(self, callback: Callback) -> str | None:
        """Runs a motion to its end.

        Args:
            callback: Returns the command for each state; the one with `finished=True` is the last.

        Returns:
            None if the motion ran to its end, or the reason from `stop_check` if it was stopped.

        Raises:
            ControlError: The controller set error bits or ended the motion by itself.
            ConnectionLostError: No states arrived, or the TCP connection was closed.
            CommandRejectedError: The controller refused to begin.
            DeadlineError: It accepted the motion but did not begin.
            InvalidValueError: The callback returned an invalid command; the motion was stopped.
            Exception: An exception of the callback, after the motion was stopped.
            KeyboardInterrupt: Ctrl-C, after the motion was stopped.
        """
        with self._interrupts:
            return self._run(callback)

    def _run(self, callback: Callback) -> str | None:
        self._driver.begin(self._mode)
        try:
            state = self._await_modes()
            reason = self._stream(state, callback) if isinstance(state, RobotState) else state
        except BaseException as error:
            if isinstance(error, ConnectionLostError) and error.record is None:
                error.record = self._log.recorder.last(RECORD_CYCLES)
            self._end(error)
            raise
        self._end(None, brake=reason is not None)
        return reason

    def _await_modes(self) -> RobotState | str:
        """Returns the newest state that shows the requested modes, or the reason of `stop_check` to stop before."""
        deadline = time.monotonic() + MODE_TIMEOUT
        while time.monotonic() < deadline:
            self._interrupts.deliver()
            states = self._driver.poll(self._state_timeout)
            if not states:
                raise self._lost_error()
            for state in states[:-1]:
                self._log.write(state, self._driver.received_ns)
            state = states[-1]
            if state.faults:
                raise self._fault_error(state)
            if self._driver.has_begun(state):
                self._first_id, self._first_q_c, self._first_tau_c = state.message_id, state.q_c, state.tau_c
                self._stop_planner.begin(state)
                return state
            self._log.write(state, self._driver.received_ns)
            if state.robot_mode is RobotMode.USER_STOPPED:
                raise ControlError(
                    f"{self._driver.name}: an emergency stop or the safety gate has stopped the arm before the motion "
                    "began; release it and switch motor power on",
                    (),
                    self._log.recorder.last(RECORD_CYCLES),
                ).coded("user_stopped_start")
            reason = self._stop_check(0.0)
            if reason is not None:
                return reason
        if not self._has_power():
            raise self._power_off_error()
        raise DeadlineError(
            f"{self._driver.name} accepted the start of a motion and then did not show {self._mode.name} within "
            f"{MODE_TIMEOUT:g} s; try again; if it persists, check the controller's own display"
        ).coded("not_started", seconds=f"{MODE_TIMEOUT:g}")

    def _stream(self, state: RobotState, callback: Callback) -> str | None:
        while True:
            t = (state.message_id - self._first_id) * CYCLE_TIME
            reason = self._stop_check(t)
            if reason is not None:
                self._pending.appendleft(state)  # It has no answer yet: the stop begins with it.
                return reason
            try:
                start_ns = time.monotonic_ns()
                self._interrupts.is_allowed = True
                answer = callback(state, t)
                self._interrupts.is_allowed = False
                self._calls.add(1e-9 * (time.monotonic_ns() - start_ns), t)
                requested = self._checked(answer, state)
                command = self._filtered(requested, state)
            except BaseException:
                self._interrupts.is_allowed = False
                self._pending.appendleft(state)
                raise
            self._answer(state, command)
            if requested.finished:
                return self._finish(requested, command)
            state = self._next()

    def _finish(self, requested: Command, sent: Command) -> str | None:
        """Waits until filters and controller reach the last command; returns the reason of `stop_check`, like `run`."""
        near = 0
        for _ in range(FILTER_CYCLES if self._filters else 0):
            near = near + 1 if is_near(sent, requested) else 0
            if near > _NEAR_CYCLES:
                break
            state = self._next()
            reason = self._stop_check(self._time(state))
            if reason is not None:
                self._pending.appendleft(state)
                return reason
            sent = self._filtered(requested, state)
            self._answer(state, sent)
        last = requested if near else sent
        violation = self._stop_planner.find_motion()
        if violation is not None:
            raise InvalidValueError(
                f"last command at t = {self._t:.3f} s",
                round(violation.value, 3),
                f"{violation.condition.unit} would be needed to stop there ({violation.text}), so the arm was stopped "
                "within the limits, farther on; make the commands stationary before finished=True",
            )
        state = self._hold(last)
        if self._is_unexecuted or distance_to(state, last, has_psi=self._has_psi) > self._tolerance:
            raise self._not_arrived_error(state, last)
        return None

    @property
    def _tolerance(self) -> float:
        """Largest distance from the last command at which the arm has arrived, [rad] or [m]."""
        return max(ARRIVAL_TOLERANCE, self._driver.resolution)

    @property
    def _is_unexecuted(self) -> bool:
        """Whether the commands moved, but the controller still commands what it did before the motion."""
        return self._has_moved and not self._is_executed

    def _follow(self, state: RobotState, command: Command) -> None:
        """Updates what `_is_unexecuted` compares; a motion that ends at its start arrives even if nothing moved."""
        if self._first_command is None:
            self._first_command = command
        if not self._has_moved:
            self._has_moved = _is_different(command, self._first_command)
        if self._has_moved and not self._is_executed:
            now, first = (
                (state.tau_c, self._first_tau_c) if isinstance(command, JointTorque) else (state.q_c, self._first_q_c)
            )
            self._is_executed = float(np.abs(now - first).max()) > _MIN_CHANGE

    def _next(self) -> RobotState:
        """Returns the next state that has not been answered yet, oldest first.

        After a delay of this process several states are queued. Each is answered in turn, because the controller's
        jitter buffer still uses slightly late commands; states older than `CATCH_UP` cycles are skipped.
        """
        deadline = time.monotonic() + self._state_timeout
        while True:
            while self._pending:
                state = self._pending.popleft()
                if state.faults:
                    raise self._fault_error(state)
                # A lock-step controller repeats a state until its answer arrives: ignore it if answered.
                if state.message_id > self._answered_id:
                    if not self._driver.is_streaming(state):
                        raise self._ended_error(state)
                    if self._interrupts.is_pending and not self._log.braking:
                        self._pending.appendleft(state)  # The stop begins with it.
                        self._interrupts.deliver()
                        continue
                    return state
            states = self._driver.poll(deadline - time.monotonic())
            if not states and time.monotonic() >= deadline:
                raise self._lost_error()
            # A fault anywhere in the burst ends the motion: answers to earlier states have no effect.
            oldest = max(len(states) - CATCH_UP, 0)
            first = next((i for i, state in enumerate(states) if state.faults), oldest)
            self._record([state for state in states[:first] if state.message_id > self._answered_id])
            self._pending.extend(states[first:])

    def _answer(self, state: RobotState, command: Command) -> None:
        self._driver.send(state, command)
        sent_ns = time.monotonic_ns()
        self._answered_id = state.message_id
        self._command = command
        self._t = self._time(state)
        self._follow(state, command)
        self._stop_planner.remember(command, state.message_id - self._first_id, state)
        self._log.write(state, self._driver.received_ns, self._t, sent_ns, command)

    def _hold(self, command: Command) -> RobotState:
        """Repeats the last command until the controller has executed it: StopMove may overtake a queued command.

        A low-pass filter of the controller delays the command: this waits as long as the commanded state approaches it.

        Returns:
            The last state, at the command or as close as it got.
        """
        before, cycle = math.inf, 0
        while True:
            state = self._next()
            self._answer(state, command)
            off, cycle = distance_to(state, command, has_psi=self._has_psi), cycle + 1
            if off <= self._driver.resolution and not self._is_unexecuted:
                return state
            if cycle % SETTLE_CYCLES == 0:
                if (
                    off <= self._tolerance
                    or off > _APPROACH * before
                    or self._stop_check(self._time(state)) is not None
                ):
                    return state
                before = off

    def _end(self, error: BaseException | None, *, brake: bool = True) -> None:
        """The stop path of a motion: every motion ends here, also one that ran to its end.

        It stops the arm within the limits if commands are still possible, then ends the motion over TCP. After
        `ControlError` and `ConnectionLostError` the controller stops the arm.
        """
        outcome = error
        if brake and self._command is not None and not isinstance(error, ControlError | ConnectionLostError):
            try:
                self._stop_commands()
            except BaseException as failure:
                outcome = failure
        self._stop_row = self._log.recorder.count if self._stop_row is None else self._stop_row
        try:
            if outcome is None:
                outcome = self._end_normally()
            else:
                self._end_after_error(outcome)
            if isinstance(outcome, ControlError):
                self._record_standstill()
                outcome.stop = self._log.recorder.rows(self._stop_row)
        finally:
            self._driver.on_states, self._log.braking = self._listener, False
        if outcome is not None and outcome is not error:
            raise outcome from error

    def _stop_commands(self) -> None:
        try:
            commands = self._stop_planner.plan()
        except PlanningError:  # The commands exceed all bounds: only StopMove can end the motion.
            return
        self._log.braking = True
        last_id = self._answered_id
        step = 0
        while step < len(commands):
            state = self._next()
            step = min(state.message_id - last_id, len(commands))
            self._answer(state, commands[step - 1])
        self._hold(commands[-1])

    def _end_normally(self) -> ControlError | None:
        """Ends a motion without an error so far; returns an error that the controller reports during its end."""
        states: list[RobotState] = []

        def collect(arrived: list[RobotState]) -> None:
            self._listener(arrived)
            states.extend(arrived)

        self._driver.on_states = collect
        self._driver.end()
        deadline = time.monotonic() + STANDSTILL_TIMEOUT
        while self._is_running(states) and time.monotonic() < deadline:
            collect(self._driver.poll(min(self._state_timeout, STANDSTILL_TIMEOUT)))
        faulty = next((state for state in states if state.faults), None)
        return None if faulty is None else self._fault_error(faulty)

    def _is_running(self, states: list[RobotState]) -> bool:
        """Returns whether the newest state still shows the motion, without a fault; True without a state."""
        return not states or (not any(state.faults for state in states) and self._driver.has_begun(states[-1]))

    def _end_after_error(self, error: BaseException) -> None:
        if isinstance(error, ControlError):
            self._driver.on_states = self._record_stop
        try:
            self._driver.end(STOP_TIMEOUT)
        except (CommandRejectedError, ConnectionLostError, DeadlineError) as refusal:
            error.add_note(f"the end of the motion failed, too: {refusal}")

    def _record_stop(self, states: list[RobotState]) -> None:
        """Records the controller's own stop while a request is answered."""
        if states:
            self._record(states)
        else:
            self._listener(states)

    def _record_standstill(self) -> None:
        """Records the controller's own stop until standstill, so that the next motion starts there."""
        deadline = time.monotonic() + STANDSTILL_TIMEOUT
        before: RobotState | None = None
        while time.monotonic() < deadline:
            states = self._driver.poll(self._state_timeout)
            self._record(states)
            if not states or (before is not None and _is_standstill(before, states[-1])):
                return
            before = states[-1]

    def _record(self, states: list[RobotState]) -> None:
        for state in states:
            self._log.write(state, self._driver.received_ns, self._time(state))

    def _checked(self, command: Any, state: RobotState) -> Command:
        """Returns the callback's command after validation."""
        return require_command(command, self._kind, self._driver.n, self._time(state))

    def _filtered(self, command: Command, state: RobotState) -> Command:
        """Returns the filtered command; the first command starts the filters and must match the commanded state."""
        is_first = self._command is None
        for stage in self._filters:
            if is_first:
                stage.begin(command)
            command = stage.step(command)
        if is_first:
            tool = self._model.T_flange_tool
            require_start(
                command,
                state,
                self._limits,
                has_psi=self._has_psi,
                T_flange_tool=tool,
                resolution=self._driver.resolution,
            )
        return command

    def _time(self, state: RobotState) -> float:
        return (state.message_id - self._first_id) * CYCLE_TIME

    def _fault_error(self, state: RobotState) -> ControlError:
        t = self._time(state) if self._command is not None else math.nan
        self._log.write(state, self._driver.received_ns, t)
        record = self._log.recorder.last(RECORD_CYCLES)  # Up to the fault.
        self._stop_row = self._log.recorder.count
        if self._command is not None:
            self._record([later for later in self._pending if later.message_id > state.message_id])
            self._driver.on_states = self._record_stop
        pressed = self._driver.find_safety_stop(state)
        lacks_commands = self._driver.is_lack_of_commands(state.faults)
        if pressed is None and lacks_commands and len(state.faults) == 1 and not self._has_power():
            return self._power_off_error()
        report = self._driver.describe_faults(
            state.faults,
            record,
            t,
            self._model,
            self._limits,
            self._mode,
            late=self._calls.describe() if lacks_commands else "",
            pressed="" if pressed is None else pressed.sentence,
            box=self._box,
            collision_thresholds=self._thresholds,
        )
        error = ControlError(report.sentence, state.faults, record)
        error.finding, error.advice = report.finding, report.advice
        return error if pressed is None else error.coded("safety_stop", status=pressed.code)

    def _not_arrived_error(self, state: RobotState, command: Command) -> ControlError:
        if self._is_unexecuted:
            cause = "the controller has executed none of the commands: they are lost, check the network"
        elif state.success_rate < 1.0:
            cause = (
                f"{100.0 * state.success_rate:.1f} % of the last second's commands arrived in time: check the network"
            )
        else:
            cause = "the controller holds it back: check its filters and soft limits"
        record = self._log.recorder.last(RECORD_CYCLES)
        if isinstance(command, JointTorque):
            return ControlError(f"the motion did not reach its end: {cause}", (), record)
        if distance_to(state, command, has_psi=self._has_psi) == 0.0:
            return ControlError(f"the motion was not executed: {cause}", (), record)
        off = f": {describe_distance(state, command, has_psi=self._has_psi)} away"
        return ControlError(f"the motion was executed and did not reach its end{off}; {cause}", (), record)

    def _has_power(self) -> bool:
        try:
            return self._driver.is_powered()
        except RcilabError:  # A lost connection has its own error.
            return True

    def _power_off_error(self) -> ControlError:
        record = self._log.recorder.last(RECORD_CYCLES)
        message = "motor power was switched off during the motion, and the brakes hold the arm; switch it on"
        return ControlError(f"{self._driver.name}: {message}", (), record)

    def _ended_error(self, state: RobotState) -> ControlError:
        self._log.write(state, self._driver.received_ns, self._time(state))
        record = self._log.recorder.last(RECORD_CYCLES)
        pressed = self._driver.find_safety_stop(state)
        if pressed is not None:
            sentence = f"the controller stopped the motion at t = {self._time(state):.3f} s: {pressed.sentence}"
            return ControlError(sentence, (), record).coded("safety_stop", status=pressed.code)
        if not self._has_power():
            return self._power_off_error()
        mode = state.robot_mode.name.lower().replace("_", " ")
        return ControlError(
            f"the controller ended the motion by itself at t = {self._time(state):.3f} s without naming a fault "
            f"(robot mode: {mode}); check the controller's own display and the emergency stop",
            (),
            record,
        )

    def _lost_error(self) -> ConnectionLostError:
        when = "before the first command" if math.isnan(self._t) else f"after t = {self._t:.3f} s"
        return ConnectionLostError(
            f"{self._driver.name}: no state for {self._state_timeout:g} s, {when}; check that the controller runs "
            "and the cable is connected, then connect again. The controller stops an arm without commands"
        )


def _is_different(command: Command, first: Command) -> bool:
    """Returns whether a command differs from the first one by more than `ARRIVAL_TOLERANCE`, or is a torque."""
    if isinstance(command, JointTorque):
        return float(np.abs(command.tau).max()) >= _MIN_TORQUE
    if isinstance(command, CartesianPosition) and isinstance(first, CartesianPosition):
        if float(np.abs(command.T_base_tool - first.T_base_tool).max()) > ARRIVAL_TOLERANCE:
            return True
        return command.psi is not None and first.psi is not None and abs(command.psi - first.psi) > ARRIVAL_TOLERANCE
    assert isinstance(command, JointPosition)
    assert isinstance(first, JointPosition)
    return float(np.abs(command.q - first.q).max()) > ARRIVAL_TOLERANCE


def _is_standstill(before: RobotState, after: RobotState) -> bool:
    return (
        after.message_id > before.message_id
        and bool(np.array_equal(before.q_c, after.q_c))
        and float(np.abs(after.dq).max()) < 1e-3
    )


def _build_stop_planner(kind: type[Command], limits: Limits, model: RobotModel) -> StopPlanner:
    period = timing_of(model).command_cycles
    if kind is JointPosition:
        return JointStopPlanner(limits.joint, period)
    return CartesianStopPlanner(limits, model, period) if kind is CartesianPosition else TorqueStopPlanner(limits.joint)
