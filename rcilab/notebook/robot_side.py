"""The robot of a notebook: a control process of our own, or a session (see `session_robot`).

Both are asked and looked at in the same way, and neither makes anybody wait. What moves is brought to rest when the
kernel goes: the control process notices within 0.5 s, however the kernel ended.
"""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from numpy.typing import NDArray

from rcilab.client.control_settings import ControlSettings
from rcilab.client.setup import RobotSetup, SoftJointLimits
from rcilab.client.world import World
from rcilab.client.world_watch import WorldWatch
from rcilab.errors import RcilabError, UsageError
from rcilab.protocols.world import AutoLimit
from rcilab.recording.live import LiveRecording, RunFacts
from rcilab.recording.run import Run
from rcilab.recording.setup import Setup
from rcilab.supervisor import Supervisor, SupervisorStatus, Ticket
from rcilab.supervisor.supervisor import VIRTUAL

if TYPE_CHECKING:
    from rcilab.model import RobotModel
    from rcilab.motion import Motion
    from rcilab.posing.planning import Plan


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """What came of something that was asked for."""

    what: str
    """"execute", "cell", "pace", "control", "power_on", "power_off", "recover", "output", "inputs", "reboot",
    "limits", "auto_limit" or "connect"; cell: a motion of one."""
    run: Run | None = None
    error: RcilabError | None = None

    @property
    def record(self) -> NDArray[Any] | None:
        """The last cycles, as the flight recorder kept them; None where nothing moved."""
        record = getattr(self.error, "record", None)
        return record if record is not None else None if self.run is None else self.run.cycles


class BusyError(UsageError):
    """Something was asked of a robot while something else was under way.

    Attributes:
        under_way: What, as in `Outcome.what`.
    """

    def __init__(self, what: str, under_way: str) -> None:
        super().__init__(f"no {what} now: {under_way} is still under way; stop it, or wait")
        self.under_way = under_way


class RobotSide(Protocol):
    """What a notebook asks of a robot. No method waits for it."""

    name: str
    """Where it is."""
    is_virtual: bool
    """Whether nothing but numbers moves."""

    @property
    def auto_limit(self) -> bool:
        """Whether a virtual controller was told to lead commands to a standstill inside the soft joint limits."""
        ...

    def status(self) -> SupervisorStatus:
        """Returns how it stands."""
        ...

    def power(self, on: bool) -> None:
        """Switches motor power."""
        ...

    def recover(self) -> None:
        """Clears the controller's faults."""
        ...

    def execute(self, plan: Plan, pace: float = 1.0) -> None:
        """Streams a checked motion in the mode that it was judged for, at part of its planned speed.

        Raises:
            PlanningError: At this pace it would break a condition.
        """
        ...

    def set_control(self, control: ControlSettings) -> None:
        """Tells the controller parameters of the modes; what is acknowledged stands in the status.

        Raises:
            UsageError: The arm moves, or something else is under way.
        """
        ...

    def set_joint_limit(self, joints: SoftJointLimits) -> None:
        """Tells the controller soft limits of the joint angles."""
        ...

    def set_auto_limit(self, on: bool) -> None:
        """Has a virtual controller lead commands to a standstill inside these limits, or raise a fault beyond them."""
        ...

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output, 0 to 5, and reads the inputs; the status shows both."""
        ...

    def read_inputs(self) -> None:
        """Reads the digital inputs; the status shows them."""
        ...

    def reboot(self) -> None:
        """Restarts the controller; the connection ends with it."""
        ...

    def set_pace(self, pace: float) -> None:
        """Runs the motion under way at part of its planned speed; 0 holds it. An outcome tells when that is taken.

        Raises:
            PlanningError: There is no way within the limits to change from here; it goes on as it is.
            UsageError: No motion is under way, or this machine is too busy.
        """
        ...

    def stop(self) -> None:
        """Brings a running motion to rest; from any thread."""
        ...

    def beat(self) -> None:
        """Says that somebody is at the notebook."""
        ...

    def leave_alone(self) -> None:
        """Says that nobody is at the notebook any more: a running motion is brought to rest."""
        ...

    def outcomes(self) -> list[Outcome]:
        """Returns what has ended since the last call; to be called several times a second."""
        ...

    def close(self) -> None:
        """Brings a running motion to rest and ends what was started."""
        ...


class SupervisedRobot:
    """A control process of our own; it, and a virtual controller, end with this object.

    Args:
        model: The arm.
        target: "virtual", or the address of a controller, rci://HOST:PORT.
        plant: What a virtual controller moves: "ideal" or "mujoco".

    Raises:
        InvalidValueError: The address or the plant is none.
        ModelError: The arm does not speak the RCI.
    """

    def __init__(self, model: RobotModel, target: str = VIRTUAL, plant: str = "ideal") -> None:
        self.name = target
        self.is_virtual = target == VIRTUAL
        self._model, self._plant = model, plant
        self._supervisor = Supervisor(model, target, plant)
        self._watch: WorldWatch | None = None
        self._watched = ""  # Where the virtual controller is that was told of auto_limit.
        self._auto_limit = False
        self._tickets: list[tuple[str, Ticket]] = []
        self._done: list[Outcome] = []
        self._live: LiveRecording | None = None
        self._reader: Any = None
        self._opened = threading.Event()
        self._opener = threading.Thread(target=self._open, name="rcilab-notebook-open", daemon=True)
        self._opener.start()

    def status(self) -> SupervisorStatus:
        """Returns how it stands; "starting" until the processes are there."""
        if not self._opened.is_set() and self._opener.is_alive():
            return SupervisorStatus(phase="starting", code="starting", target=self.name)
        return self._supervisor.status()

    def power(self, on: bool) -> None:
        """Switches motor power."""
        act = self._supervisor.power_on if on else self._supervisor.power_off
        self._tickets.append(("power_on" if on else "power_off", act()))

    def recover(self) -> None:
        """Clears the controller's faults; where the connection is lost, makes a new one."""
        lost = self.status().phase in ("lost", "crashed")
        act = self._supervisor.reconnect if lost else self._supervisor.recover
        self._tickets.append(("recover", act()))

    def execute(self, plan: Plan, pace: float = 1.0) -> None:
        """Streams a checked motion; every cycle of it is kept."""
        certificate = plan.report.require().certificate
        assert certificate is not None  # A report that is ok has one.
        self._reader = self._supervisor.open_reader()
        self._reader.drain()
        setup = Setup(
            target=self.name,
            plant=self._plant if self.is_virtual else "",
            mode=plan.mode,
            started_ns=time.time_ns(),
        )
        self._live = LiveRecording(RunFacts(plan=plan.motion, model=self._model, setup=setup))
        self._tickets.append(("execute", self._supervisor.execute(plan.motion, certificate, plan.mode, pace=pace)))

    def set_control(self, control: ControlSettings) -> None:
        """Tells the controller parameters of the modes."""
        self._tickets.append(("control", self._supervisor.set_up(RobotSetup(control=control))))

    def set_joint_limit(self, joints: SoftJointLimits) -> None:
        """Tells the controller soft limits of the joint angles."""
        self._tickets.append(("limits", self._supervisor.set_up(RobotSetup(joints=joints))))

    @property
    def auto_limit(self) -> bool:
        """Whether the virtual controller of now was told so: another one starts without."""
        return self._auto_limit and self._watched == self.status().world_address

    def set_auto_limit(self, on: bool) -> None:
        """Has the virtual controller lead commands to a standstill inside the soft limits, or not."""
        address = self.status().world_address
        if address is None:
            raise UsageError("auto_limit can be set at a virtual controller only: a real one has its own settings")
        if self._watch is None or self._watched != address:
            self._end_watch()
            host, _, port = address.partition(":")
            self._watch, self._watched = WorldWatch(World(host, int(port))), address
        self._watch.ask(AutoLimit(on))
        self._auto_limit = on

    def _end_watch(self) -> None:
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output."""
        self._tickets.append(("output", self._supervisor.set_output(signal, level)))

    def read_inputs(self) -> None:
        """Reads the digital inputs."""
        self._tickets.append(("inputs", self._supervisor.read_inputs()))

    def reboot(self) -> None:
        """Restarts the controller; Recover makes another connection once it is up."""
        self._tickets.append(("reboot", self._supervisor.reboot()))

    def set_pace(self, pace: float) -> None:
        """Runs the motion under way at part of its planned speed; 0 holds it."""
        asked = self._supervisor.set_pace(pace) if pace else self._supervisor.pause()
        self._tickets.append(("pace", asked))

    def stop(self) -> None:
        """Brings a running motion to rest."""
        try:
            self._supervisor.stop()
        except RcilabError:  # Nothing is connected: nothing of ours moves.
            return

    def beat(self) -> None:
        """Says that somebody is at the notebook."""
        if self._opened.is_set():
            self._supervisor.set_operator_present(True)

    def leave_alone(self) -> None:
        """Brings a running motion to rest; without signs of life there is no other."""
        self.stop()

    def outcomes(self) -> list[Outcome]:
        """Returns what has ended since the last call, and keeps the cycles of what goes on."""
        if self._live is not None:
            self._live.add(self._reader.drain())
        done, self._done = self._done, []
        failed = None if self._watch is None else self._watch.take_error()
        if failed is not None:
            self._auto_limit = False
            done.append(Outcome(what="auto_limit", error=failed))
        for entry in list(self._tickets):
            what, ticket = entry
            if not ticket.done:
                continue
            self._tickets.remove(entry)
            run = None
            if what == "execute" and self._live is not None:
                live, self._live = self._live, None
                live.add(self._reader.drain())
                run = live.finish(None if ticket.error is None else str(ticket.error), self._paced())
            done.append(Outcome(what=what, run=run, error=ticket.error))
        return done

    def _paced(self) -> Motion | None:
        """Returns what was asked of the arm where the pace was changed on the way; None as planned."""
        with suppress(RcilabError):  # Its control process has gone.
            paced = self._supervisor.paced
            return paced.as_motion() if paced is not None and paced.changed else None
        return None

    def close(self) -> None:
        """Brings a running motion to rest and ends the processes."""
        self._opener.join()
        self._end_watch()
        self._supervisor.close()

    def _open(self) -> None:
        try:
            self._supervisor.start()
        except RcilabError as error:
            self._done.append(Outcome(what="connect", error=error))
            return
        self._opened.set()
