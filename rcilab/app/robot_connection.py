"""The robot that our control process drives: one supervisor at a time, replaced without waiting for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from rcilab.app.arm_features import explain_missing_robot
from rcilab.app.status_text import StartingError
from rcilab.cell.convex_parts import prepare_meshes
from rcilab.control_process import Supervisor, SupervisorStatus
from rcilab.control_process.process_supervisor import failed_start
from rcilab.core.errors import RcilabError, UsageError
from rcilab.core.memory import memory_needed

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.makers.configuration import RobotConfiguration
    from rcilab.model.robot_model import RobotModel


class RobotConnection:
    """Starts, replaces and closes the supervisor in a separate thread.

    Args:
        on_failure: Called with the error if a supervisor could not be started; from that thread.
    """

    def __init__(self, on_failure: Callable[[RcilabError], None]) -> None:
        self._on_failure = on_failure
        self._lock = threading.Lock()
        self._current: Supervisor | None = None
        self._shown: Supervisor | None = None  # The one of the current model.
        self._ready: Supervisor | None = None  # Only one that start() has built; it takes requests.
        self._failure: SupervisorStatus | None = None  # The status after a supervisor that could not be started.
        self._generation = 0
        self._worker: threading.Thread | None = None
        self.name = ""
        """The target: "virtual", or an address."""
        self._wants_connection = False

    def open(
        self,
        model: RobotModel,
        target: str,
        plant: str = "ideal",
        setup: RobotConfiguration | None = None,
        cell: Cell | None = None,
    ) -> None:
        """Closes the open supervisor and starts one for this arm, destination and plant; returns at once.

        For an arm that cannot run there, nothing is started: see `explain_missing_robot`.

        Raises:
            UsageError: Memory is short.
        """
        if explain_missing_robot(model, is_virtual=target == "virtual") is not None:
            self.disconnect()
            self.name = target
            return
        with self._lock:
            self._generation += 1
            generation, previous = self._generation, self._worker
            self._ready = self._shown = self._failure = None
            self._wants_connection, self.name = True, target
            self._work(self._replace, generation, previous, model, target, plant, setup, cell)

    def disconnect(self) -> None:
        """Closes the open supervisor and starts nothing; returns at once, `status` is "closed" from then on."""
        with self._lock:
            self._generation += 1
            previous = self._worker
            self._ready = self._shown = self._failure = None
            self._wants_connection = False
            self._work(self._close_current, previous)

    def close(self) -> None:
        """Ends the supervisor and waits for the end of its processes."""
        with self._lock:
            self._generation += 1
            worker, self._ready = self._worker, None
        if worker is not None:
            worker.join(20.0)
        with self._lock:
            current, self._current = self._current, None
        if current is not None:
            current.close()

    def status(self) -> SupervisorStatus:
        """Returns the supervisor's snapshot; "starting" before the first one, "crashed" if it could not be started."""
        failure, shown = self._failure, self._shown
        if failure is not None:
            return failure
        if shown is not None:
            return shown.status()
        if self._worker is None or not self._wants_connection:
            return SupervisorStatus()
        return SupervisorStatus(phase="starting", code="starting", target=self.name)

    @property
    def is_ready(self) -> bool:
        """Whether `supervisor` returns one; its status may show an idle arm a moment earlier."""
        return self._ready is not None

    def robot(self) -> Supervisor:
        """Returns the supervisor for requests.

        Raises:
            StartingError: It has not started yet.
        """
        ready, shown = self._ready, self._shown
        if ready is None and shown is not None and shown.status().phase == "idle":
            return shown  # What the page shows as ready is ready, even just before start() returns.
        if ready is None:
            raise StartingError("the control process is still starting; try again in a moment")
        return ready

    def take_run(self) -> None:
        """Returns None: a run is built from the drained cycles."""

    def stop(self) -> None:
        """Stops a motion. Callable from any thread, never waits: the direct path of Stop and Esc."""
        current = self._current
        if current is not None:
            with suppress(
                RcilabError
            ):  # It is closed or has no connection: nothing of ours moves, and the status explains why.
                current.stop()

    @property
    def stops(self) -> int:
        """Number of stops of the current supervisor; 0 without one."""
        current = self._current
        return 0 if current is None else current.stops

    def heartbeat(self) -> None:
        """Reports an operator at the page; call it several times a second while there is one."""
        ready = self._ready
        if ready is not None:
            with suppress(RcilabError):  # Closed in the meantime.
                ready.set_operator_present(True)

    def _work(self, work: Callable[..., None], *args: object) -> None:
        worker = threading.Thread(target=work, args=args, name="session", daemon=True)
        try:
            with memory_needed():
                worker.start()
        except UsageError:
            self._wants_connection = False
            raise
        self._worker = worker

    def _close_current(self, previous: threading.Thread | None) -> None:
        if previous is not None:
            previous.join()
        old, self._current = self._current, None
        if old is not None:
            old.close()

    def _replace(
        self,
        generation: int,
        previous: threading.Thread | None,
        model: RobotModel,
        target: str,
        plant: str,
        setup: RobotConfiguration | None,
        cell: Cell | None,
    ) -> None:
        self._close_current(previous)
        with self._lock:
            if generation != self._generation:
                return
        try:
            with memory_needed():
                if cell is not None:
                    prepare_meshes(cell)  # Takes seconds once, for which the start of the controller does not wait.
                supervisor = Supervisor(model, target, plant, setup=setup, cell=cell)
                self._current = self._shown = supervisor
                supervisor.start()
        except RcilabError as error:
            with self._lock:
                if generation == self._generation:
                    code = failed_start(error)
                    self._failure = SupervisorStatus(phase="crashed", code=code, message=str(error), target=target)
            self._on_failure(error)
            return
        with self._lock:
            if generation == self._generation:
                self._ready = supervisor
