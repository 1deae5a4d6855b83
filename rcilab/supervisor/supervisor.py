"""The supervisor: the face of the control process to the rest of the program."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.client.address import parse_address
from rcilab.client.setup import RobotSetup, require_setup
from rcilab.closing import Closing
from rcilab.errors import ConnectionLostError, RcilabError, UsageError
from rcilab.supervisor.admission import require_admissible, require_ready
from rcilab.supervisor.guiding import GuideKind, GuideSpace, require_guidable
from rcilab.supervisor.jog_command import JogKind, build_jog, hold_jog, release_jog
from rcilab.supervisor.keeper import ANSWER_TIMEOUT, ProcessKeeper
from rcilab.supervisor.launch import require_plant
from rcilab.supervisor.layout import OPERATOR_TIMEOUT, ControlBlock, Word
from rcilab.supervisor.ring import RingReader
from rcilab.supervisor.settings import build_settings
from rcilab.supervisor.setup_desk import SetupDesk, standard_setup
from rcilab.supervisor.setup_letter import pack_setup
from rcilab.supervisor.snapshot import Snapshot
from rcilab.supervisor.status import MESSAGES, Incident, Phase, SupervisorStatus
from rcilab.supervisor.status_reader import StatusReader
from rcilab.supervisor.ticket import Ticket
from rcilab.supervisor.ticket_desk import TicketDesk

if TYPE_CHECKING:
    from rcilab.conformance import Certificate
    from rcilab.model import RobotModel
    from rcilab.motion import Motion

__all__ = ["Supervisor", "Ticket"]

VIRTUAL = "virtual"
_TICK = 0.02  # [s] between two looks of the watching thread.


class Supervisor(Closing):
    """Runs motions in a process of its own, so that nothing the page does can disturb a cycle.

    All methods may be called from any thread. Requests return a `Ticket` at once; nothing here waits for the robot
    except `start()`, `restart()` and `close()`. The processes belong to a `ProcessKeeper`, the requests under way to a
    `TicketDesk`; a thread of this object looks after both.

    Args:
        model: The arm.
        target: "virtual" for a private virtual controller on loopback, or the address of a controller, rci://HOST:PORT.
        plant: What the virtual controller moves: "ideal" or "mujoco".
        stop_without_operator: Whether a motion is brought to rest once nobody has been at the controls for 2 s (see
            `set_operator_present`). False lets it finish; meant for the virtual controller.
        auto_restart: Whether a process of ours that died is started again by itself (at most 3 times a minute).
        setup: What the controller is told at every connection. None: the virtual one the model's tool and load, a
            real one nothing, since it has its own.

    Raises:
        InvalidValueError: The target is no address, the model no model, or the plant unknown.
    """

    def __init__(
        self,
        model: RobotModel,
        target: str = VIRTUAL,
        plant: str = "ideal",
        *,
        stop_without_operator: bool = True,
        auto_restart: bool = True,
        setup: RobotSetup | None = None,
    ) -> None:
        from rcilab.model import require_model, require_rci

        self.model = require_rci(require_model(model))
        require_plant(plant)
        self._target = VIRTUAL if target == VIRTUAL else str(parse_address(target))
        if setup is None:
            setup = standard_setup(self.model, is_virtual=self._target == VIRTUAL)
        self.model = require_setup(setup).applied_to(self.model)
        self._setup = SetupDesk(setup)
        self._plant = plant
        self._stop_without_operator = stop_without_operator
        self._auto_restart = auto_restart
        self._lock = threading.RLock()  # Guards everything below; held for long only while our processes are ended.
        self._block: ControlBlock | None = None  # With it come and go the keeper, the desk and the readers.
        self._connecting: Ticket | None = None
        self._jogging: Ticket | None = None
        self._crash: tuple[str, str] | None = None
        self._incident: Incident | None = None
        self._watcher: threading.Thread | None = None
        self._is_closing = threading.Event()

    def start(self, timeout: float = 20.0) -> None:
        """Starts the processes and returns once states arrive or it is clear that they will not.

        An unreachable robot is no error here: the phase is then "lost" and `reconnect()` tries again.

        Args:
            timeout: How long to wait, [s].

        Raises:
            ConnectionLostError: A process of ours could not be started; the message carries what it said.
            UsageError: It was started before.
        """
        with self._lock:
            if self._block is not None:
                raise UsageError("the supervisor has been started already; use restart(), or make a new one")
            self._open()
            self._watcher = threading.Thread(target=self._watch, name="rcilab-supervisor", daemon=True)
            self._watcher.start()
        try:
            self._await_connection(timeout)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Brings a running motion to rest, ends our processes and frees the shared memory. May be called twice."""
        self._is_closing.set()
        watcher, self._watcher = self._watcher, None
        if watcher is not None and watcher is not threading.current_thread():
            watcher.join()
        with self._lock:
            if self._block is not None:
                self._end_processes(ConnectionLostError("the supervisor was closed"))
                self._block.close()
                self._block = None

    def restart(self, timeout: float = 20.0) -> None:
        """Ends and starts our processes again, whatever state they are in, and returns once states arrive.

        Args:
            timeout: How long to wait, [s].

        Raises:
            ConnectionLostError: A process of ours could not be started; the message carries what it said.
            UsageError: It was never started.
        """
        with self._lock:
            self._require_block()
            self._end_processes(ConnectionLostError("the control process was restarted"))
            self._keeper.launch()
        self._await_connection(timeout)

    def status(self) -> SupervisorStatus:
        """Returns a snapshot; cheap enough to be taken at the display's rate."""
        with self._lock:
            if self._block is None:
                return SupervisorStatus(target=self._target, incident=self._incident)
            shown = self._reader.read_snapshot()
            phase, code, message = self._judge(shown)
            fields = self._reader.read_fields(shown)
            if phase in ("crashed", "lost", "starting"):
                fields |= {"rate_hz": 0.0, "robot_mode": None, "controller_mode": None}  # Nobody says so any more.
            return SupervisorStatus(
                phase=phase,
                code=code,
                message=message,
                incident=self._incident,
                target=self._target,
                address=self._keeper.address,
                world_address=self._keeper.world_address,
                controller_pid=self._keeper.controller_pid,
                worker_pid=self._keeper.worker_pid,
                setup=self._setup.acknowledged,
                setup_times=self._setup.times,
                **fields,
            )

    def power_on(self) -> Ticket:
        """Asks for motor power."""
        return self._ask("power on", kind="power", on=True)

    def power_off(self) -> Ticket:
        """Asks for motor power to be taken away."""
        return self._ask("power off", kind="power", on=False)

    def execute(self, motion: Motion, certificate: Certificate) -> Ticket:
        """Streams a checked motion; the ticket is done when the arm stands still again.

        Args:
            motion: The motion.
            certificate: From `check(motion, model).certificate`.

        Raises:
            CertificateError: The certificate is missing, or does not fit the motion, the model, or where the arm is.
            UsageError: The arm is moving, no controller is connected, nobody is at the controls, the motion takes more
                than 300 s, or the controller has not taken the set-up it was told last.
        """
        require_admissible(
            motion,
            certificate,
            self.model,
            self.status(),
            is_operator_overdue=self._is_operator_overdue(),
            box=self._setup.wanted.box,
        )
        rows = motion.q
        with self._lock:
            block = self._require_block()
            self._setup.require_given()
            block.motion[: len(rows)] = rows
            return self._ask("execute", kind="execute", rows=len(rows), duration=motion.duration)

    def jog(self, kind: JogKind, values: ArrayLike, *, goes_on: Ticket | None = None) -> Ticket:
        """Moves the arm as long as it is held: call it at least five times a second, and `release_jog` at the end.

        The first call begins a jog, the next ones go on with it, whatever direction they ask for: on-line re-planning
        inside every limit of the joints. A jog that is not renewed for 0.3 s comes to rest. It is a motion like any
        other, so the first movement comes when the controller shows its mode, 0.2 to 1 s after the first call; at rest
        it listens for another second.

        Args:
            kind: "joint", or "base" or "tool" for a twist of the tool in these axes.
            values: n joint velocities, [rad/s], or a twist of six numbers, linear first, [m/s, rad/s]; lowered to
                what the limits allow.
            goes_on: Ticket of the jog to go on with: where that has ended meanwhile, as by `stop`, none is begun.

        Returns:
            The ticket of the jog; it is done when the arm stands still and nobody jogs any more.

        Raises:
            InvalidValueError: The kind is unknown, or the values are not as many finite numbers as it needs.
            UsageError: Another motion is under way, no controller is connected, or nobody is at the controls.
        """
        command = build_jog(kind, values, self.model.n)
        with self._lock:
            block = self._require_block()
            is_under_way = self._jogging is not None and not self._jogging.done
            if goes_on is not None and goes_on.done:
                raise UsageError("this jog has ended; begin another one")
            if not is_under_way:
                self._setup.require_given()
                require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            hold_jog(block.jog, block.words, command)
            if self._jogging is None or not is_under_way:
                self._jogging = self._ask("jog", kind="jog")
            return self._jogging

    def release_jog(self) -> None:
        """Brings a jog to rest at once."""
        with self._lock:
            if self._block is not None:
                release_jog(self._block.words)

    def start_guiding(self, space: GuideSpace = "joint", kind: GuideKind = "free") -> Ticket:
        """Frees the arm for a hand to guide it (startDrag), until `stop_guiding` or `stop`; done once it is free.

        The phase is "moving" meanwhile and the code "moving.guided". It ends like a motion when nobody is at the
        controls any more, and by itself when the controller leaves it, as on a fault.

        Args:
            space: In joint space every joint is free, and `kind` has no effect.
            kind: What stays free in Cartesian space.

        Raises:
            InvalidValueError: There is no such space or kind.
            UsageError: The arm is moving, no controller is connected, or nobody is at the controls.
        """
        require_guidable(space, kind)
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            self._setup.require_given()
            return self._ask("start guiding", kind="start_guiding", space=space, type=kind)

    def stop_guiding(self) -> Ticket:
        """Ends hand guiding (stopDrag); done once the arm stands still."""
        return self._ask("stop guiding", kind="stop_guiding")

    def stop(self) -> Ticket:
        """Brings a running motion to rest within the limits, or ends guiding; done when the arm stands still."""
        with self._lock:
            block = self._require_block()
            release_jog(block.words)
            block.words[Word.STOPS_ASKED] += 1
            return self._ask("stop", kind="stop", number=block.words[Word.STOPS_ASKED])

    def set_up(self, setup: RobotSetup) -> Ticket:
        """Tells the controller a tool, a load, a safety box, a force-control frame; done once it has taken all of it.

        From now on motions are checked with it, and it is told again at every new connection.

        Args:
            setup: What to tell; parts that are None stay.

        Raises:
            InvalidValueError: It is no set-up, or the load is heavier than the arm is rated for.
            UsageError: The arm is moving, or no controller is connected.
        """
        model = require_setup(setup).applied_to(self.model)
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            ticket = self._ask("set up", kind="set_up", setup=pack_setup(setup))
            self._setup.follow(ticket, setup)
            self.model = model
            return ticket

    def recover(self) -> Ticket:
        """Asks the controller to clear its faults (automatic error recovery)."""
        return self._ask("recover", kind="recover")

    def reconnect(self) -> Ticket:
        """Drops the connection to the controller and makes a new one.

        Raises:
            UsageError: There is no controller to connect to: the virtual one has died; `restart()` starts it again.
        """
        with self._lock:
            self._require_block()
            address = self._keeper.address
            if address is None:
                raise UsageError("there is no controller to connect to; restart() starts the virtual one again")
            letter = self._setup.letter()
            ticket = self._ask("reconnect", kind="connect", address=address, timeout=ANSWER_TIMEOUT, setup=letter)
            self._setup.follow(ticket, self._setup.wanted, is_new_connection=True)
            return ticket

    def set_operator_present(self, present: bool) -> None:
        """Tells that somebody is at the controls; call with True at least once a second while that is so.

        Until the first call nobody is expected. From then on, a motion is brought to rest when the last True is more
        than 2 s ago (`stop_without_operator`), and `execute` is refused meanwhile. False changes nothing at once: a
        page that is reloaded has those 2 s to come back.
        """
        with self._lock:
            if self._block is None or not self._stop_without_operator:
                return
            words = self._block.words
            if present or words[Word.OPERATOR_BEAT] == 0:
                words[Word.OPERATOR_BEAT] = time.monotonic_ns()

    def drain(self) -> NDArray[np.void]:
        """Returns every cycle recorded since the last call, oldest first.

        Returns:
            Structured array, see `cycle_dtype`: message_id, t, q, q_c, dq, command, faults, ... Cycles that were
            overwritten because nobody drained for more than 30 s are missing; `lost` of the first row counts them.
        """
        with self._lock:
            self._require_block()
            return self._ring.drain()

    def open_reader(self) -> RingReader:
        """Returns a reader of the recorded cycles with a place of its own, beside `drain`; good until `close`."""
        with self._lock:
            return RingReader(self._require_block())

    def __enter__(self) -> Supervisor:
        self.start()
        return self

    def _ask(self, what: str, **letter: Any) -> Ticket:
        with self._lock:
            self._require_block()
            if self._keeper.worker_pid is None:
                raise UsageError(f"the control process is not running; restart() starts it again (asked: {what})")
            return self._desk.send(what, letter)

    def _open(self) -> None:
        """Makes the shared block and what works on it, and starts the processes."""
        block = ControlBlock.create(self.model.n, build_settings(self.model))
        address = None if self._target == VIRTUAL else self._target
        self._keeper = ProcessKeeper(block, self.model.name, self._plant, address, auto_restart=self._auto_restart)
        self._desk = TicketDesk(block)
        self._reader, self._ring = StatusReader(block), RingReader(block)
        self._is_closing.clear()
        self._block = block
        try:
            self._keeper.launch()
        except BaseException:
            self.close()
            raise

    def _await_connection(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while (status := self.status()).phase in ("starting", "connecting"):
            if time.monotonic() > deadline:
                raise ConnectionLostError(
                    f"not ready after {timeout:g} s ({status.message}); try again when the machine is less busy"
                )
            time.sleep(_TICK / 2)
        if status.phase == "crashed":
            raise ConnectionLostError(status.message)

    def _watch(self) -> None:
        """The watching thread: signs of life, replies, deaths. Waits for nothing and nobody."""
        while not self._is_closing.wait(_TICK):
            with self._lock:
                if self._block is None:
                    return
                self._block.words[Word.SUPERVISOR_BEAT] = time.monotonic_ns()
                self._collect_replies()
                self._bear_deaths()
                if self._connecting is None and self._keeper.is_ready:
                    with suppress(UsageError):  # It died just now; the next look will tell.
                        self._connecting = self.reconnect()

    def _collect_replies(self) -> None:
        failures = self._desk.collect()
        self._setup.look()
        for failure in failures:
            if self._crash is None and failure["kind"] in ("ConnectionLostError", "ControlError", "ModelError"):
                shown = self._reader.read_snapshot()
                if shown.phase in ("lost", "fault"):
                    self._note(shown.code, failure["message"])

    def _bear_deaths(self) -> None:
        for death in self._keeper.look():
            self._connecting = None
            self._crash = death.code, death.message
            self._note(*self._crash)
            if death.is_worker:
                self._desk.fail_all(ConnectionLostError(death.message))

    def _judge(self, shown: Snapshot) -> tuple[Phase, str, str]:
        """Returns phase, code and message: what we know of the processes goes before what one of them says."""
        if self._is_closing.is_set():
            return "closed", "closed", MESSAGES["closed"]
        if self._connecting is not None and self._connecting.done:
            self._crash = None
            return shown.phase, shown.code, shown.message
        if self._crash is not None:
            return "crashed", *self._crash
        if self._keeper.address is None:
            return "starting", "starting.controller", MESSAGES["starting.controller"]
        if self._connecting is None:
            return "starting", "starting", MESSAGES["starting"]
        return "connecting", "connecting", MESSAGES["connecting"].format(address=self._keeper.address)

    def _note(self, code: str, message: str) -> None:
        number = 1 if self._incident is None else self._incident.number + 1
        self._incident = Incident(number=number, code=code, message=message)

    def _end_processes(self, reason: RcilabError) -> None:
        """Has the arm brought to rest, ends our processes, and fails what was under way."""
        if self._keeper.worker_pid is not None:
            self._desk.send_end()
        self._keeper.end()
        self._desk.fail_all(reason)
        self._connecting, self._crash = None, None

    def _is_operator_overdue(self) -> bool:
        with self._lock:
            beat = self._block.words[Word.OPERATOR_BEAT] if self._block is not None else 0
        return beat != 0 and time.monotonic_ns() - beat > OPERATOR_TIMEOUT * 1e9

    def _require_block(self) -> ControlBlock:
        if self._block is None:
            raise UsageError("the supervisor is not running: start() it first")
        return self._block
