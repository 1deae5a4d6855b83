"""Where the rows of the motion in progress are in the shared block, and the switch to others."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass

from rcilab.control_process.layout import MOTION_ROWS, MOTION_TIME, ControlBlock
from rcilab.control_process.messages import SwitchRows
from rcilab.control_process.pending_request import PendingRequest
from rcilab.core.errors import PlanningError, RcilabError, UsageError
from rcilab.motion.speed_scaling import SpeedScaledMotion

_ANSWER_TIMEOUT = 0.5  # [s] for the control process to take a switch; it looks for requests in every cycle.
_LATEST = 5  # Cycles that the control process needs at least to read a request.


@dataclass(frozen=True, slots=True)
class _Region:
    """Rows in the block that the control process streams from a cycle on."""

    first: int
    """Cycle of the first one."""
    start: int
    """Its index in the block."""
    count: int


class SharedRows:
    """The `RowSink` of a supervisor.

    Args:
        block: Where the rows are.
        lock: Guards the requests.
        read_cycle: Returns the motion's cycle now; raises UsageError when none is in progress.
        send: Sends the request to switch.
    """

    def __init__(
        self,
        block: ControlBlock,
        lock: AbstractContextManager[object],
        read_cycle: Callable[[], int],
        send: Callable[[SwitchRows], PendingRequest],
    ) -> None:
        self._block = block
        self._lock = lock
        self._send = send
        self.cycle = read_cycle
        self._in_use: list[_Region] = []
        self._last: tuple[PendingRequest, list[_Region]] | None = None  # The last switch, and what was in use before.

    def begin(self, motion: SpeedScaledMotion) -> None:
        """Writes the rows of a motion that begins.

        Raises:
            PlanningError: There is no room: at its speed the motion lasts too long.
        """
        rows = motion.q
        if len(rows) > MOTION_ROWS:
            raise _too_long(motion)
        self._block.motion[: len(rows)] = rows
        self._in_use, self._last = [_Region(0, 0, len(rows))], None

    def switch(self, first: int, changed: SpeedScaledMotion) -> PendingRequest | None:
        """Writes the rows of a change where none are streamed now, and requests the switch; None: too late for that.

        Raises:
            PlanningError: There is no room: the motion would last too long.
        """
        with self._lock:
            cycle = self.cycle()
            if first < cycle + _LATEST:
                return None
            begun = [region for region in self._in_use if region.first <= cycle]
            used = [*begun[-1:], *(region for region in self._in_use if region.first > cycle)]
            rows = changed.q[first:]
            start = _find_room(used, len(rows))
            if start is None:
                raise _too_long(changed)
            self._block.motion[start : start + len(rows)] = rows
            pending = self._send(
                SwitchRows(first=first, start=start, rows=len(rows), holds=changed.holds, duration=changed.duration)
            )
            self._last = pending, self._in_use
            self._in_use = [*self._in_use[-2:], _Region(first, start, len(rows))]
            return pending

    def was_refused(self) -> bool:
        """Returns whether the control process refused the last switch; waits for its answer.

        Raises:
            UsageError: The answer has not come yet.
        """
        if self._last is None:
            return False
        pending, in_use = self._last
        with suppress(RcilabError):
            pending.wait(_ANSWER_TIMEOUT)
        if not pending.done:
            raise UsageError("the last change of speed is still being handed over; ask again in a moment").coded(
                "pace_again"
            )
        self._last = None
        if pending.error is None:
            return False
        self._in_use = in_use
        return True


def _too_long(motion: SpeedScaledMotion) -> PlanningError:
    return PlanningError(
        f"at this speed the motion would last {motion.duration:.0f} s; {MOTION_TIME:g} s at most can be handed over, "
        "less what is being streamed; choose a higher one"
    ).coded("pace_long", duration=f"{motion.duration:.0f}", most=f"{MOTION_TIME:g}")


def _find_room(used: list[_Region], count: int) -> int | None:
    """Returns the first index with so many rows free between those in use; None if no gap is large enough."""
    start = 0
    for region in sorted(used, key=lambda region: region.start):
        if start + count <= region.start:
            return start
        start = max(start, region.start + region.count)
    return start if start + count <= MOTION_ROWS else None
