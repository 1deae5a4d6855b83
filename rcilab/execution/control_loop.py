"""The 1 kHz loop: the robot's state is the clock, every state gets one answer, and there is one stop path."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
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
from rcilab.execution.command_validation import check_command, describe_distance, distance_to, require_first
from rcilab.execution.filters import CommandFilter, is_near
from rcilab.execution.recorder import CycleLog
from rcilab.execution.stop_planner import CartesianStopPlanner, JointStopPlanner, StopPlanner, TorqueStopPlanner
from rcilab.makers.driver import StreamingDriver
from rcilab.makers.maker import timing_of

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel

STATE_TIMEOUT = (
    0.1  # [s] without a state while moving means a lost connection: five times the loss a controller bridges.
)
LOCAL_STATE_TIMEOUT = 1.0  # [s] The same of a controller on this machine, which pauses both ends when it is busy.
CATCH_UP = 20  # Cycles: as many lost commands as a controller bridges at most (manual 4.6: 10 to 20).
MODE_TIMEOUT = 3.0  # [s] for the controller to show the requested modes; virtual ones take 0.2 to 1.05 s.
STOP_TIMEOUT = 1.0  # [s] for the answer to StopMove when something has gone wrong already.
FILTER_CYCLES = 5000  # Cycles that filters get at most to arrive at the last command.
SETTLE_CYCLES = 200  # Cycles that the last command is repeated for at most while the controller comes no nearer to it.
ARRIVAL_TOLERANCE = 1e-6  # [rad], [m] What a motion may end off its last command: far below what an arm resolves.
_NEARER = 0.95  # What is left of a distance after SETTLE_CYCLES where a low pass approaches, at 0.1 Hz 0.88.
REST_TIMEOUT = 1.0  # [s] for the controller's own stop after a fault; the slowest joint needs 0.3 s from full speed.
_FELT = 1e-3  # [N m] Smaller torques have no effect on the arm.
_NEAR_CYCLES = 2  # Cycles in a row that a filter is at its command until it counts as standing there.
RECORD_CYCLES = 50  # Cycles that a ControlError carries, as many as the vendor's client writes.

Callback: TypeAlias = Callable[[RobotState, float], Command]
"""`(state, t) -> command`; t counts controller cycles since the first call, [s]."""
StopCheck: TypeAlias = Callable[[float], str | None]
"""Called in every cycle with t; returns the reason to stop the motion, or None."""

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
        mode: How the controller shall follow.
        log: Where every cycle is written.
        watch: Returns in every cycle whether to stop.
        model: The arm, for stopping a tool within what its joints allow.
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
        watch: StopCheck,
        model: RobotModel,
        filters: Sequence[CommandFilter],
        box: SafetyBox | None = None,
        collision_thresholds: JointVector | None = None,
        state_timeout: float = STATE_TIMEOUT,
    ) -> None:
        if mode not in _COMMANDS:
            raise InvalidValueError("mode", mode, f"must be one of {[m.name for m in _COMMANDS]}")
        self._driver = driver
        self._model = model
        self._has_psi = bool(model.redundancy)
        self._limits = limits
        self._mode = mode
        self._kind = _COMMANDS[mode]
        self._log = log
        self._watch = watch
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
        self._pending: deque[RobotState] = deque()
        self._brake = _build_stop_planner(self._kind, limits, model)

    def run(self, callback: Callback) -> str | None:
        """Runs a motion to its end.

        Args:
            callback: Returns the command for each state; the one with `finished=True` is the last.

        Returns:
            None when the motion ran to its end, or the reason from `watch` when it was stopped before.

        Raises:
            ControlError: The controller set error bits or ended the motion by itself.
            ConnectionLostError: States stopped coming, or the TCP connection broke.
            CommandRejectedError: The controller refused to begin.
            DeadlineError: It agreed to begin and then did not.
            InvalidValueError: The callback returned an invalid command; the motion was stopped.
            Exception: An exception of the callback, after the motion was stopped.
        """
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
        """Returns the newest state that shows the requested modes, or the reason of `watch` to stop before."""
        deadline = time.monotonic() + MODE_TIMEOUT
        while time.monotonic() < deadline:
            states = self._driver.poll(self._state_timeout)
            if not states:
                raise self._lost()
            for state in states[:-1]:
                self._log.write(state, self._driver.received_ns)
            state = states[-1]
            if state.faults:
                raise self._fault(state)
            if self._driver.has_begun(state):
                self._first_id, self._first_q_c, self._first_tau_c = state.message_id, state.q_c, state.tau_c
                self._brake.begin(state)
                return state
            self._log.write(state, self._driver.received_ns)
            if state.robot_mode is RobotMode.USER_STOPPED:
                raise ControlError(
                    f"{self._driver.name}: an emergency stop or the safety gate has stopped the arm before the motion "
                    "began; release it and switch the power on",
                    (),
                    self._log.recorder.last(RECORD_CYCLES),
                ).coded("user_stopped_start")
            reason = self._watch(0.0)
            if reason is not None:
                return reason
        if not self._has_power():
            raise self._cut_off()
        raise DeadlineError(
            f"{self._driver.name} accepted the start of a motion and then did not show {self._mode.name} within "
            f"{MODE_TIMEOUT:g} s; try again, and look at the controller's own display if it goes on"
        ).coded("not_started", seconds=f"{MODE_TIMEOUT:g}")

    def _stream(self, state: RobotState, callback: Callback) -> str | None:
        while True:
            t = (state.message_id - self._first_id) * CYCLE_TIME
            reason = self._watch(t)
            if reason is not None:
                self._pending.appendleft(state)  # Still without an answer: the stop begins with it.
                return reason
            try:
                begun_ns = time.monotonic_ns()
                answer = callback(state, t)
                self._calls.add(1e-9 * (time.monotonic_ns() - begun_ns), t)
                wanted = self._checked(answer, state)
                command = self._filtered(wanted, state)
            except BaseException:
                self._pending.appendleft(state)
                raise
            self._answer(state, command)
            if wanted.finished:
                return self._finish(wanted, command)
            state = self._next()

    def _finish(self, wanted: Command, sent: Command) -> str | None:
        """Waits until filters and controller reach the last command; returns the reason of `watch`, as `run`."""
        near = 0
        for _ in range(FILTER_CYCLES if self._filters else 0):
            near = near + 1 if is_near(sent, wanted) else 0
            if near > _NEAR_CYCLES:
                break
            state = self._next()
            reason = self._watch(self._time(state))
            if reason is not None:
                self._pending.appendleft(state)
                return reason
            sent = self._filtered(wanted, state)
            self._answer(state, sent)
        last = wanted if near else sent
        violation = self._brake.find_motion()
        if violation is not None:
            raise InvalidValueError(
                f"last command at t = {self._t:.3f} s",
                round(violation.value, 3),
                f"{violation.condition.unit} is what standing still from there would take ({violation.text}), so the "
                "arm was stopped within the limits, farther on; let the commands stop before finished=True",
            )
        state = self._hold(last)
        if distance_to(state, last, has_psi=self._has_psi) > ARRIVAL_TOLERANCE or self._is_unplayed(state, last):
            raise self._not_arrived(state, last)
        return None

    def _is_unplayed(self, state: RobotState, command: Command) -> bool:
        """Returns whether torques were sent and the controller commands what it did before the first of them."""
        if not isinstance(command, JointTorque) or np.abs(command.tau).max() < _FELT:
            return False
        return np.array_equal(state.tau_c, self._first_tau_c)

    def _next(self) -> RobotState:
        """Returns the next state that has not been answered yet, oldest first.

        After a delay of this process several are waiting. Each is answered in turn, because the controller's jitter
        buffer still uses slightly late commands; states older than `CATCH_UP` cycles are skipped.
        """
        deadline = time.monotonic() + self._state_timeout
        while True:
            while self._pending:
                state = self._pending.popleft()
                if state.faults:
                    raise self._fault(state)
                # A lock-step controller repeats a state whose answer it has not seen yet: it was answered, wait on.
                if state.message_id > self._answered_id:
                    if not self._driver.is_streaming(state):
                        raise self._ended_by_controller(state)
                    return state
            states = self._driver.poll(deadline - time.monotonic())
            if not states and time.monotonic() >= deadline:
                raise self._lost()
            for state in states[:-CATCH_UP]:
                if state.message_id > self._answered_id:
                    self._log.write(state, self._driver.received_ns, self._time(state))
            # A fault anywhere in the burst ends the motion: no answer before it matters.
            faulty = [state for state in states if state.faults]
            self._pending.extend(faulty[:1] or states[-CATCH_UP:])

    def _answer(self, state: RobotState, command: Command) -> None:
        self._driver.send(state, command)
        sent_ns = time.monotonic_ns()
        self._answered_id = state.message_id
        self._command = command
        self._t = self._time(state)
        self._brake.remember(command, state.message_id - self._first_id, state)
        self._log.write(state, self._driver.received_ns, self._t, sent_ns, command)

    def _hold(self, command: Command) -> RobotState:
        """Repeats the last command until the controller has executed it: StopMove may overtake a queued one.

        A low-pass filter of the controller delays it: it waits as long as the commanded state comes closer.

        Returns:
            The last state, at the command or as close as it came.
        """
        before, cycle = math.inf, 0
        while True:
            state = self._next()
            self._answer(state, command)
            off, cycle = distance_to(state, command, has_psi=self._has_psi), cycle + 1
            if off == 0.0:
                return state
            if cycle % SETTLE_CYCLES == 0:
                if off <= ARRIVAL_TOLERANCE or off > _NEARER * before or self._watch(self._time(state)) is not None:
                    return state
                before = off

    def _end(self, error: BaseException | None, *, brake: bool = True) -> None:
        """The single stop path: every motion ends here, also one that ran to its end.

        Stops the commands within the limits if commands are still possible, then ends the motion over TCP. After
        `ControlError` and `ConnectionLostError` the controller stops by itself.
        """
        surprise = error
        if brake and self._command is not None and not isinstance(error, ControlError | ConnectionLostError):
            try:
                self._stop_commands()
            except BaseException as worse:
                surprise = worse
        first = self._log.recorder.count
        if surprise is None:
            surprise = self._end_well()
        else:
            self._end_badly(surprise)
        if isinstance(surprise, ControlError):
            self._watch_standstill()
            surprise.stop = self._log.recorder.rows(first)
        if surprise is not None and surprise is not error:
            raise surprise from error

    def _stop_commands(self) -> None:
        try:
            way = self._brake.plan()
        except PlanningError:  # The commands were beyond every bound: only StopMove can end the motion.
            return
        self._log.braking = True
        last_id = self._answered_id
        step = 0
        while step < len(way):
            state = self._next()
            step = min(state.message_id - last_id, len(way))
            self._answer(state, way[step - 1])
        self._hold(way[-1])

    def _end_well(self) -> ControlError | None:
        """Ends a motion without an error so far; returns an error of the controller in its last commands."""
        states: list[RobotState] = []

        def take(arrived: list[RobotState]) -> None:
            others(arrived)
            states.extend(arrived)

        others, self._driver.on_states = self._driver.on_states, take
        try:
            self._driver.end()
            deadline = time.monotonic() + REST_TIMEOUT
            while self._is_running(states) and time.monotonic() < deadline:
                take(self._driver.poll(min(self._state_timeout, REST_TIMEOUT)))
        finally:
            self._driver.on_states, self._log.braking = others, False
        faulty = next((state for state in states if state.faults), None)
        return None if faulty is None else self._fault(faulty)

    def _is_running(self, states: list[RobotState]) -> bool:
        """Returns whether the newest of these states shows the motion without a fault; True without a state."""
        return not states or (not any(state.faults for state in states) and self._driver.has_begun(states[-1]))

    def _end_badly(self, error: BaseException) -> None:
        others = self._driver.on_states
        if isinstance(error, ControlError) and not self._driver.has_listener:
            self._driver.on_states = self._record  # The controller's own stop has begun.
        try:
            self._driver.end(STOP_TIMEOUT)
        except (CommandRejectedError, ConnectionLostError, DeadlineError) as refusal:
            error.add_note(f"ending the motion failed, too: {refusal}")
        finally:
            self._driver.on_states, self._log.braking = others, False

    def _watch_standstill(self) -> None:
        """Records the controller's own stop, so that the record shows it and the next motion starts at standstill."""
        deadline = time.monotonic() + REST_TIMEOUT
        before: RobotState | None = None
        while time.monotonic() < deadline:
            states = self._driver.poll(self._state_timeout)
            self._record(states)
            if not states or (before is not None and _stands(before, states[-1])):
                return
            before = states[-1]

    def _record(self, states: list[RobotState]) -> None:
        for state in states:
            self._log.write(state, self._driver.received_ns, self._time(state))

    def _checked(self, command: Any, state: RobotState) -> Command:
        """Returns the callback's command after validation."""
        return check_command(command, self._kind, self._driver.n, self._time(state))

    def _filtered(self, command: Command, state: RobotState) -> Command:
        """Returns the filtered command; the first one starts the filters and must match the commanded state."""
        is_first = self._command is None
        for link in self._filters:
            if is_first:
                link.begin(command)
            command = link.step(command)
        if is_first:
            require_first(command, state, self._limits, has_psi=self._has_psi)
        return command

    def _time(self, state: RobotState) -> float:
        return (state.message_id - self._first_id) * CYCLE_TIME

    def _fault(self, state: RobotState) -> ControlError:
        t = self._time(state) if self._command is not None else math.nan
        self._log.write(state, self._driver.received_ns, t)
        pressed = self._driver.find_safety_stop(state)
        lacks_commands = self._driver.is_lack_of_commands(state.faults)
        if pressed is None and lacks_commands and len(state.faults) == 1 and not self._has_power():
            return self._cut_off()
        record = self._log.recorder.last(RECORD_CYCLES)
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
        error.finding = report.finding
        return error if pressed is None else error.coded("safety_stop", status=pressed.code)

    def _not_arrived(self, state: RobotState, command: Command) -> ControlError:
        if isinstance(command, JointTorque) or np.array_equal(state.q_c, self._first_q_c):
            cause = "the controller has played none of the commands: they are lost on their way, look at the network"
        elif state.success_rate < 1.0:
            cause = (
                f"{100.0 * state.success_rate:.1f} % of the last second's commands arrived in time: look at the network"
            )
        else:
            cause = "something in the controller holds it back: look at its filters and soft limits"
        record = self._log.recorder.last(RECORD_CYCLES)
        off = (
            ""
            if isinstance(command, JointTorque)
            else f": {describe_distance(state, command, has_psi=self._has_psi)} from its end"
        )
        return ControlError(f"the motion was executed and did not arrive{off}; {cause}", (), record)

    def _has_power(self) -> bool:
        try:
            return self._driver.is_powered()
        except RcilabError:  # A lost connection has its own error.
            return True

    def _cut_off(self) -> ControlError:
        record = self._log.recorder.last(RECORD_CYCLES)
        said = "the motors were switched off while the motion ran, and the brakes hold the arm; call power_on()"
        return ControlError(f"{self._driver.name}: {said}", (), record)

    def _ended_by_controller(self, state: RobotState) -> ControlError:
        self._log.write(state, self._driver.received_ns, self._time(state))
        if not self._has_power():
            return self._cut_off()
        record = self._log.recorder.last(RECORD_CYCLES)
        mode = state.robot_mode.name.lower().replace("_", " ")
        return ControlError(
            f"the controller ended the motion by itself at t = {self._time(state):.3f} s without naming a fault "
            f"(robot mode: {mode}); look at the controller's own display and the emergency stop",
            (),
            record,
        )

    def _lost(self) -> ConnectionLostError:
        when = "before the first command" if math.isnan(self._t) else f"after t = {self._t:.3f} s"
        return ConnectionLostError(
            f"{self._driver.name}: no state for {self._state_timeout:g} s, {when}; look whether the controller runs "
            "and the cable is in, then connect again. The controller stops an arm that gets no commands by itself"
        )


def _stands(before: RobotState, after: RobotState) -> bool:
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
