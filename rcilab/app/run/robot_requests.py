"""Requests to the robot that await an answer, and the recording of the motion that one of them executes."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.app.run.run_recorder import RunRecorder
from rcilab.core.errors import ControlError, RcilabError
from rcilab.recording.run import describe_end

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rcilab.app.app_state import AppState
    from rcilab.app.connection import Connection
    from rcilab.app.planning import Plan
    from rcilab.app.state_store import StateStore
    from rcilab.control_process import PendingRequest
    from rcilab.motion.speed_scaling import SpeedScaledMotion
    from rcilab.recording.run import Run


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """The end of a request."""

    what: str
    """Name of the request, such as "execute", "power_on" or "reboot"."""
    error: RcilabError | None = None
    run: Run | None = None
    """The run of "execute", if the arm moved."""
    is_operator_absent: bool = False
    """Whether the motion was stopped because no page answered."""

    @property
    def record(self) -> NDArray[np.void] | None:
        """The last cycles, from the flight recorder; None if nothing moved."""
        record = getattr(self.error, "record", None)
        return record if record is not None else None if self.run is None else self.run.cycles


class RobotRequests:
    """Used by one thread, or under a lock; it never waits for the robot.

    Args:
        store: Shows the recording.
        connection: The robot.
    """

    def __init__(self, store: StateStore[AppState], connection: Connection) -> None:
        self._store, self._connection = store, connection
        self._pending: list[tuple[str, PendingRequest]] = []
        self._recorder = RunRecorder(store)

    def add(self, what: str, request: PendingRequest) -> None:
        """Adds a request; `collect` reports its end."""
        self._pending.append((what, request))

    def is_pending(self, what: str) -> bool:
        """Returns whether a request of this name awaits its answer."""
        return any(name == what for name, _ in self._pending)

    def execute(self, plan: Plan, *, stops: int | None = None) -> None:
        """Executes a checked plan with the speed override of the state, and records it.

        Args:
            plan: A plan that conforms.
            stops: Number of stops of the robot at the operator's request; None: the current number.

        Raises:
            CertificateError: The plan does not fit the arm's position, or its tool and load.
            ConformanceError: The plan does not conform.
            PlanningError: With this speed override it would violate a condition.
            UsageError: The arm moves, or was stopped meanwhile.
        """
        certificate = plan.report.require().certificate
        assert certificate is not None  # A report that is ok has one.
        robot, speed_override = self._connection.robot(), self._store.state.drive.speed_override
        robot.drain()
        self.add(
            "execute", robot.execute(plan.motion, certificate, plan.mode, speed_override=speed_override, stops=stops)
        )
        self._recorder.begin(plan)
        self._store.update(recording=None, last_run=None, playing=False, asked=None)

    def collect(self) -> list[Outcome]:
        """Returns the ends of requests since the last call, and records the motion; call it several times a second."""
        ended: list[tuple[str, PendingRequest]] = []
        waiting: list[tuple[str, PendingRequest]] = []
        for entry in self._pending:
            (ended if entry[1].done else waiting).append(entry)
        self._pending = waiting
        self._record()
        return [self._outcome(what, request.error) for what, request in ended]

    def forget(self, stopped: str | None = None) -> None:
        """Ends the recording and drops requests without an answer: the robot is disconnected.

        Args:
            stopped: Why the motion did not reach its end.
        """
        self._pending = []
        self._recorder.finish(stopped, self._scaled_motion())

    def close(self, stopped: str) -> None:
        """Ends the recording with the current cycles; see `forget`."""
        self._record()
        self.forget(stopped)

    def _outcome(self, what: str, error: RcilabError | None) -> Outcome:
        if what != "execute":
            return Outcome(what=what, error=error)
        is_stopped = isinstance(error, ControlError) and not error.faults
        is_operator_absent = is_stopped and self._connection.status().code == "idle.operator"
        stopped = None if error is None else describe_end(error)
        finding = error.finding if isinstance(error, ControlError) else ""
        run = self._connection.take_run()
        self._recorder.finish(
            stopped, self._scaled_motion(), is_operator_absent=is_operator_absent, finding=finding, run=run
        )
        last = self._store.state.last_run
        return Outcome(
            what=what, error=error, run=None if last is None else last.run, is_operator_absent=is_operator_absent
        )

    def _record(self) -> None:
        with suppress(RcilabError):  # The robot is disconnected.
            self._recorder.add(self._connection.robot().drain(), self._scaled_motion())

    def _scaled_motion(self) -> SpeedScaledMotion | None:
        """Returns how the motion in progress, or the last one, runs; None: as planned."""
        with suppress(RcilabError):
            scaled_motion = self._connection.robot().scaled_motion
            return scaled_motion if scaled_motion is not None and scaled_motion.changed else None
        return None
