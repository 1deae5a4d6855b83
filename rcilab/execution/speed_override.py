"""The speed override of a streamed motion: plans a change and replaces the rows that are still to be sent."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from rcilab.conformance.speed_scaling_check import plan_speed_override
from rcilab.core.errors import UsageError
from rcilab.core.state import Mode
from rcilab.execution.motion_executor import MotionStream
from rcilab.motion.motion_event import cycle_events
from rcilab.motion.speed_scaling import SpeedScaledMotion

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

LEADS = (120, 400, 1500, 5000)  # Cycles from now until a change begins: the time available for planning it.
HANDOVER = 40  # Cycles from now to the first row that is replaced.

_Result = TypeVar("_Result", covariant=True)


class RowSink(Protocol[_Result]):
    """The rows of the motion in progress."""

    def cycle(self) -> int:
        """Returns the present cycle of the motion.

        Raises:
            UsageError: No motion is in progress.
        """
        ...

    def switch(self, first: int, changed: SpeedScaledMotion) -> _Result | None:
        """Continues with the rows of a changed motion from a cycle on; returns None if it is too late."""
        ...

    def was_refused(self) -> bool:
        """Returns whether the last switch was refused later."""
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
        """Continues with the rows of a changed motion; returns None if it is too late."""
        events = cycle_events(changed)
        return self._stream.switch(first, changed.q[first:], holds=changed.is_held, events=events) or None

    def was_refused(self) -> bool:
        """Returns False: a stream decides at once."""
        return False


class SpeedOverride(Generic[_Result]):
    """Plans changes of speed for the motion in progress. Thread-safe; planning a change takes 10 to 100 ms.

    Args:
        rows: The rows of the motion.
    """

    def __init__(self, rows: RowSink[_Result]) -> None:
        self._rows = rows
        self._lock = threading.Lock()
        self._model: RobotModel | None = None
        self._previous: SpeedScaledMotion | None = None  # Before the last change.
        self.motion: SpeedScaledMotion | None = None
        """The motion in progress, or the last one, with every change so far."""
        self.mode: Mode = "joint_position"

    def begin(self, motion: SpeedScaledMotion, model: RobotModel, mode: Mode) -> None:
        """Registers a new motion."""
        self.motion, self._previous, self._model, self.mode = motion, None, model, mode

    def change(self, factor: float) -> _Result:
        """Changes the speed override, 0 (held) to 1; returns the result of `RowSink.switch`.

        The change is planned on the path and checked by the conditions of the motion's mode before it is streamed.

        Raises:
            PlanningError: The change is not possible within the limits from here; the motion continues unchanged.
            UsageError: No motion is in progress, or this machine is too busy to plan the change in time.
        """
        for lead in LEADS:
            with self._lock:
                if self._rows.was_refused():
                    self.motion = self._previous
                cycle = self._rows.cycle()
                if self.motion is None or self._model is None:
                    raise UsageError("no motion is running whose speed override could change").coded("override_idle")
                changed = plan_speed_override(self.motion, cycle + lead, factor, self._model, self.mode)
                # Rows of an earlier change that has not begun are replaced, too.
                first = min(self._rows.cycle() + HANDOVER, changed.changed)
                result = self._rows.switch(first, changed)
                if result is not None:
                    self._previous, self.motion = self.motion, changed
                    return result
        raise UsageError(
            "this machine is too busy to change the speed override in time; the motion continues unchanged"
        ).coded("too_busy")
