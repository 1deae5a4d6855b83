"""The supervisor: the face of the control process to the rest of the program."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.client.address import parse_address
from rcilab.client.setup import RobotSetup, require_setup
from rcilab.clock import CYCLE_TIME
from rcilab.closing import Closing
from rcilab.errors import ConnectionLostError, RcilabError, UsageError
from rcilab.starved import memory_needed
from rcilab.supervisor.arm_requests import ArmRequests
from rcilab.supervisor.keeper import ANSWER_TIMEOUT, ProcessKeeper
from rcilab.supervisor.launch import require_plant
from rcilab.supervisor.layout import OPERATOR_TIMEOUT, ControlBlock, Word
from rcilab.supervisor.pace_desk import PaceDesk
from rcilab.supervisor.ring import RingReader
from rcilab.supervisor.round_trip import RoundTrip
from rcilab.supervisor.settings import build_settings
from rcilab.supervisor.setup_desk import SetupDesk, standard_setup
from rcilab.supervisor.snapshot import Snapshot
from rcilab.supervisor.status import MESSAGES, Incident, Phase, SupervisorStatus
from rcilab.supervisor.status_reader import StatusReader
from rcilab.supervisor.ticket import Ticket
from rcilab.supervisor.ticket_desk import TicketDesk

if TYPE_CHECKING:
    from rcilab.model import RobotModel

__all__ = ["Supervisor", "Ticket"]

VIRTUAL = "virtual"
_TICK = 0.02  # [s] between two looks of the watching thread.
_LOSS_LOOKS = 3  # Looks that have to find a connection lost before it is told; a choice, 0.06 s.


class Supervisor(ArmRequests, Closing):
    """Runs motions in a process of its own, so that nothing the page does can disturb a cycle.

    What moves the arm is in `ArmRequests`. All methods may be called from any thread. Requests return a `Ticket` at
    once; nothing here waits for the robot except `start()`, `restart()` and `close()`. The processes belong to a
    `ProcessKeeper`, the requests under way to a `TicketDesk`; a thread of this object looks after both.

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
        self._lost_looks = 0  # So many looks have found the connection lost.
        self._watcher: threading.Thread | None = None
        self._is_closing = threading.Event()

    def start(self, timeout: float = 20.0) -> None:
        """Starts the processes and returns once states arrive or it is clear that they will not.

        An unreachable robot is no error here: the phase is then "lost" and `reconnect()` tries again.

        Args:
            timeout: How long to wait, [s].

        Raises:
            ConnectionLostError: A process of ours could not be started; the message carries what it said.
            UsageError: It was started before, or memory is short.
        """
        with self._lock:
            if self._block is not None:
                raise UsageError("the supervisor has been started already; use restart(), or make a new one")
        try:
            with memory_needed():
                with self._lock:
                    self._open()
                    watcher = threading.Thread(target=self._watch, name="rcilab-supervisor", daemon=True)
                    watcher.start()
                    self._watcher = watcher
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
                **self._read_pace(shown),
                **self._round_trip.read_fields(),
            )

    def reconnect(self) -> Ticket:
        """Drops the connection to the controller and makes a new one.

        Raises:
            UsageError: There is no controller to connect to: the virtual one has died; `restart()` starts it again.
        """
        with self._lock:
            self._require_block()
            address = self._keeper.address
            if address is None:
                raise UsageError("there is no controller to connect to; restart() starts the virtual one again").coded(
                    "not_connected"
                )
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
        """Sends a request to the control process."""
        with self._lock:
            self._require_block()
            if self._keeper.worker_pid is None:
                raise UsageError(
                    f"the control process is not running; restart() starts it again (asked: {what})"
                ).coded("not_connected")
            return self._desk.send(what, letter)

    def _open(self) -> None:
        """Makes the shared block and what works on it, and starts the processes."""
        block = ControlBlock.create(self.model.n, build_settings(self.model))
        address = None if self._target == VIRTUAL else self._target
        try:
            self._keeper = ProcessKeeper(block, self.model.name, self._plant, address, auto_restart=self._auto_restart)
            self._desk = TicketDesk(block)
            self._pace, self._round_trip = PaceDesk(block), RoundTrip(block)
            self._reader, self._ring = StatusReader(block), RingReader(block)
        except BaseException:
            block.close()
            raise
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
                ).coded("slow_start", seconds=f"{timeout:g}")
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
                self._look_for_loss()
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

    def _look_for_loss(self) -> None:
        """Notes a connection that went while nobody had asked for anything, unless a death of ours explains it.

        A controller's death is known a little later than the end of its connection: hence more looks than one.
        """
        shown = self._reader.read_snapshot()
        is_lost = shown.code == "lost.unreachable" and self._crash is None and self._connecting is not None
        self._lost_looks = self._lost_looks + 1 if is_lost else 0
        if self._lost_looks == _LOSS_LOOKS:
            self._note(shown.code, shown.message)

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
        self._lost_looks = _LOSS_LOOKS  # Once is enough.

    def _end_processes(self, reason: RcilabError) -> None:
        """Has the arm brought to rest, ends our processes, and fails what was under way."""
        if self._keeper.worker_pid is not None:
            self._desk.send_end()
        self._keeper.end()
        self._desk.fail_all(reason)
        self._connecting, self._crash = None, None

    def _motion_cycle(self) -> int | None:
        with self._lock:
            self._require_block()
            shown = self._reader.read_snapshot()
            if shown.phase != "moving" or shown.motion_duration is None or shown.code not in ("moving", "moving.held"):
                return None
            return self._reader.read_cycle()

    def _read_pace(self, shown: Snapshot) -> dict[str, Any]:
        paced = self._pace.paced
        if paced is None or shown.motion_time is None:
            return {}
        place = paced.place_at(round(shown.motion_time / CYCLE_TIME))
        return {"motion_place": place, "pace": paced.pace, "mode": self._pace.mode}

    def _is_operator_overdue(self) -> bool:
        with self._lock:
            beat = self._block.words[Word.OPERATOR_BEAT] if self._block is not None else 0
        return beat != 0 and time.monotonic_ns() - beat > OPERATOR_TIMEOUT * 1e9

    def _require_block(self) -> ControlBlock:
        if self._block is None:
            raise UsageError("the supervisor is not running: start() it first").coded("not_connected")
        return self._block
