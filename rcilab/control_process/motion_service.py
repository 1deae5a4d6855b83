"""Motions in the control process: planned rows or a jog, and the requests that arrive meanwhile."""

from __future__ import annotations

import gc

from rcilab.control_process.jog_record import HeldJog
from rcilab.control_process.layout import OPERATOR_TIMEOUT, ControlBlock
from rcilab.control_process.messages import End, Execute, NumberedRequest, Stop, SwitchRows
from rcilab.control_process.requests import RequestChannel
from rcilab.control_process.status_writer import StatusWriter
from rcilab.control_process.stop_conditions import StopConditions
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ControlError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.state import Mode
from rcilab.execution.control_loop import Callback
from rcilab.execution.jog import JogCallback
from rcilab.execution.motion_executor import HELD_TOO_LONG, LONGEST_PAUSE, MotionExecutor
from rcilab.execution.motion_stream import MotionStream
from rcilab.execution.recorder import CycleLog
from rcilab.execution.start_pose_check import describe_start_mismatch
from rcilab.makers.driver import StreamingDriver
from rcilab.model.robot_model import RobotModel
from rcilab.realtime.cpu_latency import awake_cores


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
            mismatch = describe_start_mismatch(rows[0], driver.latest.q_c)
            if mismatch is not None:
                raise UsageError(mismatch).coded("elsewhere")
            model.rigid_body.motion_torque(driver.latest.q, driver.latest.dq, driver.latest.dq)  # Warm-up.
        self._status.begin_motion(request.duration)
        self._status.set_phase("moving", "moving")
        self._stream = MotionStream(rows, mode, model, self._status.on_cycle)
        try:
            self._move(driver, model, self._stream, "idle.arrived", mode)
        finally:
            self._stream = None

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
        if stream.switch(switch.first, rows, holds=switch.holds):
            self._status.update(motion_duration=switch.duration)
            self._status.set_phase("moving", "moving.held" if switch.holds else "moving")
            self._requests.answer(request)
        else:
            self._requests.answer(request, UsageError("the change of the speed override arrived too late; try again"))
