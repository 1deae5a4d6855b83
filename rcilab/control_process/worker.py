"""The control process: one thread, one connection, one loop.

It reads states, writes every cycle into the shared ring, handles requests and streams motions. It imports no graphics
library. The supervisor's fork server calls `main`.
"""

from __future__ import annotations

import argparse
import gc
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from rcilab.control_process.jog_record import HeldJog
from rcilab.control_process.layout import OPERATOR_TIMEOUT, ControlBlock
from rcilab.control_process.messages import (
    Configure,
    Connect,
    End,
    Execute,
    Jog,
    NumberedRequest,
    ReadInputs,
    Reboot,
    Recover,
    Request,
    SetOutput,
    SetPower,
    StartGuiding,
    Stop,
    StopGuiding,
    SwitchRows,
    WorkerSettings,
)
from rcilab.control_process.requests import RequestChannel
from rcilab.control_process.status_writer import StatusWriter
from rcilab.control_process.stop_conditions import StopConditions
from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ConnectionLostError, ControlError, InvalidValueError, ModelError, RcilabError, UsageError
from rcilab.core.fault import name_faults
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose, as_pose
from rcilab.core.state import Mode, RobotMode, RobotState
from rcilab.execution.command_validation import find_start_mismatch
from rcilab.execution.control_loop import Callback
from rcilab.execution.guiding import HandGuide
from rcilab.execution.jog import JogCallback
from rcilab.execution.motion_events import EventQueue, SignalListener
from rcilab.execution.motion_executor import HELD_TOO_LONG, LONGEST_PAUSE, MotionExecutor, MotionStream
from rcilab.execution.recorder import CycleLog
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import StreamingDriver, open_driver
from rcilab.makers.maker import capabilities_of, start_tolerance_of, timing_of
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_stop
from rcilab.motion.speed_scaling import Shift
from rcilab.realtime.cpu_latency import awake_cores
from rcilab.realtime.scheduling import enter_realtime, loop_priority

IDLE_STATE_TIMEOUT = 0.3  # [s] Without a state while idle until the connection counts as lost; a page waits 0.5 s.
_POLL_PERIOD = 0.02  # [s] Longest wait in the idle loop, and time between two checks for the supervisor.
MOST_SHIFTS = 1000
"""Largest number of waits of a motion that fit into the reply."""
_IDLE_PERIOD = 0.004  # [s] Between two polls for states while nothing moves; saves CPU time.


class ControlProcess:
    """The control process. Owned by its one thread.

    Args:
        block: The shared block.
        parent: Process id of the fork server, which ends with the supervisor; this process then ends, too.
    """

    def __init__(self, block: ControlBlock, parent: int) -> None:
        settings = block.settings
        assert isinstance(settings, WorkerSettings)  # Written by the supervisor.
        self._settings = settings
        self._requests = RequestChannel(block)
        self._stop_conditions = StopConditions(block.counters, parent)
        self._model = load_model(self._settings.arm.name, tool=self._settings.T_flange_tool)
        self._switches_power = capabilities_of(self._model).switches_power
        self._status = StatusWriter(block)
        self._log = CycleLog(
            self._status.recorder, self._status.on_row, state_cycles=timing_of(self._model).state_cycles
        )
        self._motions = MotionService(
            block, self._settings.limits, self._status, self._log, self._requests, self._stop_conditions
        )
        self._driver: StreamingDriver | None = None
        self._address = ""
        self._is_ending = False
        self._next_check = 0.0
        self._guide: HandGuide | None = None
        self._tool_source: tuple[JointVector, Pose] | None = None  # Joint angles and pose that gave the last tool.

    def run(self) -> int:
        """Runs until an `End` request or the end of the supervisor; returns the exit code."""
        plan_stop(
            self._settings.limits.joint,
            np.zeros(self._settings.arm.n),
            np.full(self._settings.arm.n, 0.1),
            np.zeros(self._settings.arm.n),
        )  # The first call loads the planner; the next one must be fast.
        self._model.rigid_body.gravity(self._model.home)  # The first call loads the library: seconds from a cold disk.
        gc.collect()
        gc.freeze()  # The collection after a motion scans only what is newer.
        granted = enter_realtime(loop_priority(timing_of(self._model).command_cycles))
        self._status.update(is_fifo=granted.policy == "SCHED_FIFO", memory_locked=granted.memory_locked)
        if granted.warning:
            print(granted.warning, file=sys.stderr, flush=True)
        try:
            while not (self._is_ending or self._is_orphan()):
                try:
                    self._receive_states()
                    self._handle_requests()
                    self._check_guiding()
                except ConnectionLostError as error:  # Never ends this process.
                    self._handle_loss(error)
        finally:
            self._disconnect()
        return 0

    def request_exit(self) -> None:
        """Stops the arm and ends, as after the end of the supervisor; exits at once if no arm is connected."""
        self._stop_conditions.request_exit()
        if self._driver is None:
            sys.exit()

    def _is_orphan(self) -> bool:
        """Returns whether the supervisor has ended; checks at most once per `_POLL_PERIOD`."""
        now = time.monotonic()
        if now < self._next_check:
            return False
        self._next_check = now + _POLL_PERIOD
        return self._stop_conditions.is_orphan

    def _receive_states(self) -> None:
        """Receives states while nothing moves."""
        if self._driver is None:
            self._status.write_heartbeat()
            time.sleep(_POLL_PERIOD)
            return
        if self._guide is None and self._status.snapshot.phase == "idle":
            time.sleep(_IDLE_PERIOD)  # Receiving every state one by one would double the CPU time.
            self._record(self._driver.poll(0.0), is_awaited=False)
        states = self._driver.poll(_POLL_PERIOD)
        self._record(states)
        if states:
            self._update_phase(states[-1])
        elif time.monotonic_ns() - self._driver.received_ns > IDLE_STATE_TIMEOUT * 1e9:
            self._status.set_phase("lost", "lost.silent", address=self._address)

    def _record(self, states: list[RobotState], *, is_awaited: bool = True) -> None:
        if not states:
            self._status.write_heartbeat()  # Otherwise every row counts as a heartbeat.
        for state in states:
            assert self._driver is not None
            self._log.write(
                state,
                self._driver.received_ns,
                is_awaited=is_awaited,
                counts_gap=not self._driver.keeps_newest,
            )

    def _update_phase(self, state: RobotState) -> None:
        """Updates the phase from a state of the robot while nothing moves."""
        phase, was_powered = self._status.snapshot.phase, self._status.snapshot.powered
        powered = self._power_shown(state)
        if powered is not was_powered:
            self._status.update(powered=powered)
            self._report_ready()
        self._update_tool(state)
        if self._guide is not None and self._guide.has_ended(state):
            self._guide = None
            self._report_ready()
        elif state.faults:
            if phase != "fault" or self._status.snapshot.code == "fault.pressed":
                self._report_fault(state.faults)
        elif phase in ("fault", "lost"):
            self._report_ready()

    def _power_shown(self, state: RobotState) -> bool | None:
        """Returns motor power after a state of the robot."""
        if not self._switches_power:
            return self._require_driver().is_powered(alongside=True)
        is_cut = state.robot_mode is RobotMode.USER_STOPPED  # By the emergency stop or the gate.
        return False if is_cut else self._status.snapshot.powered

    def _update_tool(self, state: RobotState) -> None:
        """Updates the tool, which follows from joint angles and pose, when one of them has changed."""
        source = (state.q_c, state.T_base_tool_c)
        if self._tool_source is not None and _is_same(source, self._tool_source):
            return
        self._tool_source = source
        with suppress(InvalidValueError):  # A controller may report no pose before it is ready.
            flange = self._model.pose(state.q_c, "flange")
            self._status.write_tool(flange.inverse() @ as_pose(state.T_base_tool_c.matrix))

    def _handle_requests(self) -> None:
        while (request := self._requests.pop()) is not None:
            try:
                reported = self._handle(request.body)
            except RcilabError as error:
                self._report_failure(request, error)
            except Exception as error:
                self._report_failure(request, error)
                raise
            else:
                self._requests.answer(request, reported=reported, shifts=self._motions.pop_shifts())

    def _handle(self, request: Request) -> RobotConfiguration | None:
        """Handles a request; returns what the controller reports of its configuration, if that may have changed."""
        match request:
            case Connect():
                return self._connect(request)
            case Configure():
                return self._configure(request.configuration)
            case SetPower():
                self._set_power(request.on)
            case SetOutput():
                self._set_output(request.signal, request.level)
            case ReadInputs():
                self._read_inputs()
            case Reboot():
                self._reboot()
            case Recover():
                self._recover()
            case Stop():
                self._stop_conditions.acknowledge_stops(request.number)  # The motion before it has stopped by now.
                self._end_guiding("idle.stopped")
            case StartGuiding():
                self._start_guiding(request)
            case StopGuiding():
                self._end_guiding("idle.guided")
            case Execute():
                driver = self._require_driver()
                self._record(driver.poll(_POLL_PERIOD))
                self._motions.execute(driver, self._model, request)
            case Jog():
                driver = self._require_driver()
                self._record(driver.poll(_POLL_PERIOD))
                self._motions.jog(driver, self._model)
            case SwitchRows():
                raise UsageError("no motion is running whose speed override could change").coded("override_idle")
            case End():
                self._is_ending = True
        return None

    def _report_failure(self, request: NumberedRequest, error: Exception) -> None:
        if isinstance(error, StoppedError):
            pass  # The phase shows it already.
        elif isinstance(error, ConnectionLostError) or (isinstance(request.body, Connect) and self._driver is None):
            self._handle_loss(error)
        elif isinstance(error, ControlError) and error.faults:
            self._report_fault(error.faults)
        elif self._driver is not None and self._guide is None:
            self._status.set_phase("idle", "idle.failed", error=str(error))
        self._requests.answer(request, error, shifts=self._motions.pop_shifts())

    def _handle_loss(self, error: Exception) -> None:
        """Closes the connection and reports why."""
        code = "lost.unreachable" if self._driver is None else "lost.closed"
        if isinstance(error, ModelError):
            code = "lost.other_arm"
        self._disconnect()
        self._status.set_phase("lost", code, error=str(error))

    def _connect(self, request: Connect) -> RobotConfiguration:
        self._disconnect()
        self._address = request.address
        self._status.set_phase("connecting", "connecting", address=self._address)
        driver = open_driver(self._address, request.timeout, self._settings.arm)
        self._driver = driver
        driver.on_states = self._record
        self._log.restart()
        self._status.restart()
        if driver.latest is not None:
            self._record([driver.latest])  # Before it is ready: the newest row may be from an earlier process.
        self._tool_source = None
        self._read_power()
        return self._configure(request.configuration)

    def _configure(self, configuration: RobotConfiguration) -> RobotConfiguration:
        driver = self._require_driver()
        self._model = configuration.applied_to(self._model)
        driver.configure(configuration)
        reported = driver.read_configuration()
        self._report_ready()
        return reported

    def _set_power(self, on: bool) -> None:
        self._require_driver().power(on)
        self._read_power()
        self._report_ready()

    def _set_output(self, signal: int, level: bool) -> None:
        self._require_driver().set_output(signal, level)
        self._status.set_output(signal, level)
        self._read_inputs()  # An output may be wired to an input.

    def _read_inputs(self) -> None:
        driver, count = self._require_driver(), len(capabilities_of(self._model).inputs)
        self._status.update(inputs=sum(driver.read_input(signal) << signal for signal in range(count)))

    def _reboot(self) -> None:
        self._require_driver().reboot()
        self._disconnect()
        self._status.set_phase("lost", "lost.rebooted", address=self._address)

    def _recover(self) -> None:
        driver = self._require_driver()
        if driver.recovery_silence > 0.0:
            self._status.announce_silence(driver.recovery_silence)
        driver.recover()
        self._read_power()
        self._report_ready()

    def _start_guiding(self, request: StartGuiding) -> None:
        guide = HandGuide(self._require_driver())
        guide.start(request.space, request.kind)
        self._guide = guide
        self._status.begin_motion(None)
        self._status.set_phase("moving", "moving.guided")

    def _check_guiding(self) -> None:
        """Ends hand guiding when the operator is no longer present."""
        if self._guide is None or not self._stop_conditions.is_operator_gone:
            return
        try:
            self._end_guiding("idle.operator", seconds=OPERATOR_TIMEOUT)
        except ConnectionLostError:
            raise
        except RcilabError as error:  # The states that follow show where the arm is.
            self._status.set_phase("idle", "idle.failed", error=str(error))

    def _end_guiding(self, code: str, **facts: Any) -> None:
        """Ends hand guiding, if active, and returns once the arm is stationary."""
        guide, self._guide = self._guide, None
        if guide is not None:
            self._status.set_phase("stopping", "stopping")
            guide.stop()
            self._status.set_phase("idle", code, **facts)

    def _read_power(self) -> None:
        self._status.update(powered=self._require_driver().is_powered())

    def _report_ready(self) -> None:
        if self._driver is not None and self._driver.latest is not None and self._driver.latest.faults:
            self._report_fault(self._driver.latest.faults)
        elif self._guide is not None:
            self._status.set_phase("moving", "moving.guided")
        elif self._status.snapshot.powered:
            self._status.set_phase("idle", "idle")
        else:
            self._status.set_phase("idle", "idle.unpowered")

    def _report_fault(self, faults: Sequence[object]) -> None:
        """Reports what has stopped the arm; a safety stop sets an error bit that has another meaning."""
        state = None if self._driver is None else self._driver.latest
        if state is not None and state.robot_mode is RobotMode.USER_STOPPED:
            self._status.set_phase("fault", "fault.pressed")
        elif self._status.snapshot.code in ("fault.pressed", "fault.released"):
            self._status.set_phase("fault", "fault.released")  # Only its error bit is still set.
        else:
            self._status.set_phase("fault", "fault", faults=name_faults(faults))

    def _require_driver(self) -> StreamingDriver:
        if self._driver is None:
            raise UsageError("no controller is connected; reconnect first").coded("not_connected")
        return self._driver

    def _disconnect(self) -> None:
        if self._driver is not None:
            self._guide = None  # The controller ends it with the connection.
            self._driver.close()
            self._driver = None
            self._status.update(powered=None, inputs=-1, outputs_known=0, outputs=0)


class StoppedError(ControlError):
    """A motion was stopped before its end, on request."""


class MotionService:
    """Runs one motion after the other. Owned by the control process's one thread.

    Args:
        block: The shared block with rows and jogs.
        limits: Bounds of every command.
        status: Writes the progress of a motion.
        log: Records every cycle.
        requests: Requests that arrive while the arm moves.
        stop_conditions: Conditions that end a motion.
    """

    def __init__(
        self,
        block: ControlBlock,
        limits: Limits,
        status: StatusWriter,
        log: CycleLog,
        requests: RequestChannel,
        stop_conditions: StopConditions,
    ) -> None:
        self._block, self._limits = block, limits
        self._status, self._log = status, log
        self._requests, self._stop_conditions = requests, stop_conditions
        self._jog: JogCallback | None = None
        self._is_stopping = False
        self._stream: MotionStream | None = None
        self._shifts: tuple[Shift, ...] = ()

    def execute(self, driver: StreamingDriver, model: RobotModel, request: Execute) -> None:
        """Streams the rows in the block; returns once the arm is stationary at their end.

        Raises:
            UsageError: The arm is not at their start.
            StoppedError: The motion was stopped before its end.
            ControlError: The controller stopped the arm.
        """
        rows = self._block.motion[: request.rows]
        mode = request.mode
        if driver.latest is not None:
            mismatch = find_start_mismatch(rows[0], driver.latest.q_c, start_tolerance_of(model))
            if mismatch is not None:
                raise UsageError(mismatch).coded("elsewhere")
            model.rigid_body.motion_torque(driver.latest.q, driver.latest.dq, driver.latest.dq)  # Warm-up.
        self._status.begin_motion(request.duration)
        self._status.set_phase("moving", "moving")
        events = self._build_events(driver, model, request) if request.events else None
        self._stream = MotionStream(rows, mode, model, self._status.on_cycle, events)
        try:
            self._move(driver, model, self._stream, "idle.arrived", mode)
        finally:
            self._shifts = tuple(self._stream.shifts[-MOST_SHIFTS:])
            self._stream = None

    def _build_events(self, driver: StreamingDriver, model: RobotModel, request: Execute) -> EventQueue:
        listener = SignalListener(self._status.set_output, self._status.await_input)
        return EventQueue(request.events, driver, capabilities_of(model).inputs, listener)

    def pop_shifts(self) -> tuple[Shift, ...]:
        """Returns where the last motion waited or left cycles out, once."""
        shifts, self._shifts = self._shifts, ()
        return shifts

    def jog(self, driver: StreamingDriver, model: RobotModel) -> None:
        """Moves the arm as long as the jog is renewed; returns once the arm is stationary.

        Raises:
            StoppedError: The jog was stopped on request.
            ControlError: The controller stopped the arm.
        """
        assert driver.latest is not None  # A connection begins with a state.
        self._jog = JogCallback(HeldJog(self._block), model, driver.latest.q_c)
        self._status.begin_motion(None)
        self._status.set_phase("moving", "moving.jog")
        try:
            self._move(driver, model, self._jog, "idle.jogged")
        finally:
            self._jog = None

    def _move(
        self,
        driver: StreamingDriver,
        model: RobotModel,
        callback: Callback,
        arrived: str,
        mode: Mode = "joint_position",
    ) -> None:
        """Runs a motion and reports why it ended."""
        self._is_stopping = False
        executor = MotionExecutor(driver, self._log, self._stop_reason, self._limits, on_stopping=self._report_stopping)
        try:
            with awake_cores():
                reason = executor.run(callback, mode, model)
        finally:
            self._status.end_motion()  # Before the phase changes, so that a reader sees the final time.
            gc.collect()
        set_phase = self._status.set_phase
        if reason is None:
            set_phase("idle", arrived)
            return
        if reason == "idle.operator":
            set_phase("idle", reason, seconds=OPERATOR_TIMEOUT)
        elif reason == HELD_TOO_LONG:
            set_phase("idle", "idle.held", seconds=LONGEST_PAUSE * CYCLE_TIME)
        else:
            set_phase("idle", "idle.stopped")
        raise StoppedError(self._status.snapshot.message)

    def _stop_reason(self, t: float) -> str | None:
        """Returns the reason to stop the motion, or None; called in every cycle."""
        reason = self._stop_conditions.reason_to_stop()
        if reason is None and self._requests.has_new:
            reason = self._handle_request()
        return reason

    def _report_stopping(self, reason: str) -> None:
        self._is_stopping = True
        self._status.set_phase("stopping", "stopping.operator" if reason == "idle.operator" else "stopping")

    def _handle_request(self) -> str | None:
        """Handles a request while the arm moves; returns the reason to stop the motion for it, or None."""
        request = self._requests.pop_new()
        if request is None:
            return None
        if isinstance(request.body, Stop | End):
            self._requests.defer(request)
            return "idle.stopped"
        if isinstance(request.body, SwitchRows) and self._stream is not None and not self._is_stopping:
            self._switch_rows(request, request.body, self._stream)
        elif self._jog is not None:  # The jog stops and ends; the request follows.
            self._requests.defer(request)
            self._jog.is_enabled = False
        else:
            self._requests.answer(request, UsageError("the arm is moving; stop it first, or wait until it has arrived"))
        return None

    def _switch_rows(self, request: NumberedRequest, switch: SwitchRows, stream: MotionStream) -> None:
        """Continues with other rows of the block."""
        rows = self._block.motion[switch.start : switch.start + switch.rows]
        if stream.switch(switch.first, rows, holds=switch.holds, events=switch.events):
            self._status.update(motion_duration=switch.duration)
            self._status.set_phase("moving", "moving.held" if switch.holds else "moving")
            self._requests.answer(request)
        else:
            self._requests.answer(request, UsageError("the change of the speed override arrived too late; try again"))


def _is_same(now: tuple[JointVector, Pose], before: tuple[JointVector, Pose]) -> bool:
    (q, T), (q_before, T_before) = now, before
    return (q is q_before or q.tobytes() == q_before.tobytes()) and (
        T is T_before or T.as_row_major() == T_before.as_row_major()
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the control process on an inherited shared block."""
    parser = argparse.ArgumentParser(prog="rcilab.control_process.worker", description=__doc__)
    parser.add_argument("--block", type=int, required=True, metavar="FD", help="open descriptor of the shared block")
    parser.add_argument("--parent", type=int, required=True, metavar="PID", help="end when this process ends")
    args = parser.parse_args(argv)
    process = ControlProcess(ControlBlock(args.block), args.parent)
    # Stops the arm first: VS Code sends SIGTERM to every process below a kernel before it ends the kernel.
    signal.signal(signal.SIGTERM, lambda *_: process.request_exit())
    return process.run()
