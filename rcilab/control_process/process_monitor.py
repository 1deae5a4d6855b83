"""The processes of a supervisor from start to end: shared memory, requests, the monitoring thread, incidents."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from rcilab.cell.cell import Cell
from rcilab.control_process.launch import START_TIMEOUT
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.messages import Connect, Request, WorkerSettings
from rcilab.control_process.process_supervisor import ANSWER_TIMEOUT, ProcessSupervisor
from rcilab.control_process.requests import PendingRequest, RequestClient
from rcilab.control_process.status import MESSAGES, Incident, Phase
from rcilab.control_process.status_reader import StatusReader
from rcilab.core.errors import ConnectionLostError, ControlError, ModelError, RcilabError, UsageError
from rcilab.makers.maker import maker_of

if TYPE_CHECKING:
    from rcilab.control_process.configuration_sync import ConfigurationSync
    from rcilab.control_process.snapshot import Snapshot
    from rcilab.model.robot_model import RobotModel

_PERIOD = 0.02  # [s] Of the monitoring thread.
_LOSS_PERIODS = 3  # Periods with a lost connection until it is reported, 0.06 s.


class ProcessMonitor:
    """Owns the shared block; a `ProcessSupervisor` owns the processes, a `RequestClient` the pending requests.

    A thread of this object monitors both. Methods may be called from any thread.

    Attributes:
        lock: Guards everything here, and what its owner adds; held for long only while the processes end.
        block: The shared block; None while not running. `processes` and `reader` exist with it.
        incident: The last incident.

    Args:
        plant: Plant of the virtual controller: "ideal" or "mujoco".
        address: Address of an external controller; None starts a virtual one.
        setup: The configuration to send at every connection.
        auto_restart: Whether a process that ended unexpectedly is restarted automatically.
        cell: Cell of the virtual controller; None without one.
    """

    def __init__(
        self, plant: str, address: str | None, setup: ConfigurationSync, *, auto_restart: bool, cell: Cell | None = None
    ) -> None:
        self._plant, self._address, self._setup = plant, address, setup
        self._auto_restart, self._cell = auto_restart, cell
        self.lock = threading.RLock()
        self.block: ControlBlock | None = None
        self.incident: Incident | None = None
        self._connecting: PendingRequest | None = None
        self._crash: tuple[str, str] | None = None
        self._loss_periods = 0  # Consecutive periods with a lost connection.
        self._thread: threading.Thread | None = None
        self._is_closing = threading.Event()

    def open(self, model: RobotModel, settings: WorkerSettings) -> ControlBlock:
        """Returns the new shared block; `launch` starts the processes on it. Call it with the lock held."""
        maker = maker_of(model)
        assert maker is not None  # It has a driver.
        block = ControlBlock.create(model.n, settings)
        try:
            self.processes = ProcessSupervisor(
                block, model.name, self._plant, self._address, auto_restart=self._auto_restart, cell=self._cell
            )
            self._client, self.reader = RequestClient(block), StatusReader(block, maker)
        except BaseException:
            block.close()
            raise
        self._is_closing.clear()
        self.block = block
        return block

    def launch(self) -> None:
        """Starts the processes and their monitoring. Call it with the lock held.

        Raises:
            ConnectionLostError: A process could not be started.
        """
        self.processes.launch()
        self._start_monitoring()

    def restart(self) -> None:
        """Ends the processes in any state and starts them again.

        Raises:
            ConnectionLostError: A process could not be started.
            UsageError: They were never started.
        """
        with self.lock:
            self.require_block()
            self._end_processes(ConnectionLostError("the control process was restarted"))
            try:
                self.processes.launch()
            except Exception as error:
                self.processes.end()  # The other one may have started.
                self._record_crash(f"{error}; restart() tries again")
                raise
            self._start_monitoring()

    def close(self) -> None:
        """Stops a running motion, ends the processes and frees the shared memory. May be called twice."""
        self._is_closing.set()
        thread, self._thread = self._thread, None
        if thread is not None and thread is not threading.current_thread():
            thread.join()
        with self.lock:
            if self.block is not None:
                self._end_processes(ConnectionLostError("the supervisor was closed"))
                self.block.close()
                self.block = None

    def await_connection(self, timeout: float) -> None:
        """Returns once states arrive or the connection has failed.

        Args:
            timeout: Timeout, [s].

        Raises:
            ConnectionLostError: Neither within the timeout, or a process has ended.
        """
        deadline = time.monotonic() + timeout
        while True:
            phase, code, message = self.find_phase()
            if phase not in ("starting", "connecting"):
                break
            if time.monotonic() > deadline:
                raise ConnectionLostError(
                    f"not ready after {timeout:g} s ({message}); try again when the machine is less busy"
                ).coded("slow_start", seconds=f"{timeout:g}")
            time.sleep(_PERIOD / 2)
        if phase == "crashed":
            error = ConnectionLostError(message)
            raise error.coded("slow_start", seconds=f"{START_TIMEOUT:g}") if code == "crashed.slow_start" else error

    def require_block(self) -> ControlBlock:
        """Returns the shared block. Call it with the lock held.

        Raises:
            UsageError: Nothing was started.
        """
        if self.block is None:
            raise UsageError("the supervisor is not running: start() it first").coded("not_connected")
        return self.block

    def send(self, what: str, request: Request) -> PendingRequest:
        """Sends a request to the control process.

        Args:
            what: Name of the request, for errors.
            request: The request.

        Raises:
            UsageError: The control process is not running.
        """
        with self.lock:
            self.require_block()
            if self.processes.worker_pid is None:
                raise UsageError(f"the control process is not running; restart() restarts it (request: {what})").coded(
                    "not_connected"
                )
            return self._client.send(what, request)

    def connect(self) -> PendingRequest:
        """Closes the connection to the controller and opens a new one, with the configuration.

        Raises:
            UsageError: There is no controller to connect to.
        """
        with self.lock:
            self.require_block()
            address = self.processes.address
            if address is None:
                raise UsageError("there is no controller to connect to; restart() restarts the virtual one").coded(
                    "not_connected"
                )
            requested = self._setup.requested
            pending = self.send("reconnect", Connect(address=address, timeout=ANSWER_TIMEOUT, configuration=requested))
            self._setup.track(pending, requested, is_new_connection=True)
            return pending

    def find_phase(self, shown: Snapshot | None = None) -> tuple[Phase, str, str]:
        """Returns phase, code and message: the state of the processes has precedence over the snapshot.

        Args:
            shown: Snapshot of the control process; None: the latest.
        """
        with self.lock:
            if self.block is None or self._is_closing.is_set():
                return "closed", "closed", MESSAGES["closed"]
            if self._connecting is not None and self._connecting.done:
                self._crash = None
                shown = self.reader.read_snapshot() if shown is None else shown
                return shown.phase, shown.code, shown.message
            if self._crash is not None:
                return "crashed", *self._crash
            if self.processes.address is None:
                return "starting", "starting.controller", MESSAGES["starting.controller"]
            if self._connecting is None:
                return "starting", "starting", MESSAGES["starting"]
            return "connecting", "connecting", MESSAGES["connecting"].format(address=self.processes.address)

    def _start_monitoring(self) -> None:
        if self._thread is None or not self._thread.is_alive():
            thread = threading.Thread(target=self._monitor, name="rcilab-supervisor", daemon=True)
            thread.start()
            self._thread = thread

    def _monitor(self) -> None:
        """The monitoring thread: heartbeats, replies, processes that ended. It never blocks."""
        while not self._is_closing.wait(_PERIOD):
            with self.lock:
                if self.block is None:
                    return
                try:
                    self._monitor_once(self.block)
                except Exception as error:
                    self._fail(f"{type(error).__name__}: {error}")

    def _monitor_once(self, block: ControlBlock) -> None:
        block.counters[Counter.SUPERVISOR_HEARTBEAT] = time.monotonic_ns()
        self._collect_replies()
        self._handle_exits()
        self._check_for_loss()
        if self._connecting is None and self.processes.is_ready:
            with suppress(UsageError):  # The process has just ended; the next period detects it.
                self._connecting = self.connect()

    def _fail(self, reason: str) -> None:
        """Ends the control process, which stops the arm, and all requests: no reply may arrive any more."""
        message = f"The supervision of the control process has failed ({reason}); use restart."
        if self._crash is None:
            self._record_crash(message)
            self._client.send_end()
        self._connecting = None
        self._client.fail_all(ConnectionLostError(message))

    def _collect_replies(self) -> None:
        errors = self._client.collect()
        self._setup.collect()
        for error in errors:
            if self._crash is None and isinstance(error, ConnectionLostError | ControlError | ModelError):
                shown = self.reader.read_snapshot()
                if shown.phase in ("lost", "fault"):
                    self._record_incident(shown.code, str(error))

    def _handle_exits(self) -> None:
        for exited in self.processes.reap():
            self._connecting = None
            self._crash = exited.code, exited.message
            self._record_incident(*self._crash, is_restarted=exited.is_restarted)
            if exited.is_worker:
                self._client.fail_all(ConnectionLostError(exited.message))

    def _check_for_loss(self) -> None:
        """Records a connection loss without a pending request as an incident, unless a process exit explains it.

        The exit of a controller is detected slightly later than the end of its connection: hence several periods.
        """
        shown = self.reader.read_snapshot()
        is_lost = (
            shown.code in ("lost.unreachable", "lost.closed") and self._crash is None and self._connecting is not None
        )
        self._loss_periods = self._loss_periods + 1 if is_lost else 0
        if self._loss_periods == _LOSS_PERIODS:
            self._record_incident(shown.code, shown.message)

    def _record_crash(self, message: str) -> None:
        self._crash = "crashed.worker", message
        self._record_incident(*self._crash)

    def _record_incident(self, code: str, message: str, *, is_restarted: bool = False) -> None:
        number = 1 if self.incident is None else self.incident.number + 1
        self.incident = Incident(number=number, code=code, message=message, is_restarted=is_restarted)
        self._loss_periods = _LOSS_PERIODS  # A loss is reported once.

    def _end_processes(self, reason: RcilabError) -> None:
        """Stops the arm, ends the processes, and fails all pending requests."""
        if self.processes.worker_pid is not None:
            self._client.send_end()
        self.processes.end()
        self._client.fail_all(reason)
        self._connecting, self._crash = None, None
