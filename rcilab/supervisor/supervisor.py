"""The supervisor: starts the control process (and a virtual controller), watches both, and passes requests on."""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.client.address import parse_address
from rcilab.client.start_check import describe_start_mismatch
from rcilab.errors import CertificateError, ConnectionLostError, RcilabError, UsageError
from rcilab.faults import faults_from_bits
from rcilab.state import ControllerMode, RobotMode
from rcilab.supervisor.failure import unpack_failure
from rcilab.supervisor.lateness import late_cycles, summarise
from rcilab.supervisor.launch import Child, VirtualController
from rcilab.supervisor.layout import MOTION_ROWS, MOTION_TIME, OPERATOR_TIMEOUT, ControlBlock, Word
from rcilab.supervisor.mailbox import Mailbox
from rcilab.supervisor.ring import RingReader
from rcilab.supervisor.settings import build_settings
from rcilab.supervisor.snapshot import Snapshot, read_snapshot
from rcilab.supervisor.status import MESSAGES, Incident, Phase, SupervisorStatus
from rcilab.supervisor.ticket import Ticket

if TYPE_CHECKING:
    from rcilab.conformance import Certificate
    from rcilab.model import RobotModel
    from rcilab.motion import Motion

__all__ = ["Supervisor", "Ticket"]

VIRTUAL = "virtual"
ANSWER_TIMEOUT = 3.0  # [s] for the connection and for every answer of the controller.
FROZEN_AFTER = 1.0  # [s] without a sign of life of the control process; a choice above every wait of its own.
END_TIMEOUT = 3.0  # [s] for the control process to bring the arm to rest and go; the longest stop takes 0.4 s.
_TICK = 0.02  # [s] between two looks of the watching thread.
_RESTARTS, _RESTART_WINDOW = 3, 60.0  # Restarts by itself, in so many seconds.


class Supervisor:
    """Runs motions in a process of its own, so that nothing the page does can disturb a cycle.

    All methods may be called from any thread. Requests return a `Ticket` at once; nothing here waits for the robot
    except `start()`, `restart()` and `close()`.

    Args:
        model: The arm.
        target: "virtual" for a private virtual controller on loopback, or the address of a controller, rci://HOST:PORT.
        plant: What the virtual controller moves: "ideal" or "mujoco".
        stop_without_operator: Whether a motion is brought to rest once nobody has been at the controls for 2 s (see
            `set_operator_present`). False lets it finish; meant for the virtual controller.
        auto_restart: Whether a process of ours that died is started again by itself (at most 3 times a minute).

    Raises:
        InvalidValueError: The target is no address.
    """

    def __init__(
        self,
        model: RobotModel,
        target: str = VIRTUAL,
        plant: str = "ideal",
        *,
        stop_without_operator: bool = True,
        auto_restart: bool = True,
    ) -> None:
        self.model = model
        self._is_virtual = target == VIRTUAL
        self._target = VIRTUAL if self._is_virtual else str(parse_address(target))
        self._plant = plant
        self._stop_without_operator = stop_without_operator
        self._auto_restart = auto_restart
        self._lock = threading.RLock()  # Guards everything below; never held while waiting for the robot.
        self._block: ControlBlock | None = None
        self._worker: Child | None = None
        self._controller: VirtualController | None = None
        self._address: str | None = None
        self._connecting: Ticket | None = None
        self._tickets: dict[int, Ticket] = {}
        self._next_id = 1
        self._crash: tuple[str, str] | None = None
        self._incident: Incident | None = None
        self._restarts: deque[float] = deque(maxlen=_RESTARTS)
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
            self._block = ControlBlock.create(self.model.n, build_settings(self.model, is_virtual=self._is_virtual))
            self._requests = Mailbox(self._block.requests, self._block.words, Word.REQUESTS_POSTED, Word.REQUESTS_TAKEN)
            self._replies = Mailbox(self._block.replies, self._block.words, Word.REPLIES_POSTED, Word.REPLIES_TAKEN)
            self._ring, self._newest = RingReader(self._block), RingReader(self._block)
            self._is_closing.clear()
            self._launch()
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
                self._end_children()
            self._fail_tickets(ConnectionLostError("the supervisor was closed"))
            if self._block is not None:
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
            self._end_children()
            self._fail_tickets(ConnectionLostError("the control process was restarted"))
            self._restarts.clear()
            self._launch()
        self._await_connection(timeout)

    def status(self) -> SupervisorStatus:
        """Returns a snapshot; cheap enough to be taken at the display's rate."""
        with self._lock:
            block, worker, controller = self._block, self._worker, self._controller
            if block is None:
                return SupervisorStatus(target=self._target, incident=self._incident)
            words = block.words
            shown = read_snapshot(block.snapshot, words)
            phase, code, message = self._judge(shown)
            row = self._newest.newest()
            common: dict[str, Any] = {
                "phase": phase,
                "code": code,
                "message": message,
                "incident": self._incident,
                "target": self._target,
                "address": self._address,
                "powered": shown.powered,
                "rate_hz": shown.rate_hz if phase not in ("crashed", "lost", "starting") else 0.0,
                "scheduling": "SCHED_FIFO" if shown.is_fifo else "normal",
                "memory_locked": shown.memory_locked,
                "late_cycles": late_cycles(block.histogram),
                "lost_cycles": words[Word.LOST],
                "lateness": summarise(block.histogram),
                "motion_time": shown.motion_time,
                "motion_duration": shown.motion_duration,
                "controller_pid": controller.pid if controller is not None and controller.is_alive else None,
                "worker_pid": worker.pid if worker is not None and worker.is_alive else None,
            }
        if row is None:
            return SupervisorStatus(**common)
        last = row[0]
        bits = int(last["faults"])
        return SupervisorStatus(
            **common,
            q=last["q"],
            q_c=last["q_c"],
            dq=last["dq"],
            robot_mode=RobotMode(last["robot_mode"]),
            controller_mode=ControllerMode(last["controller_mode"]),
            faults=faults_from_bits(bits >> place & 1 for place in range(32)) if bits else (),
            success_rate=float(last["success_rate"]),
            message_id=int(last["message_id"]),
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
            UsageError: The arm is moving, or no controller is connected, or nobody is at the controls.
        """
        status = self.status()
        if status.phase in ("moving", "stopping"):
            raise UsageError("the arm is moving; stop it first, or wait until it has arrived")
        if status.q_c is None or status.phase not in ("idle", "fault"):
            raise UsageError(f"nothing can move now: {status.message}")
        if certificate is None:
            raise CertificateError("the motion has not been checked: check(motion, model) first", ["certificate"])
        mismatch = describe_start_mismatch(motion.q[0], status.q_c)
        if mismatch is not None:
            raise CertificateError(mismatch, ["start state"])
        certificate.verify(motion, self.model, status.q_c)
        if self._is_operator_overdue():
            raise UsageError("nobody is at the controls: the page that holds them has not been heard of for 2 s")
        rows = motion.q
        if len(rows) > MOTION_ROWS:
            raise UsageError(
                f"the motion takes {motion.duration:.1f} s, {MOTION_TIME:g} s at most can be handed over; split it"
            )
        with self._lock:
            block = self._require_block()
            block.motion[: len(rows)] = rows
            return self._ask("execute", kind="execute", rows=len(rows), duration=motion.duration)

    def stop(self) -> Ticket:
        """Brings a running motion to rest within the limits; done when it stands, at once when nothing moves."""
        with self._lock:
            block = self._require_block()
            block.words[Word.STOPS_ASKED] += 1
            return self._ask("stop", kind="stop", number=block.words[Word.STOPS_ASKED])

    def recover(self) -> Ticket:
        """Asks the controller to clear its faults (automatic error recovery)."""
        return self._ask("recover", kind="recover")

    def reconnect(self) -> Ticket:
        """Drops the connection to the controller and makes a new one.

        Raises:
            UsageError: There is no controller to connect to: the virtual one has died; `restart()` starts it again.
        """
        with self._lock:
            if self._address is None:
                raise UsageError("there is no controller to connect to; restart() starts the virtual one again")
            return self._ask("reconnect", kind="connect", address=self._address, timeout=ANSWER_TIMEOUT)

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

    def __enter__(self) -> Supervisor:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _ask(self, what: str, **letter: Any) -> Ticket:
        with self._lock:
            self._require_block()
            if self._worker is None or not self._worker.is_alive:
                raise UsageError(f"the control process is not running; restart() starts it again (asked: {what})")
            ticket = Ticket(what)
            self._requests.post({"id": self._next_id, **letter})
            self._tickets[self._next_id] = ticket
            self._next_id += 1
            return ticket

    def _launch(self) -> None:
        if self._is_virtual:
            self._start_controller()
        else:
            self._address = self._target
        self._start_worker()

    def _start_controller(self) -> None:
        self._address = None
        self._connecting = None
        self._controller = VirtualController(self.model.name, self._plant)

    def _start_worker(self) -> None:
        block = self._require_block()
        words = block.words
        # Whatever lay in the mailboxes was for a process that is no more.
        for word in (Word.REQUESTS_POSTED, Word.REQUESTS_TAKEN, Word.REPLIES_POSTED, Word.REPLIES_TAKEN):
            words[word] = 0
        words[Word.WORKER_BEAT] = 0
        words[Word.SUPERVISOR_BEAT] = time.monotonic_ns()
        self._connecting = None
        self._worker = Child(
            ["-m", "rcilab.supervisor.worker", "--block", str(block.descriptor)],
            "the control process",
            [block.descriptor],
        )

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
                self._look_after_controller()
                self._look_after_worker()
                self._announce_controller()

    def _collect_replies(self) -> None:
        while (reply := self._replies.take()) is not None:
            ticket = self._tickets.pop(reply["id"], None)
            failure = reply.get("failure")
            if ticket is not None:
                ticket.settle(unpack_failure(failure) if failure else None)
            if self._crash is None and failure and failure["kind"] in ("ConnectionLostError", "ControlError"):
                shown = read_snapshot(self._require_block().snapshot, self._require_block().words)
                if shown.phase in ("lost", "fault"):
                    self._note(shown.code, failure["message"])

    def _look_after_controller(self) -> None:
        controller = self._controller
        if controller is None:
            return
        was_ready = self._address is not None
        try:
            self._address = controller.address
        except ConnectionLostError as error:
            self._give_up(str(error))
            return
        if controller.is_alive:
            return
        how = controller.how_it_ended
        controller.end()
        self._controller, self._address = None, None
        if self._may_restart("crashed.controller", how=how) and was_ready:
            self._start_controller()

    def _look_after_worker(self) -> None:
        worker = self._worker
        if worker is None:
            return
        if worker.is_alive:
            age = self._silence_of_worker()
            if age < FROZEN_AFTER:
                return
            worker.kill()
            again = self._may_restart("crashed.frozen", seconds=age)
        else:
            words = worker.last_words
            how = f"{worker.how_it_ended}; {words.splitlines()[-1]}" if words else worker.how_it_ended
            again = self._may_restart("crashed.worker", how=how)
        worker.end()
        self._worker = None
        assert self._crash is not None
        self._fail_tickets(ConnectionLostError(self._crash[1]))
        if again:
            self._start_worker()

    def _silence_of_worker(self) -> float:
        """Returns how long the control process has given no sign of life, [s]; 0 while that is to be expected."""
        block = self._require_block()
        beat = block.words[Word.WORKER_BEAT]
        if beat == 0:  # It is still loading; START_TIMEOUT of the caller bounds that.
            return 0.0
        age = (time.monotonic_ns() - beat) * 1e-9
        # While it waits for a TCP connection it cannot do anything else.
        is_connecting = read_snapshot(block.snapshot, block.words).phase == "connecting"
        return 0.0 if is_connecting and age < 3.0 * ANSWER_TIMEOUT else age

    def _announce_controller(self) -> None:
        """Tells the control process where the controller is, once both are there."""
        if self._connecting is not None or self._address is None or self._worker is None:
            return
        if self._require_block().words[Word.WORKER_BEAT] != 0 and self._worker.is_alive:
            self._connecting = self.reconnect()

    def _judge(self, shown: Snapshot) -> tuple[Phase, str, str]:
        """Returns phase, code and message: what we know of the processes goes before what one of them says."""
        if self._is_closing.is_set():
            return "closed", "closed", MESSAGES["closed"]
        if self._connecting is not None and self._connecting.done:
            self._crash = None
            return shown.phase, shown.code, shown.message
        if self._crash is not None:
            return "crashed", *self._crash
        if self._is_virtual and self._address is None:
            return "starting", "starting.controller", MESSAGES["starting.controller"]
        if self._connecting is None:
            return "starting", "starting", MESSAGES["starting"]
        return "connecting", "connecting", MESSAGES["connecting"].format(address=self._address)

    def _may_restart(self, code: str, **facts: Any) -> bool:
        """Notes a death and returns whether what died is started again now."""
        now = time.monotonic()
        is_often = len(self._restarts) == _RESTARTS and now - self._restarts[0] < _RESTART_WINDOW
        again = self._auto_restart and not is_often
        if again:
            self._restarts.append(now)
            following = "it is being started again"
        else:
            following = (
                "restart starts it again" if not is_often else f"that was {_RESTARTS} times in a minute; restart"
            )
        self._connecting = None
        self._crash = code, MESSAGES[code].format(**facts, next=following)
        self._note(*self._crash)
        return again

    def _give_up(self, message: str) -> None:
        """Notes that the virtual controller does not start, and leaves it at that."""
        if self._controller is not None:
            self._controller.end()
        self._controller, self._address, self._connecting = None, None, None
        self._crash = "crashed.controller", message
        self._note(*self._crash)

    def _note(self, code: str, message: str) -> None:
        number = 1 if self._incident is None else self._incident.number + 1
        self._incident = Incident(number=number, code=code, message=message)

    def _fail_tickets(self, error: RcilabError) -> None:
        for ticket in self._tickets.values():
            ticket.settle(error)
        self._tickets.clear()

    def _end_children(self) -> None:
        worker, self._worker = self._worker, None
        controller, self._controller = self._controller, None
        if worker is not None:
            if worker.is_alive:
                with suppress(UsageError):  # A full mailbox: then it does not listen anyway.
                    self._requests.post({"id": 0, "kind": "end"})
                worker.wait(END_TIMEOUT)
            worker.end()
        if controller is not None:
            controller.end()
        self._address, self._connecting, self._crash = None, None, None

    def _is_operator_overdue(self) -> bool:
        beat = self._require_block().words[Word.OPERATOR_BEAT]
        return beat != 0 and time.monotonic_ns() - beat > OPERATOR_TIMEOUT * 1e9

    def _require_block(self) -> ControlBlock:
        if self._block is None:
            raise UsageError("the supervisor is not running: start() it first")
        return self._block
