"""The speed override of a motion that is streamed: changes are planned here and handed to where its rows are read."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from rcilab.conformance.speed_scaling_check import plan_speed_override
from rcilab.core.errors import UsageError
from rcilab.core.state import Mode
from rcilab.execution.streaming import MotionStream
from rcilab.motion.speed_scaling import SpeedScaledMotion

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

LEADS = (120, 400, 1500, 5000)  # Cycles from now on which a change may begin: the time that planning it may take.
HANDOVER = 40  # Cycles between now and the first row that is exchanged.

_Handed = TypeVar("_Handed", covariant=True)


class RowSink(Protocol[_Handed]):
    """Where the rows of the motion in progress are streamed from."""

    def cycle(self) -> int:
        """Returns the motion's cycle now.

        Raises:
            UsageError: No motion is in progress.
        """
        ...

    def switch(self, first: int, changed: SpeedScaledMotion) -> _Handed | None:
        """Continues with the rows of a changed motion from a cycle on; None: too late for that."""
        ...

    def was_refused(self) -> bool:
        """Returns whether the last switch was refused after all."""
        ...


class StreamRows:
    """The rows of a `MotionStream` in this process.

    Args:
        stream: The stream.
    """

    def __init__(self, stream: MotionStream) -> None:
        self._stream = stream

    def cycle(self) -> int:
        """Returns the stream's cycle."""
        return self._stream.cycle

    def switch(self, first: int, changed: SpeedScaledMotion) -> bool | None:
        """Continues with the rows of a changed motion; None: too late for that."""
        return self._stream.switch(first, changed.q[first:], holds=changed.is_held) or None

    def was_refused(self) -> bool:
        """Returns False: a stream decides at once."""
        return False


class SpeedOverride(Generic[_Handed]):
    """Plans changes of speed for the motion in progress. Thread-safe; a change takes some 10 to 100 ms to plan.

    Args:
        rows: Where the motion's rows are streamed from.
    """

    def __init__(self, rows: RowSink[_Handed]) -> None:
        self._rows = rows
        self._planning = threading.Lock()
        self._model: RobotModel | None = None
        self._previous: SpeedScaledMotion | None = None  # Before the last change.
        self.motion: SpeedScaledMotion | None = None
        """The motion in progress, or the last one, with every change so far."""
        self.mode: Mode = "joint_position"

    def begin(self, motion: SpeedScaledMotion, model: RobotModel, mode: Mode) -> None:
        """Registers a motion that begins."""
        self.motion, self._previous, self._model, self.mode = motion, None, model, mode

    def change(self, factor: float) -> _Handed:
        """Continues at another part of the planned speed, from 0 (held) to 1; returns what the sink gave.

        The change is planned along the path and checked by the conditions of the motion's mode before any of it is
        streamed.

        Raises:
            PlanningError: There is no change within the limits from here; the motion goes on as it is.
            UsageError: No motion is in progress, or this machine is too busy to plan the change in time.
        """
        for lead in LEADS:
            with self._planning:
                if self._rows.was_refused():
                    self.motion = self._previous
                cycle = self._rows.cycle()
                if self.motion is None or self._model is None:
                    raise UsageError("no motion runs whose speed could change").coded("no_pace")
                changed = plan_speed_override(self.motion, cycle + lead, factor, self._model, self.mode)
                first = min(self._rows.cycle() + HANDOVER, changed.changed)  # What was to change before goes along.
                handed = self._rows.switch(first, changed)
                if handed is not None:
                    self._previous, self.motion = self.motion, changed
                    return handed
        raise UsageError(
            "this machine is too busy to change the speed of the motion in time; it goes on as it is"
        ).coded("too_busy")
