"""A session that the notebook has already, as one of the robots that its parts ask."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rcilab.client.commands import SIGNALS
from rcilab.client.control_settings import ControlSettings, give_control
from rcilab.client.setup import RobotSetup, SoftJointLimits
from rcilab.errors import ConnectionLostError, RcilabError, UsageError
from rcilab.notebook.page_watch import LEFT_ALONE
from rcilab.notebook.robot_side import BusyError, Outcome
from rcilab.supervisor import SupervisorStatus

if TYPE_CHECKING:
    from rcilab.client.session import RobotSession
    from rcilab.client.under_way import UnderWay
    from rcilab.posing.planning import Plan
    from rcilab.recording.run import Run

_FRESH = 0.04  # [s] A state that is younger is not asked for again.
_LOST_LOOK = 1.0  # [s] Between two looks at a connection that is lost.
_WAIT = 0.2  # [s] For a state that was asked for.
_POWER_LOOK = 1.0  # [s] Between two questions after motor power; the state does not tell it.


class SessionRobot:
    """A session that the notebook has: its motions run in the kernel. The session stays open when this ends.

    Args:
        session: From `connect` or `simulate`.
    """

    def __init__(self, session: RobotSession) -> None:
        self.name = session.address
        self._session = session
        self.is_virtual = _has_world(session)
        self._worker: threading.Thread | None = None
        self._what = ""
        self._done: list[Outcome] = []
        self._way: UnderWay | None = None  # Of the running or last motion.
        self._run: Run | None = None  # What came of the last one that was started here.
        self._is_cells = False
        self._deafen = session.hear_runs(self._hear_run)
        self._powered: bool | None = None
        self._held = RobotSetup()  # What it was told from here.
        self._inputs: tuple[bool, ...] | None = None
        self._outputs: tuple[bool | None, ...] = (None,) * len(SIGNALS)  # What was set from here.
        self.auto_limit = False
        self._power_seen = float("-inf")
        self._last = SupervisorStatus(phase="connecting", code="connecting", target=self.name)
        self._looked = float("-inf")

    def status(self) -> SupervisorStatus:
        """Returns how it stands, by a state of this moment; by the last one while another cell moves the arm."""
        age = time.monotonic() - self._looked
        if age > (_LOST_LOOK if self._last.phase == "lost" else _FRESH):
            self._last = self._look()
            self._looked = time.monotonic()
        return self._last

    @property
    def is_cells(self) -> bool:
        """Whether what moves was started by a cell."""
        return self._is_cells

    @property
    def planned(self) -> float:
        """Where the plan of the running or last motion ends, [s]; 0 where nobody knows."""
        return 0.0 if self._way is None else self._way.planned

    def _look(self) -> SupervisorStatus:
        if self._session.is_closed:
            self._is_cells = False
            return SupervisorStatus(phase="closed", code="closed", target=self.name)
        way, is_ours = self._session.under_way, self._is_busy and self._what == "execute"
        is_moving = way is not None or is_ours or self._session.is_moving
        self._is_cells = is_moving and not is_ours
        if self._is_cells and way is None:
            self._way = None  # Nobody knows how far a callback is.
        self._way = way = way or self._way
        try:
            state = self._session.state if is_moving else self._session.receive_state(_WAIT, max_age=_FRESH)
            if not is_moving:
                self._ask_power()
        except ConnectionLostError as error:
            return SupervisorStatus(phase="lost", code="lost.silent", message=str(error), target=self.name)
        except UsageError:  # A cell has just begun to move the arm, or closed the session.
            return self._last
        phase = "fault" if state.faults else "moving" if is_moving else "idle"
        is_held = phase == "moving" and way is not None and way.pace == 0.0
        return SupervisorStatus(
            phase=phase,
            code="moving.held" if is_held else phase,
            target=self.name,
            address=self.name,
            q=state.q,
            q_c=state.q_c,
            dq=state.dq,
            robot_mode=state.robot_mode,
            controller_mode=state.controller_mode,
            faults=state.faults,
            powered=self._powered,
            success_rate=state.success_rate,
            rate_hz=1000.0,
            message_id=state.message_id,
            setup=self._held,
            inputs=self._inputs,
            outputs=self._outputs,
            **_tell_way(way),
        )

    def power(self, on: bool) -> None:
        """Switches motor power."""
        self._do("power_on" if on else "power_off", self._session.power_on if on else self._session.power_off)

    def recover(self) -> None:
        """Clears the controller's faults."""
        self._do("recover", self._session.recover)

    def execute(self, plan: Plan, pace: float = 1.0) -> None:
        """Streams a checked motion in a thread of the kernel."""
        certificate = plan.report.require().certificate
        go, self._way = self._session.execute, None
        self._do("execute", lambda: go(plan.motion, certificate, mode=plan.mode, pace=pace))

    def set_control(self, control: ControlSettings) -> None:
        """Tells the controller parameters of the modes."""

        def tell() -> None:
            give_control(self._session, control)
            self._held = self._held.updated(RobotSetup(control=control))

        self._do("control", tell)

    def set_joint_limit(self, joints: SoftJointLimits) -> None:
        """Tells the controller soft limits of the joint angles."""

        def tell() -> None:
            self._session.set_joint_limit(joints.lower, joints.upper)
            self._held = self._held.updated(RobotSetup(joints=joints))

        self._do("limits", tell)

    def set_auto_limit(self, on: bool) -> None:
        """Has the virtual controller lead commands to a standstill inside the soft limits, or not."""

        def tell() -> None:
            self._session.world.set_auto_limit(on)
            self.auto_limit = on

        self._do("auto_limit", tell)

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output."""

        def tell() -> None:
            self._session.set_do(signal, level)
            self._outputs = (*self._outputs[:signal], level, *self._outputs[signal + 1 :])
            self._read()

        self._do("output", tell)

    def read_inputs(self) -> None:
        """Reads the digital inputs."""
        self._do("inputs", self._read)

    def reboot(self) -> None:
        """Restarts the controller, which closes the session."""
        self._do("reboot", self._session.reboot)

    def _read(self) -> None:
        self._inputs = tuple(self._session.get_di(signal) for signal in SIGNALS)

    def set_pace(self, pace: float) -> None:
        """Runs the motion under way at part of its planned speed; 0 holds it."""
        if pace:
            self._session.set_pace(pace)
        else:
            self._session.pause()
        self._done.append(Outcome(what="pace"))

    def stop(self) -> None:
        """Brings a running motion to rest, also one that a cell has started."""
        self._session.stop()

    def beat(self) -> None:
        """Does nothing: who looks after a session stops it by himself."""

    def leave_alone(self) -> None:
        """Brings a running motion to rest, whoever has started it."""
        self._session.stop(LEFT_ALONE)

    def outcomes(self) -> list[Outcome]:
        """Returns what has ended since the last call."""
        done, self._done = self._done, []
        return done

    def close(self) -> None:
        """Brings to rest what was started here; the session stays."""
        self._deafen()
        worker = self._worker
        if worker is not None and worker.is_alive():
            self._session.stop()
            worker.join()

    @property
    def _is_busy(self) -> bool:
        return self._worker is not None and self._worker.is_alive()

    def _do(self, what: str, act: Callable[[], object]) -> None:
        if self._is_busy:
            raise BusyError(what, self._what)

        def work() -> None:
            error: RcilabError | None = None
            try:
                act()
            except RcilabError as failure:
                error = failure
            self._power_seen = float("-inf")
            self._done.append(Outcome(what=what, run=self._run, error=error))

        self._what, self._run = what, None
        self._worker = threading.Thread(target=work, name="rcilab-notebook-robot", daemon=True)
        self._worker.start()

    def _hear_run(self, run: Run, error: BaseException | None) -> None:
        """In the thread that ran it, which does not wait for what is made of it."""
        if threading.current_thread() is self._worker:
            self._run = run
        elif len(run.cycles):
            self._done.append(Outcome(what="cell", run=run, error=error if isinstance(error, RcilabError) else None))

    def _ask_power(self) -> None:
        if time.monotonic() - self._power_seen > _POWER_LOOK and not self._is_busy:
            self._powered = self._session.motor_state()
            self._power_seen = time.monotonic()


def _tell_way(way: UnderWay | None) -> dict[str, Any]:
    if way is None:
        return {}
    names = {"motion_time": way.time, "motion_duration": way.duration, "motion_place": way.place}
    return {**names, "pace": way.pace, "mode": way.mode}


def _has_world(session: RobotSession) -> bool:
    try:
        return session.world is not None
    except UsageError:
        return False
