"""One motion on a connection from StartMove to what became of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.state import ControllerMode, Mode
from rcilab.execution.control_loop import Callback, ControlLoop
from rcilab.execution.filters import CommandFilter
from rcilab.execution.recorder import RECORD_TIME, CycleLog, Recorder
from rcilab.execution.session_lock import SessionLock
from rcilab.execution.speed_scaled_stream import SpeedScaledStream
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.realtime.cpu_affinity import one_core
from rcilab.realtime.punctual import punctual
from rcilab.recording.run import Run, build_run
from rcilab.recording.setup import Setup

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion

Ear: TypeAlias = Callable[[Run, BaseException | None], None]

_SPARE_CYCLES = 2000  # Room in the recorder for what comes before and after the motion itself.


class MotionRunner:
    """Runs motions on a connection, one at a time, and tells who listens what became of each.

    Attributes:
        partner: Process id of a controller on this machine that is in lock-step with us; None: it is not.
        collision_thresholds: Those that were set, shape (n,), [N m]; None as long as none were.

    Args:
        link: The connection.
        turns: Whose turn it is on it.
        realtime: False for a controller in lock-step, where timing means nothing.
        silence: Time without a state, while moving, that counts as a lost connection, [s].
        partner: See above.
        record_all: Whether everything that the state has is recorded.
    """

    def __init__(
        self,
        link: RciConnection,
        turns: SessionLock,
        *,
        realtime: bool,
        silence: float,
        partner: int | None,
        record_all: bool,
    ) -> None:
        self.partner = partner
        self.collision_thresholds: JointVector | None = None
        self._link = link
        self._turns = turns
        self._realtime = realtime
        self._silence = silence
        self._record_all = record_all
        self._ears: tuple[Ear, ...] = ()

    def hear(self, ear: Ear) -> Callable[[], None]:
        """Has somebody told of every motion, as soon as it has ended; returns what ends that.

        Args:
            ear: Called in the thread that ran the motion, with its run and the error that ended it, or None.
        """
        self._ears = (*self._ears, ear)

        def end() -> None:
            self._ears = tuple(other for other in self._ears if other is not ear)

        return end

    def run(
        self,
        callback: Callback,
        mode: Mode,
        model: RobotModel,
        plan: Motion | SpeedScaledStream | None = None,
        filters: Sequence[CommandFilter] = (),
        *,
        box: SafetyBox | None = None,
    ) -> Run:
        """Runs the motion that has set out, and returns what became of it.

        Args:
            callback: Gives the command for each state.
            mode: How the arm is commanded.
            model: The arm.
            plan: What is to be commanded, and may change on the way; None where only the callback knows.
            filters: What every command passes before it is sent.
            box: The safety box that the controller has, as far as it is known: to say what passed which face of it.

        Raises:
            ControlError: The controller stopped it.
            ConnectionLostError: The controller is gone.
            Exception: Whatever the callback raised; the arm was brought to rest.
        """
        time_needed = RECORD_TIME + (0.0 if plan is None else plan.duration)  # It may be held on its way.
        capacity = math.ceil(time_needed / CYCLE_TIME) + _SPARE_CYCLES
        recorder = Recorder(model.n, capacity, complete=self._record_all)
        loop = ControlLoop(
            self._link,
            RciCommands(self._link),  # Not the session's own: those are refused while a motion runs.
            model.limits,
            ControllerMode[mode.upper()],
            CycleLog(recorder),
            watch=self._turns.reason_to_stop,
            silence=self._silence,
            model=model,
            filters=filters,
            box=box,
            collision_thresholds=self.collision_thresholds,
        )
        setup = Setup(target=self._link.name, mode=mode, started_ns=time.time_ns())

        def tell(stopped: str | None, error: BaseException | None = None) -> Run:
            run = build_run(
                recorder.rows(),
                plan=plan.as_motion() if isinstance(plan, SpeedScaledStream) else plan,
                paced=isinstance(plan, SpeedScaledStream) and plan.is_paced,
                stopped=stopped,
                truncated=recorder.truncated,
                realtime=self._realtime,
                model=model,
                setup=setup,
            )
            for ear in self._ears:
                ear(run, error)
            return run

        try:
            with self._turns.move(), punctual(self._realtime), one_core(self.partner):
                stopped = loop.run(callback)
        except BaseException as error:
            if self._ears:
                tell(str(error) or type(error).__name__, error)
            raise
        return tell(stopped)
