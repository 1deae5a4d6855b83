"""The 1 kHz loop of the control process while pages are open: measured together with the machine's own pauses."""

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

_PATIENCE = 60.0  # [s]
_MEMORY = 8e-3  # [s] For how long after a slip of the robot's clock a cycle counts as late (client.recorder).
_LOOK = 5e-3  # [s] How often something is looked at that is waited for.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Streamed:
    """The result of a motion that was streamed cycle by cycle."""

    duration: float
    """[s]."""
    before: SupervisorStatus
    after: SupervisorStatus
    success: float
    """Lowest success rate on the way."""
    pages: int
    """Fewest pages that were open at any time."""
    rows: NDArray[np.void]
    """Every cycle."""
    watch: CpuStallMonitor

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
        """Late cycles that fall together with a pause of the machine itself."""
        late = self.rows[self.rows["lateness"] > LATE_AFTER]
        moments = 1e-9 * np.where(late["sent_ns"] > 0, late["sent_ns"], late["received_ns"])
        # A late cycle began at its due time, and a slip of the robot's clock is counted for some cycles afterwards.
        return int(self.watch.explains(moments, late["lateness"] + _MEMORY).sum())

    def tell_loop(self) -> str:
        """Returns the loop's timing as text."""
        lateness = self.after.lateness
        return (
            f"p50 {lateness.p50:.0f}, p99 {lateness.p99:.0f}, p99.9 {lateness.p999:.0f}, max {lateness.max:.0f} us; "
            f"{self.late} late by more than 1 ms, {self.lost} lost, success rate {self.success:.4f}"
        )

    def tell_machine(self) -> str:
        """Returns the machine's own pauses as text, and how many of the late cycles they explain."""
        chance = self.watch.explains(1e-9 * self.rows["received_ns"], _MEMORY).mean()
        long = self.watch.pauses[:, 1] - self.watch.pauses[:, 0]
        return (
            f"the machine by itself: a core stood still for more than 1 ms {int((long > LATE_AFTER).sum())} times, "
            f"{1e3 * long.max(initial=0.0):.1f} ms at most; {self.explained} of {self.late} late cycles fall together "
            f"with such or a shorter pause (any cycle: {chance:.0%}); the hypervisor says that it kept "
            f"{1e3 * self.watch.stolen:.0f} ms"
        )


def stream(bench: Workbench, supervisor: Supervisor, seconds: float) -> Streamed:
    """Streams a motion of about this length, [s], from where the arm stands."""
    supervisor.reconnect().wait(_PATIENCE)  # Counters start with the connection.
    wait_for("the connection", lambda: supervisor.status().phase == "idle")
    supervisor.power_on().wait(_PATIENCE)
    model, before = bench.store.state.model, supervisor.status()
    assert before.q_c is not None
    motion = motion_of(model, seconds, before.q_c)
    certificate = check(motion, model, start=before.q_c).require().certificate
    assert certificate is not None  # A report that is ok has one.
    reader = supervisor.open_reader()
    reader.drain()
    rows: list[NDArray[np.void]] = []
    success, fewest_pages = 1.0, len(bench.server.get_clients())
    with CpuStallMonitor() as watch:
        # The bench is at the controls: a page that is drawn in software can be silent for longer than an operator may
        # be. Only said from here on: on a busy machine it may take longer than that until the watch stands.
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
        rows=np.concatenate(rows), watch=watch,
    )  # fmt: skip


def wait_for(what: str, condition: Callable[[], bool], patience: float = _PATIENCE, *, look: float = _LOOK) -> None:
    """Waits until a condition is true.

    Args:
        what: What is waited for, in words.
        condition: Returns whether it is true.
        patience: How long it may take, [s].
        look: How often to look, [s]; where the wait is measured, that is part of it.

    Raises:
        DeadlineError: It did not become true.
    """
    deadline = time.monotonic() + patience
    while not condition():
        if time.monotonic() > deadline:
            raise DeadlineError(f"bench: waited {patience:g} s for {what}; look at `rcilab doctor`, then try again")
        time.sleep(look)
