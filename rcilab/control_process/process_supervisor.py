"""The supervisor of control process and virtual controller: start, exits, restarts, end."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from rcilab.control_process.launch import START_TIMEOUT, VirtualController
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.managed_process import ManagedProcess, parent_pid
from rcilab.control_process.snapshot import read_snapshot
from rcilab.control_process.status import MESSAGES
from rcilab.core.errors import ConnectionLostError

ANSWER_TIMEOUT = 3.0  # [s] For the connection and for every answer of the controller.
LOAD_TIMEOUT = START_TIMEOUT  # [s] for the control process to load; as long as the virtual controller may take.
FROZEN_AFTER = 1.0  # [s] Without a heartbeat of the control process; longer than any wait of its own.
END_TIMEOUT = 3.0  # [s] For the control process to stop the arm and exit; the longest stop takes 0.4 s.
MODE_DELAY = 0.2  # [s] Of our own controller: our client needs no delay after a change of mode.
PREFILL = 40  # [cycles] Play-out of our own controller: with a browser open pauses of tens of ms are common.
_RESTARTS, _RESTART_WINDOW = 3, 60.0  # Automatic restarts, in so many seconds.


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessExit:
    """An unexpected end of a process of ours: it ended by itself, or it froze and was ended."""

    code: str
    """Key of `MESSAGES`."""
    message: str
    """One English sentence: what ended, how, and what happens next."""
    is_worker: bool
    """Whether it was the control process: every pending request is lost with it."""


class ProcessSupervisor:
    """Owns the control process and, where the controller is ours, the virtual controller.

    It has no thread and no lock: `look()` is called often, and every call is guarded by its owner's lock.
    Nothing here waits, except `end()`.

    Args:
        block: Shared memory for the control process.
        model_name: Name of the arm, for the virtual controller.
        plant: What the virtual controller moves: "ideal" or "mujoco".
        address: Address of a controller that is not ours; None to start a virtual one.
        auto_restart: Whether a process that ended is started again automatically (at most 3 times a minute).
    """

    def __init__(
        self, block: ControlBlock, model_name: str, plant: str, address: str | None, *, auto_restart: bool
    ) -> None:
        self._block = block
        self._model_name = model_name
        self._plant = plant
        self._foreign_address = address
        self._auto_restart = auto_restart
        self._worker: ManagedProcess | None = None
        self._worker_started = 0.0
        self._controller: VirtualController | None = None
        self._restarts: deque[float] = deque(maxlen=_RESTARTS)
        self.address: str | None = None
        """Where the controller listens; None as long as the virtual one does not."""

    @property
    def worker_pid(self) -> int | None:
        """Process id of the control process; None when it is not running."""
        return self._worker.pid if self._worker is not None and self._worker.is_alive else None

    @property
    def controller_pid(self) -> int | None:
        """Process id of the virtual controller; None when it is not ours or not running."""
        return self._controller.pid if self._controller is not None and self._controller.is_alive else None

    @property
    def world_address(self) -> str | None:
        """Address of our virtual controller's simulation port, HOST:PORT; None without one."""
        return self._controller.world_address if self._controller is not None and self.address is not None else None

    @property
    def is_ready(self) -> bool:
        """Whether the control process takes requests and a controller is there to connect to."""
        return (
            self.address is not None and self._block.counters[Counter.WORKER_BEAT] != 0 and self.worker_pid is not None
        )

    def launch(self) -> None:
        """Starts our processes and returns at once; the count of restarts begins again.

        Raises:
            ConnectionLostError: A process could not be started.
        """
        self._restarts.clear()
        self.address = self._foreign_address
        if self._foreign_address is None:
            self._start_controller()
        self._start_worker()

    def look(self) -> list[ProcessExit]:
        """Reaps what has ended or frozen since the last call and restarts it where that is enabled."""
        return [death for death in (self._check_controller(), self._check_worker()) if death is not None]

    def end(self) -> None:
        """Ends both processes; the control process has `END_TIMEOUT` to exit by itself if that was requested."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.wait(END_TIMEOUT)
            worker.end()
        self._end_controller()
        self.address = None

    def _start_controller(self) -> None:
        self._controller = VirtualController(
            self._model_name, self._plant, options=["--prefill", str(PREFILL), "--mode-delay", str(MODE_DELAY)]
        )

    def _start_worker(self) -> None:
        words = self._block.counters
        # Pending messages were for a process that has ended.
        for word in (Counter.REQUESTS_POSTED, Counter.REQUESTS_TAKEN, Counter.REPLIES_POSTED, Counter.REPLIES_TAKEN):
            words[word] = 0
        words[Counter.WORKER_BEAT] = 0
        self._worker_started = time.monotonic()
        words[Counter.SUPERVISOR_BEAT] = time.monotonic_ns()
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
        except ConnectionLostError as error:  # It has never been ready: another attempt would end the same way.
            self._end_controller()
            return ProcessExit(code="crashed.controller", message=str(error), is_worker=False)
        if controller.is_alive:
            return None
        how = controller.how_it_ended
        self._end_controller()
        return self._restart("crashed.controller", self._start_controller if was_ready else None, how=how)

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
            words = worker.last_words
            how = f"{worker.how_it_ended}; {words.splitlines()[-1]}" if words else worker.how_it_ended
            code, facts = "crashed.worker", {"how": how}
        worker.end()
        self._worker = None
        return self._restart(code, self._start_worker, **facts)

    def _heartbeat_age(self) -> float:
        """Returns the time since the last heartbeat of the control process, [s]; 0 while none is expected."""
        beat = self._block.counters[Counter.WORKER_BEAT]
        if beat == 0:  # It is still loading.
            loading = time.monotonic() - self._worker_started
            return loading if loading > LOAD_TIMEOUT else 0.0
        silence = (time.monotonic_ns() - beat) * 1e-9
        # While it waits for a TCP connection it cannot do anything else.
        is_connecting = read_snapshot(self._block.snapshot, self._block.counters).phase == "connecting"
        return 0.0 if is_connecting and silence < 3.0 * ANSWER_TIMEOUT else silence

    def _restart(self, code: str, start: Callable[[], None] | None, **facts: Any) -> ProcessExit:
        """Restarts a process that ended, if that is enabled, and returns the event.

        Args:
            code: Key of `MESSAGES`.
            start: Starts the process again; None when it is not to be restarted.
            **facts: What the message contains.
        """
        now = time.monotonic()
        is_often = len(self._restarts) == _RESTARTS and now - self._restarts[0] < _RESTART_WINDOW
        again = self._auto_restart and not is_often and start is not None
        following = "it is being started again" if again else "restart starts it again"
        if is_often:
            following = f"that was {_RESTARTS} times in a minute; restart"
        death = ProcessExit(
            code=code, message=MESSAGES[code].format(**facts, next=following), is_worker=code != "crashed.controller"
        )
        if again and start is not None:
            self._restarts.append(now)
            try:
                start()
            except ConnectionLostError as error:
                return replace(death, message=str(error))
        return death

    def _end_controller(self) -> None:
        controller, self._controller = self._controller, None
        self.address = self._foreign_address
        if controller is not None:
            controller.end()
