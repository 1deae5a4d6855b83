"""How fast the motion under way runs, and where its rows lie in the shared block."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.control_process.layout import MOTION_ROWS, MOTION_TIME, ControlBlock
from rcilab.control_process.pending_request import PendingRequest
from rcilab.core.errors import PlanningError, RcilabError, UsageError
from rcilab.core.state import Mode
from rcilab.motion.speed_scaling import SpeedScaledMotion

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

LEADS = (120, 400, 1500, 5000)  # Cycles from now on which another pace begins: what planning it may take.
HANDING_OVER = 40  # Cycles between now and the first row that is exchanged.
_ANSWER = 0.5  # [s] for the control process to take a change; it looks for letters in every cycle.
_LATEST = 5  # Cycles that the control process needs at least to hear of it.


@dataclass(frozen=True, slots=True)
class HandedOver:
    """Rows in the block that the control process reads from a cycle on."""

    first: int
    """Cycle of the first one."""
    place: int
    count: int


class SpeedOverride:
    """Plans changes of pace for the motion under way. `plan` may take a tenth of a second and is called without a lock.

    Args:
        block: Where rows are handed over.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._block = block
        self._planning = threading.Lock()
        self._model: RobotModel | None = None
        self._in_use: list[HandedOver] = []
        self.paced: SpeedScaledMotion | None = None
        """The motion under way, or the last one."""
        self.mode: Mode = "joint_position"
        self._before: tuple[PendingRequest, SpeedScaledMotion | None, list[HandedOver]] | None = None

    def begin(self, paced: SpeedScaledMotion, model: RobotModel, mode: Mode) -> None:
        """Takes note of a motion that begins and writes its rows into the block, from the first place on.

        Raises:
            PlanningError: There is no room: at its pace the motion lasts too long.
        """
        rows = paced.q
        if len(rows) > MOTION_ROWS:
            raise _too_long(paced)
        self._block.motion[: len(rows)] = rows
        self._in_use = [HandedOver(0, 0, len(rows))]
        self.paced, self._model, self.mode = paced, model, mode
        self._before = None

    def plan(self, pace: float, lead: int, cycle: int) -> SpeedScaledMotion:
        """Returns the motion under way with another pace.

        Args:
            pace: From 0, to be held, to 1.
            lead: Cycles from now on which it may begin.
            cycle: The motion's cycle now.

        Raises:
            UsageError: No motion was begun.
            PlanningError: There is no such change.
        """
        from rcilab.conformance.speed_scaling_check import plan_pace

        with self._planning:
            self._await_answer()
            if self.paced is None or self._model is None:
                raise UsageError("no motion runs whose pace could change").coded("no_pace")
            return plan_pace(self.paced, cycle + lead, pace, self._model, self.mode)

    def hand_over(self, changed: SpeedScaledMotion, cycle: int) -> HandedOver | None:
        """Writes the rows of a change where nobody reads just now; None when it is too late for that.

        Raises:
            PlanningError: There is no room: the motion would last too long.
        """
        first = min(cycle + HANDING_OVER, changed.changed)  # What was to change before goes along.
        if first < cycle + _LATEST:
            return None
        begun = [rows for rows in self._in_use if rows.first <= cycle]
        used = [*begun[-1:], *(rows for rows in self._in_use if rows.first > cycle)]
        tail = changed.q[first:]
        place = _free_place(used, len(tail))
        if place is None:
            raise _too_long(changed)
        self._block.motion[place : place + len(tail)] = tail
        return HandedOver(first, place, len(tail))

    def follow(self, ticket: PendingRequest, changed: SpeedScaledMotion, handed: HandedOver) -> None:
        """Takes it that the control process goes on with a change; what it refuses is taken back."""
        self._before = ticket, self.paced, self._in_use
        self._in_use = [*self._in_use[-2:], handed]
        self.paced = changed

    def _await_answer(self) -> None:
        if self._before is None:
            return
        ticket, paced, in_use = self._before
        with suppress(RcilabError):
            ticket.wait(_ANSWER)
        if not ticket.done:
            raise UsageError("the last change of pace is still being handed over; ask again in a moment").coded(
                "pace_again"
            )
        self._before = None
        if ticket.error is not None:
            self.paced, self._in_use = paced, in_use


def _too_long(paced: SpeedScaledMotion) -> PlanningError:
    return PlanningError(
        f"at this pace the motion would last {paced.duration:.0f} s; {MOTION_TIME:g} s at most can be handed over, "
        "less what is being streamed; choose a faster one"
    ).coded("pace_long", duration=f"{paced.duration:.0f}", most=f"{MOTION_TIME:g}")


def _free_place(used: list[HandedOver], count: int) -> int | None:
    """Returns the first place for so many rows between those that are in use; None: there is none."""
    place = 0
    for rows in sorted(used, key=lambda rows: rows.place):
        if place + count <= rows.place:
            return place
        place = max(place, rows.place + rows.count)
    return place if place + count <= MOTION_ROWS else None
