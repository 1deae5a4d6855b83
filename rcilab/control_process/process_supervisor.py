"""Supervision of the control process and the virtual controller: start, exit, restart, end."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rcilab.cell.cell import Cell
from rcilab.control_process.launch import START_TIMEOUT, VirtualController
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.managed_process import ManagedProcess, parent_pid
from rcilab.control_process.snapshot import read_snapshot
from rcilab.control_process.status import MESSAGES
from rcilab.core.errors import ConnectionLostError, RcilabError
from rcilab.makers.maker import find_maker
from rcilab.sim.controller_config import MODE_DELAY, SUPERVISED_PREFILL

ANSWER_TIMEOUT = 3.0  # [s] For the connection and for every response of the controller.
LOAD_TIMEOUT = START_TIMEOUT  # [s] For the control process to load; the same as for the virtual controller.
FROZEN_AFTER = 1.0  # [s] Without a heartbeat of the control process; longer than any of its waits.
END_TIMEOUT = 3.0  # [s] For the control process to stop the arm and exit; the longest stop takes 0.4 s.
_CELL_FILE = "cell.zip"
_RESTARTS, _RESTART_WINDOW = 3, 60.0  # Largest number of automatic restarts, and within which time, [s].


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessExit:
    """An unexpected end of a child process: it ended by itself, or it hung and was killed."""

    code: str
    """Key of `MESSAGES`."""
    message: str
    """One English sentence: which process ended, how, and what happens next."""
    is_worker: bool
    """Whether it was the control process: all pending requests are lost."""
    is_restarted: bool = False
    """Whether it is being started again."""


def failed_start(error: RcilabError) -> str:
    """Returns the code of the status, a key of `MESSAGES`, after an error at the start."""
    return "crashed.slow_start" if error.code == "slow_start" else "crashed.no_start"


class ProcessSupervisor:
    """Owns the control process and, if there is one, the virtual controller.

    It has no thread and no lock: its owner calls `reap()` periodically and guards every call with its lock. Only
    `end()` waits.

    Args:
        block: Shared memory for the control process.
        model_name: Name of the arm, for the virtual controller.
        plant: Plant of the virtual controller: "ideal" or "mujoco".
        address: Address of an external controller; None starts a virtual one.
        auto_restart: Whether a process that ended is restarted automatically (at most 3 times a minute).
        cell: Cell of the virtual controller; None without one.
    """

    def __init__(
        self,
        block: ControlBlock,
        model_name: str,
        plant: str,
        address: str | None,
        *,
        auto_restart: bool,
        cell: Cell | None = None,
    ) -> None:
        self._block = block
        self._model_name = model_name
        self._plant = plant
        self._external_address = address
        self._auto_restart = auto_restart
        self._cell = cell
        self._folder: TemporaryDirectory[str] | None = None  # Of the cell's file.
        self._worker: ManagedProcess | None = None
        self._worker_started = 0.0
        self._controller: VirtualController | None = None
        self._restarts: deque[float] = deque(maxlen=_RESTARTS)
        self.address: str | None = None
        """Address of the controller; None until the virtual one listens."""

    @property
    def worker_pid(self) -> int | None:
        """Process id of the control process; None when it is not running."""
        return self._worker.pid if self._worker is not None and self._worker.is_alive else None

    @property
    def controller_pid(self) -> int | None:
        """Process id of the virtual controller; None without one or when it is not running."""
        return self._controller.pid if self._controller is not None and self._controller.is_alive else None

    @property
    def world_address(self) -> str | None:
        """Address of the virtual controller's simulation port, HOST:PORT; None without one."""
        return self._controller.world_address if self._controller is not None and self.address is not None else None

    @property
    def is_ready(self) -> bool:
        """Whether the control process handles requests and the address of the controller is known."""
        return (
            self.address is not None
            and self._block.counters[Counter.WORKER_HEARTBEAT] != 0
            and self.worker_pid is not None
        )

    def launch(self) -> None:
        """Starts the processes and returns at once; resets the count of restarts.

        Raises:
            ConnectionLostError: A process could not be started.
        """
        self._restarts.clear()
        self.address = self._external_address
        if self._external_address is None:
            self._start_controller()
        self._start_worker()

    def reap(self) -> list[ProcessExit]:
        """Reaps processes that have ended or hung since the last call and restarts them if that is enabled."""
        return [exited for exited in (self._check_controller(), self._check_worker()) if exited is not None]

    def end(self) -> None:
        """Ends both processes; a control process with an `End` request has `END_TIMEOUT` to exit by itself."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.wait(END_TIMEOUT)
            worker.end()
        self._end_controller()
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self.address = None

    def _start_controller(self) -> None:
        maker = find_maker(self._model_name)
        is_patient = maker is not None and maker.timing.is_patient
        has_delay = maker is not None and "mode_delay" in maker.capabilities.options
        prefill = [] if is_patient else ["--prefill", str(SUPERVISED_PREFILL)]
        delay = ["--mode-delay", str(MODE_DELAY)] if has_delay else []
        options = [*prefill, *delay, *self._cell_options()]
        self._controller = VirtualController(self._model_name, self._plant, options=options)

    def _cell_options(self) -> list[str]:
        if self._cell is None:
            return []
        if self._folder is None:
            self._folder = TemporaryDirectory(prefix="rcilab-")
            self._cell.save(Path(self._folder.name) / _CELL_FILE)
        return ["--cell", str(Path(self._folder.name) / _CELL_FILE)]

    def _start_worker(self) -> None:
        counters = self._block.counters
        # Pending messages were for the previous process.
        for counter in (Counter.REQUESTS_POSTED, Counter.REQUESTS_READ, Counter.REPLIES_POSTED, Counter.REPLIES_READ):
            counters[counter] = 0
        counters[Counter.WORKER_HEARTBEAT] = 0
        self._worker_started = time.monotonic()
        counters[Counter.SUPERVISOR_HEARTBEAT] = time.monotonic_ns()
        self._worker = ManagedProcess(
            "rcilab.control_process.worker",
            ["--block", str(self._block.descriptor), "--parent", str(parent_pid())],
            "the control process",
            [self._block.descriptor],
        )

    def _check_controller(self) -> ProcessExit | None:
        controller = self._controller
        if controller is None:
            return None
        was_ready = self.address is not None
        try:
            self.address = controller.address
        except ConnectionLostError as error:  # It was never ready: another attempt would fail as well.
            self._end_controller()
            return ProcessExit(code=failed_start(error), message=str(error), is_worker=False)
        if controller.is_alive:
            return None
        how = controller.exit_description
        self._end_controller()
        maker = find_maker(self._model_name)
        power = ", motor power off" if maker is None or maker.capabilities.switches_power else ""
        start = self._start_controller if was_ready else None
        return self._restart("crashed.controller", start, how=how, power=power)

    def _check_worker(self) -> ProcessExit | None:
        worker = self._worker
        if worker is None:
            return None
        if worker.is_alive:
            silence = self._heartbeat_age()
            if silence < FROZEN_AFTER:
                return None
            worker.kill()
            code, facts = "crashed.frozen", {"seconds": silence}
        else:
            output = worker.stderr_tail
            how = f"{worker.exit_description}; {output.splitlines()[-1]}" if output else worker.exit_description
            code, facts = "crashed.worker", {"how": how}
        worker.end()
        self._worker = None
        return self._restart(code, self._start_worker, **facts)

    def _heartbeat_age(self) -> float:
        """Returns the time since the last heartbeat of the control process, [s]; 0 while none is expected."""
        heartbeat = self._block.counters[Counter.WORKER_HEARTBEAT]
        if heartbeat == 0:  # It is still loading.
            loading = time.monotonic() - self._worker_started
            return loading if loading > LOAD_TIMEOUT else 0.0
        silence = (time.monotonic_ns() - heartbeat) * 1e-9
        # It blocks while it waits for a TCP connection.
        is_connecting = read_snapshot(self._block.snapshot, self._block.counters).phase == "connecting"
        return 0.0 if is_connecting and silence < 3.0 * ANSWER_TIMEOUT else silence

    def _restart(self, code: str, start: Callable[[], None] | None, **facts: Any) -> ProcessExit:
        """Restarts a process that ended, if that is enabled, and returns the event.

        Args:
            code: Key of `MESSAGES`.
            start: Restarts the process; None: do not restart it.
            **facts: Values for the message.
        """
        now = time.monotonic()
        is_repeated = len(self._restarts) == _RESTARTS and now - self._restarts[0] < _RESTART_WINDOW
        again = self._auto_restart and not is_repeated and start is not None
        following = "it is being restarted" if again else "use restart"
        if is_repeated:
            following = f"that happened {_RESTARTS} times in a minute; use restart"
        exited = ProcessExit(
            code=code, message=MESSAGES[code].format(**facts, next=following), is_worker=code != "crashed.controller"
        )
        if again and start is not None:
            self._restarts.append(now)
            try:
                start()
            except ConnectionLostError as error:
                return replace(exited, message=str(error))
        return replace(exited, is_restarted=again)

    def _end_controller(self) -> None:
        controller, self._controller = self._controller, None
        self.address = self._external_address
        if controller is not None:
            controller.end()
