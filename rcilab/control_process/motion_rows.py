"""The rows of the motion in progress in the shared block, and their replacement."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass

from rcilab.control_process.layout import MOTION_ROWS, MOTION_TIME, ControlBlock
from rcilab.control_process.messages import SwitchRows
from rcilab.control_process.pending_request import PendingRequest
from rcilab.core.errors import PlanningError, RcilabError, UsageError
from rcilab.motion.speed_scaling import SpeedScaledMotion

_REPLY_TIMEOUT = 0.5  # [s] For the control process to handle a switch; it polls requests in every cycle.
_MIN_LEAD = 5  # Cycles that the control process needs to read a request.


@dataclass(frozen=True, slots=True)
class _Region:
    """A range of rows in the block, with the cycle of its first row."""

    first: int
    """Cycle of the first row."""
    start: int
    """Index of the first row in the block."""
    count: int


class SharedRows:
    """The `RowSink` of a supervisor.

    Args:
        block: The shared block.
        lock: Guards the requests.
        read_cycle: Returns the present cycle of the motion; raises UsageError if none is in progress.
        send: Sends a `SwitchRows` request.
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
        self._last: tuple[PendingRequest, list[_Region]] | None = None  # The last switch, and the regions before it.

    def begin(self, motion: SpeedScaledMotion) -> None:
        """Writes the rows of a new motion.

        Raises:
            PlanningError: The region is too small: at this speed the motion takes too long.
        """
        rows = motion.q
        if len(rows) > MOTION_ROWS:
            raise _too_long_error(motion)
        self._block.motion[: len(rows)] = rows
        self._in_use, self._last = [_Region(0, 0, len(rows))], None

    def switch(self, first: int, changed: SpeedScaledMotion) -> PendingRequest | None:
        """Writes changed rows into a free part of the region and requests the switch; None: it is too late for that.

        Raises:
            PlanningError: No free part is large enough: the motion would take too long.
        """
        with self._lock:
            cycle = self.cycle()
            if first < cycle + _MIN_LEAD:
                return None
            started = [region for region in self._in_use if region.first <= cycle]
            used = [*started[-1:], *(region for region in self._in_use if region.first > cycle)]
            rows = changed.q[first:]
            start = _find_room(used, len(rows))
            if start is None:
                raise _too_long_error(changed)
            self._block.motion[start : start + len(rows)] = rows
            pending = self._send(
                SwitchRows(first=first, start=start, rows=len(rows), holds=changed.is_held, duration=changed.duration)
            )
            self._last = pending, self._in_use
            self._in_use = [*self._in_use[-2:], _Region(first, start, len(rows))]
            return pending

    def was_refused(self) -> bool:
        """Returns whether the control process refused the last switch; waits for the reply.

        Raises:
            UsageError: The reply has not arrived yet.
        """
        if self._last is None:
            return False
        pending, in_use = self._last
        with suppress(RcilabError):
            pending.wait(_REPLY_TIMEOUT)
        if not pending.done:
            raise UsageError("the last change of the speed override is still being sent; try again").coded("pace_again")
        self._last = None
        if pending.error is None:
            return False
        self._in_use = in_use
        return True


def _too_long_error(motion: SpeedScaledMotion) -> PlanningError:
    return PlanningError(
        f"at this speed override the motion would take {motion.duration:.0f} s, and at most {MOTION_TIME:g} s, less "
        "the part in progress, can be sent; choose a higher one"
    ).coded("pace_long", duration=f"{motion.duration:.0f}", most=f"{MOTION_TIME:g}")


def _find_room(used: list[_Region], count: int) -> int | None:
    """Returns the first index of `count` free rows; None if no gap is large enough."""
    start = 0
    for region in sorted(used, key=lambda region: region.start):
        if start + count <= region.start:
            return start
        start = max(start, region.start + region.count)
    return start if start + count <= MOTION_ROWS else None
