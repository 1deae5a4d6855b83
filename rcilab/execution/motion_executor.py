"""Execution of motions and callbacks over a driver, with the conditions that stop them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from rcilab.core.arrays import JointVector
from rcilab.core.limits import Limits
from rcilab.core.state import ControllerMode, Mode
from rcilab.execution.control_loop import STATE_TIMEOUT, Callback, ControlLoop, StopCheck
from rcilab.execution.filters import CommandFilter, RateLimiter
from rcilab.execution.motion_stream import MotionStream
from rcilab.execution.recorder import CycleLog
from rcilab.makers.driver import StreamingDriver

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel

LONGEST_PAUSE = 120_000  # Cycles for which a motion can be held: every one of them is recorded.
HELD_TOO_LONG = "held for more than 120 s"
"""Reason for the end of a motion that is held for `LONGEST_PAUSE`."""


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
