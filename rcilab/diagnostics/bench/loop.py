"""The 1 kHz loop of the control process while pages are open, measured together with stalls of the machine."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.check import check
from rcilab.control_process import Supervisor, SupervisorStatus
from rcilab.control_process.jitter_histogram import LATE_AFTER
from rcilab.core.errors import DeadlineError
from rcilab.diagnostics.bench.compute import motion_of
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.workbench.app import Workbench

_TIMEOUT = 60.0  # [s]
_RECOVERY_TIME = 8e-3  # [s] After a slip of the robot's clock, for which cycles count as late (execution.recorder).
_POLL_INTERVAL = 5e-3  # [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Streamed:
    """Result of a streamed motion."""

    duration: float
    """[s]."""
    before: SupervisorStatus
    after: SupervisorStatus
    success: float
    """Lowest success rate during the motion."""
    pages: int
    """Smallest number of open pages during the motion."""
    rows: NDArray[np.void]
    """Every cycle."""
    stalls: CpuStallMonitor

    @property
    def late(self) -> int:
        """Cycles that were late by more than 1 ms."""
        return self.after.late_cycles - self.before.late_cycles

    @property
    def lost(self) -> int:
        """Cycles that were lost."""
        return self.after.lost_cycles - self.before.lost_cycles

    @property
    def is_clean(self) -> bool:
        """Whether no cycle was late or lost."""
        return self.late == 0 and self.lost == 0 and self.success >= 1.0

    @property
    def explained(self) -> int:
        """Late cycles that coincide with a stall of the machine."""
        late = self.rows[self.rows["lateness"] > LATE_AFTER]
        moments = 1e-9 * np.where(late["sent_ns"] > 0, late["sent_ns"], late["received_ns"])
        # A late cycle began at its deadline, and cycles after a slip of the robot's clock also count as late.
        return int(self.stalls.explains(moments, late["lateness"] + _RECOVERY_TIME).sum())

    def describe_timing(self) -> str:
        """Returns the timing of the loop as text."""
        lateness = self.after.lateness
        return (
            f"p50 {lateness.p50:.0f}, p99 {lateness.p99:.0f}, p99.9 {lateness.p999:.0f}, max {lateness.max:.0f} us; "
            f"{self.late} late by more than 1 ms, {self.lost} lost, success rate {self.success:.4f}"
        )

    def describe_stalls(self) -> str:
        """Returns the stalls of the machine as text, with the number of late cycles that they explain."""
        chance = self.stalls.explains(1e-9 * self.rows["received_ns"], _RECOVERY_TIME).mean()
        long = self.stalls.pauses[:, 1] - self.stalls.pauses[:, 0]
        return (
            f"the machine itself: a core stalled for more than 1 ms {int((long > LATE_AFTER).sum())} times, "
            f"{1e3 * long.max(initial=0.0):.1f} ms at most; {self.explained} of {self.late} late cycles coincide with "
            f"such or a shorter stall (any cycle: {chance:.0%}); time stolen by the hypervisor: "
            f"{1e3 * self.stalls.stolen:.0f} ms"
        )


def stream(bench: Workbench, supervisor: Supervisor, seconds: float) -> Streamed:
    """Streams a motion of about this duration, [s], from the arm's position."""
    supervisor.reconnect().wait(_TIMEOUT)  # Counters start with the connection.
    wait_for("the connection", lambda: supervisor.status().phase == "idle")
    supervisor.power_on().wait(_TIMEOUT)
    model, before = bench.store.state.model, supervisor.status()
    assert before.q_c is not None
    motion = motion_of(model, seconds, before.q_c)
    certificate = check(motion, model, start=before.q_c).require().certificate
    assert certificate is not None  # Every conforming report has one.
    reader = supervisor.open_reader()
    reader.drain()
    rows: list[NDArray[np.void]] = []
    success, fewest_pages = 1.0, len(bench.server.get_clients())
    with CpuStallMonitor() as stalls:
        # The benchmark acts as the operator: a page with software rendering can be silent for longer than the
        # operator's timeout. This starts only here, because on a busy machine the monitor can take longer to start.
        supervisor.set_operator_present(True)
        request = supervisor.execute(motion, certificate)
        while not request.done:
            supervisor.set_operator_present(True)
            status = supervisor.status()
            if status.motion_time:
                success = min(success, status.success_rate)
            fewest_pages = min(fewest_pages, len(bench.server.get_clients()))
            rows.append(reader.drain())
            time.sleep(0.1)
        request.wait(0.0)
        after = supervisor.status()
    rows.append(reader.drain())
    return Streamed(
        duration=motion.duration, before=before, after=after, success=success, pages=fewest_pages,
        rows=np.concatenate(rows), stalls=stalls,
    )  # fmt: skip


def wait_for(
    what: str, condition: Callable[[], bool], timeout: float = _TIMEOUT, *, interval: float = _POLL_INTERVAL
) -> None:
    """Waits until a condition is true.

    Args:
        what: Name of the condition, for the error.
        condition: The condition.
        timeout: Timeout, [s].
        interval: Time between two evaluations, [s]; it is part of a measured wait.

    Raises:
        DeadlineError: It did not become true.
    """
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise DeadlineError(f"bench: waited {timeout:g} s for {what}; check `rcilab doctor`, then try again")
        time.sleep(interval)
