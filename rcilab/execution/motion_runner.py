"""Execution of motions on a connection: their recorded runs, their progress, and paths of the tool as callbacks."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, CommandFilter
from rcilab.core.cycle_recorder import RECORD_TIME, Recorder
from rcilab.core.errors import RecordedError
from rcilab.core.state import Mode, RobotState
from rcilab.execution.control_loop import Callback
from rcilab.execution.motion_executor import MotionExecutor, MotionStream
from rcilab.execution.recorder import CycleLog
from rcilab.execution.session_lock import SessionLock
from rcilab.execution.speed_override import SpeedOverride
from rcilab.makers.driver import ConfiguredArm, StreamingDriver
from rcilab.makers.maker import timing_of
from rcilab.realtime.cpu_affinity import one_core
from rcilab.realtime.scheduling import loop_priority, realtime_section
from rcilab.recording.run import Run, build_run, describe_end
from rcilab.recording.run_setup import Setup

if TYPE_CHECKING:
    from rcilab.motion import Motion
    from rcilab.motion.path import Path

RunListener: TypeAlias = Callable[[Run, BaseException | None], None]
"""Called with the run of a motion and the error that ended it, or None."""

_SPARE_CYCLES = 2000  # Additional rows of the recorder, for the cycles before and after the motion.

Progress: TypeAlias = Callable[[float, float], None]
"""`(t, duration)`, both [s]; called about 20 times a second from inside the loop, so it must be quick."""

_PROGRESS_CYCLES = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionProgress:
    """Progress of the motion that `RobotSession.execute` is streaming; see `RobotSession.progress`."""

    time: float
    """Time since its first command, [s]."""
    duration: float
    """Its duration with the present speed override, [s]; of a held motion, until standstill."""
    plan_time: float
    """Time in its plan, [s]; less than `time` if it ran slower or was held."""
    plan_duration: float
    """Duration of its plan, [s]."""
    speed_override: float
    """Present or requested speed override, from 0 (held) to 1."""
    mode: Mode
    """Command mode."""

    def __repr__(self) -> str:
        percent = 100.0 * self.speed_override
        return f"<MotionProgress: at {self.plan_time:.3f} s of the plan, {percent:.0f} % of its speed, {self.mode}>"


class MotionRunner:
    """Runs motions on a connection, one at a time, and reports each to its listeners.

    Attributes:
        partner: Process id of a controller on this machine that is in lock-step with us; None: it is not.

    Args:
        driver: The connection.
        lock: The lock of the connection.
        arm: The configuration of the robot.
        realtime: False for a controller in lock-step, which has no timing.
        state_timeout: Time without a state, while moving, that counts as a lost connection, [s].
        partner: See above.
        record_all: Whether runs store every field of the state.
    """

    def __init__(
        self,
        driver: StreamingDriver,
        lock: SessionLock,
        arm: ConfiguredArm,
        *,
        realtime: bool,
        state_timeout: float,
        partner: int | None,
        record_all: bool,
    ) -> None:
        self.partner = partner
        self._driver = driver
        self._lock = lock
        self._arm = arm
        self._realtime = realtime
        self._state_timeout = state_timeout
        self._record_all = record_all
        self._listeners: tuple[RunListener, ...] = ()

    def on_run(self, listener: RunListener) -> Callable[[], None]:
        """Adds a listener that is called after every motion; returns the function that removes it.

        Args:
            listener: Called in the thread that ran the motion, with its run and the error that ended it, or None.
        """
        self._listeners = (*self._listeners, listener)

        def remove() -> None:
            self._listeners = tuple(other for other in self._listeners if other is not listener)

        return remove

    def run(
        self,
        callback: Callback,
        mode: Mode,
        plan: Motion | None = None,
        filters: Sequence[CommandFilter] = (),
        override: SpeedOverride[bool] | None = None,
    ) -> Run:
        """Runs a motion and returns its run.

        Args:
            callback: Returns the command for each state.
            mode: Command mode.
            plan: The planned motion; None for a callback without one.
            filters: Filters of every command.
            override: Changes the plan while it runs.

        Raises:
            ControlError: The controller stopped it.
            ConnectionLostError: The connection to the controller is lost.
            Exception: An exception of the callback; the arm was stopped.
        """
        model = self._arm.model
        timing = timing_of(model)
        time_needed = RECORD_TIME + (0.0 if plan is None else plan.duration)  # The motion may be held.
        capacity = math.ceil(time_needed / CYCLE_TIME) + _SPARE_CYCLES
        recorder = Recorder(model.n, capacity, complete=self._record_all)
        executor = MotionExecutor(
            self._driver,
            CycleLog(recorder, state_cycles=timing.state_cycles),
            self._lock.reason_to_stop,
            model.limits,
            state_timeout=self._state_timeout,
        )
        setup = Setup(target=self._driver.name, mode=mode, started_ns=time.time_ns())

        def report(stopped: str | None, error: BaseException | None = None) -> Run:
            scaled = None if override is None else override.motion
            if scaled is not None and isinstance(callback, MotionStream):
                scaled = scaled.shifted(callback.shifts)
            run = build_run(
                recorder.rows(),
                plan=plan if scaled is None else scaled.as_motion(),
                has_speed_override=scaled is not None and scaled.changed > 0,
                stopped=stopped,
                truncated=recorder.truncated,
                realtime=self._realtime,
                model=model,
                setup=setup,
                cell=self._arm.cell,
            )
            for listener in self._listeners:
                listener(run, error)
            return run

        try:
            priority = loop_priority(timing.command_cycles)
            with self._lock.move(), realtime_section(self._realtime, priority), one_core(self.partner):
                stopped = executor.run(
                    callback,
                    mode,
                    model,
                    filters,
                    box=self._arm.safety_box,
                    collision_thresholds=self._arm.collision_thresholds,
                )
        except BaseException as error:
            if self._listeners or isinstance(error, RecordedError):
                run = report(describe_end(error), error)
                if isinstance(error, RecordedError):
                    error.run = run
            raise
        return report(stopped)


def follow_poses(path: Path, shares: Array, with_psi: bool, on_cycle: Callable[[int], None] | None = None) -> Callback:
    """Returns the callback that streams a path of the tool: the pose at share k in controller cycle k.

    Args:
        path: The path.
        shares: From 0 to 1, shape (N,).
        with_psi: Whether to send the arm angle; if not, the controller holds its own.
        on_cycle: Called with the number of every cycle.
    """
    last = len(shares) - 1

    def callback(state: RobotState, t: float) -> CartesianPosition:
        cycle = min(round(t / CYCLE_TIME), last)
        if on_cycle is not None:
            on_cycle(cycle)
        pose, psi = path.at(float(shares[cycle]))
        return CartesianPosition(pose.matrix, psi if with_psi else None, finished=cycle == last)

    return callback


def report_progress(motion: Motion, progress: Progress | None) -> Callable[[int], None] | None:
    """Returns a function that reports the progress about 20 times a second and at the end, or None."""
    if progress is None:
        return None
    last = len(motion.q) - 1

    def report(cycle: int) -> None:
        if cycle % _PROGRESS_CYCLES == 0 or cycle == last:
            progress(min(cycle * CYCLE_TIME, motion.duration), motion.duration)

    return report
