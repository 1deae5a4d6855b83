"""The robot that a session drives in this process, with the interface of `RobotConnection`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.app.status_text import StartingError
from rcilab.control_process import PendingRequest, SupervisorStatus
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import ConnectionLostError, RcilabError, UsageError
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.maker import capabilities_of, timing_of

if TYPE_CHECKING:
    from rcilab.conformance.certificate import Certificate
    from rcilab.core.state import Mode
    from rcilab.execution.motion_runner import MotionProgress
    from rcilab.execution.session import RobotSession
    from rcilab.motion.motion import Motion
    from rcilab.recording.run import Run

_FRESH = 0.04  # [s] A younger state is not requested again.
_LOST_LOOK = 1.0  # [s] Between two checks of a lost connection.
_WAIT = 0.2  # [s] Maximum wait for a requested state.
_POWER_LOOK = 1.0  # [s] Between two queries of motor power, which the state does not contain.


class BusyError(UsageError):
    """A request to a robot while another one is in progress.

    Attributes:
        in_progress: Name of that request.
    """

    def __init__(self, what: str, in_progress: str) -> None:
        super().__init__(f"no {what} now: {in_progress} is still in progress; stop it, or wait")
        self.in_progress = in_progress


class SessionConnection:
    """A session: its motions run in this process. It stays open after the end of this object.

    Args:
        session: From `connect` or `simulate`.
    """

    def __init__(self, session: RobotSession) -> None:
        self.name = session.address
        self._session = session
        self.is_virtual = _has_world(session)
        self._worker: threading.Thread | None = None
        self._what = ""
        self._cell_runs: list[tuple[Run, RcilabError | None]] = []
        self._no_cycles: NDArray[np.void] = np.zeros(0, cycle_dtype(session.model.n))
        self._progress: MotionProgress | None = None  # Of the running or last motion.
        self._run: Run | None = None  # The last motion that was started here.
        self._is_cells = False
        self._remove_listener = session.on_run(self._on_run)
        self._powered: bool | None = None
        self._held = RobotConfiguration()  # The configuration that was sent from here.
        self._inputs: tuple[bool, ...] | None = None
        outputs = len(capabilities_of(session.model).outputs)
        self._outputs: tuple[bool | None, ...] = (None,) * outputs  # Levels that were set from here; None: unknown.
        self._power_seen = float("-inf")
        self._last = SupervisorStatus(phase="connecting", code="connecting", target=self.name)
        self._looked = float("-inf")

    def status(self) -> SupervisorStatus:
        """Returns its status, from a new state; from the last one while another cell moves the arm."""
        age = time.monotonic() - self._looked
        if age > (_LOST_LOOK if self._last.phase == "lost" else _FRESH):
            self._last = self._look()
            self._looked = time.monotonic()
        return self._last

    @property
    def is_cells(self) -> bool:
        """Whether a cell has started the motion in progress."""
        return self._is_cells

    @property
    def planned(self) -> float:
        """Duration of the plan of the running or last motion, [s]; 0 if it is unknown."""
        return 0.0 if self._progress is None else self._progress.plan_duration

    def _look(self) -> SupervisorStatus:
        if self._session.is_closed:
            self._is_cells = False
            return SupervisorStatus(phase="closed", code="closed", target=self.name)
        way, is_ours = self._session.progress, self._is_busy and self._what == "execute"
        is_moving = way is not None or is_ours or self._session.is_moving
        self._is_cells = is_moving and not is_ours
        if self._is_cells and way is None:
            self._progress = None  # The progress of a callback is unknown.
        self._progress = way = way or self._progress
        try:
            state = self._session.state if is_moving else self._session.receive_state(_WAIT, max_age=_FRESH)
            if not is_moving:
                self._ask_power()
        except ConnectionLostError as error:
            return SupervisorStatus(phase="lost", code="lost.silent", message=str(error), target=self.name)
        except UsageError:  # A cell has just started a motion, or closed the session.
            return self._last
        phase = "fault" if state.faults else "moving" if is_moving else "idle"
        is_held = phase == "moving" and way is not None and way.speed_override == 0.0
        return SupervisorStatus(
            phase=phase,
            code="moving.held" if is_held else phase,
            target=self.name,
            address=self.name,
            world_address=self._session.world.address if self.is_virtual else None,
            q=state.q,
            q_c=state.q_c,
            dq=state.dq,
            robot_mode=state.robot_mode,
            controller_mode=state.controller_mode,
            faults=state.faults,
            powered=self._powered,
            success_rate=state.success_rate,
            rate_hz=1.0 / timing_of(self._session.model).state_period,
            message_id=state.message_id,
            setup=self._held,
            inputs=self._inputs,
            outputs=self._outputs,
            **_describe_progress(way),
        )

    def robot(self) -> SessionConnection:
        """Returns this object, which takes the requests itself."""
        return self

    @property
    def scaled_motion(self) -> None:
        """None: the run of a session holds the executed motion."""

    def drain(self) -> NDArray[np.void]:
        """Returns no cycles: a session records its runs itself."""
        return self._no_cycles

    def take_run(self) -> Run | None:
        """Returns the run of the last `execute`; None if the arm did not move."""
        run, self._run = self._run, None
        return run

    def take_cell_runs(self) -> list[tuple[Run, RcilabError | None]]:
        """Returns the runs of cells since the last call, and why each did not reach its end."""
        runs, self._cell_runs = self._cell_runs, []
        return runs

    def power_on(self) -> PendingRequest:
        """Switches motor power on."""
        return self._do("power_on", self._session.power_on)

    def power_off(self) -> PendingRequest:
        """Switches motor power off."""
        return self._do("power_off", self._session.power_off)

    def recover(self) -> PendingRequest:
        """Clears the controller's faults."""
        return self._do("recover", self._session.recover)

    def execute(
        self,
        motion: Motion,
        certificate: Certificate,
        mode: Mode = "joint_position",
        *,
        speed_override: float = 1.0,
        stops: int | None = None,
    ) -> PendingRequest:
        """Streams a checked motion in a thread of the kernel.

        Args:
            motion: The motion.
            certificate: From `check(motion, model, mode=mode).certificate`.
            mode: How the arm is commanded.
            speed_override: Speed override, 0.1 to 1.
            stops: Not used here.
        """
        self._progress = None
        return self._do(
            "execute", lambda: self._session.execute(motion, certificate, mode=mode, speed_override=speed_override)
        )

    def configure(self, setup: RobotConfiguration) -> PendingRequest:
        """Sends limits or parameters to the controller."""
        if self._is_busy and self.is_virtual:
            raise StartingError(f"{self._what} is in progress; try again in a moment")

        def send() -> None:
            self._session.configure(setup)
            self._held = self._held.updated(setup)
            self._looked = float("-inf")  # Acknowledged values are not sent again.

        return self._do("control", send)

    def set_output(self, signal: int, level: bool) -> PendingRequest:
        """Sets a digital output, and reads the inputs."""

        def send() -> None:
            self._session.set_output(signal, level)
            self._outputs = (*self._outputs[:signal], level, *self._outputs[signal + 1 :])
            self._read()

        return self._do("output", send)

    def read_inputs(self) -> PendingRequest:
        """Reads the digital inputs."""
        return self._do("inputs", self._read)

    def reboot(self) -> PendingRequest:
        """Restarts the controller, which closes the session."""
        return self._do("reboot", self._session.reboot)

    def set_speed_override(self, speed_override: float) -> PendingRequest:
        """Sets the speed override of the motion in progress."""
        self._session.set_speed_override(speed_override)
        return _settled("speed_override")

    def pause(self) -> PendingRequest:
        """Pauses the motion in progress."""
        self._session.pause()
        return _settled("pause")

    def stop(self, reason: str | None = None) -> None:
        """Stops a motion in progress, also that of a cell; from any thread, without waiting."""
        self._session.stop(*(() if reason is None else (reason,)))

    def heartbeat(self) -> None:
        """Does nothing: the operator of a session stops it directly."""

    def close(self) -> None:
        """Stops a motion that was started here; the session stays open."""
        self._remove_listener()
        worker = self._worker
        if worker is not None and worker.is_alive():
            self._session.stop()
            worker.join()

    def _read(self) -> None:
        count = len(capabilities_of(self._session.model).inputs)
        self._inputs = tuple(self._session.read_input(signal) for signal in range(count))

    @property
    def _is_busy(self) -> bool:
        return self._worker is not None and self._worker.is_alive()

    def _do(self, what: str, act: Callable[[], object]) -> PendingRequest:
        if self._is_busy:
            raise BusyError(what, self._what)
        request = PendingRequest(what)

        def work() -> None:
            error: RcilabError | None = None
            try:
                act()
            except RcilabError as failure:
                error = failure
            self._power_seen = float("-inf")
            request.settle(error)

        self._what, self._run = what, None
        self._worker = threading.Thread(target=work, name="rcilab-notebook-robot", daemon=True)
        self._worker.start()
        return request

    def _on_run(self, run: Run, error: BaseException | None) -> None:
        """Keeps a run; called in the thread of the run."""
        if threading.current_thread() is self._worker:
            self._run = run
        elif len(run.cycles):
            self._cell_runs.append((run, error if isinstance(error, RcilabError) else None))

    def _ask_power(self) -> None:
        if time.monotonic() - self._power_seen > _POWER_LOOK and not self._is_busy:
            self._powered = self._session.is_powered()
            self._power_seen = time.monotonic()


def _settled(what: str) -> PendingRequest:
    request = PendingRequest(what)
    request.settle()
    return request


def _describe_progress(way: MotionProgress | None) -> dict[str, Any]:
    if way is None:
        return {}
    names = {"motion_time": way.time, "motion_duration": way.duration, "motion_plan_time": way.plan_time}
    return {**names, "speed_override": way.speed_override, "mode": way.mode}


def _has_world(session: RobotSession) -> bool:
    try:
        return session.world is not None
    except UsageError:
        return False
