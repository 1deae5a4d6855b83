"""What happens during a motion besides moving: outputs that are set, inputs that are awaited, blocks that are left."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError

if TYPE_CHECKING:
    from rcilab.motion.speed_scaling import SpeedScaledMotion

EventKind: TypeAlias = Literal["output", "input", "leave"]

MOST_EVENTS = 500
"""Largest number of events of a motion: all of them go to the control process in one message."""
_ROUNDING = 1e-9  # [s]


@dataclass(frozen=True, slots=True)
class MotionEvent:
    """One event at a time of the plan."""

    kind: EventKind
    """output: it is set, while the arm moves or stands. input: the arm waits until it has the level. leave: if the
    input has the level, the motion continues at `until`, where the arm stands alike."""
    time: float
    """When, in the plan, [s]; the arm stands still there, except for an output."""
    signal: int
    """Number of the output or input, from 0."""
    level: bool
    timeout: float = 0.0
    """Of an input: longest wait, [s]; then the motion ends with an error."""
    until: float = 0.0
    """Of leave: the time in the plan at which the motion continues, [s]."""
    row: int = 0
    """Number of the program's step, from 1; 0: of none."""

    def __post_init__(self) -> None:
        if self.kind not in get_args(EventKind):
            known = ", ".join(get_args(EventKind))
            raise InvalidValueError("kind", self.kind, f"is unknown; known: {known}")
        numbers = (self.time, self.timeout, self.until)
        if not all(math.isfinite(number) and number >= 0.0 for number in numbers):
            raise InvalidValueError("time", numbers, "must be finite and not below 0: time, timeout, until [s]")

    def slowed(self, factor: float) -> MotionEvent:
        """Returns the event of a motion that is slower by a factor."""
        return MotionEvent(
            self.kind, factor * self.time, self.signal, self.level, self.timeout, factor * self.until, self.row
        )


@dataclass(frozen=True, slots=True)
class CycleEvent:
    """An event at a row of a motion that is streamed, with the speed override it has."""

    kind: EventKind
    cycle: int
    """Index of the row."""
    signal: int
    level: bool
    timeout: float
    """[s]"""
    until: int
    """Of leave: index of the row at which the motion continues; -1: not reached, as the motion is held before."""
    row: int


def cycle_events(scaled: SpeedScaledMotion) -> tuple[CycleEvent, ...]:
    """Returns the events of a motion at its rows; those that it does not reach, because it is held, are missing."""
    times, found = scaled.plan_time, list[CycleEvent]()
    for event in scaled.motion.events:
        if event.time > times[-1] + _ROUNDING:
            continue
        found.append(
            CycleEvent(
                event.kind,
                _row(times, event.time),
                event.signal,
                event.level,
                event.timeout,
                _row(times, event.until) if event.until <= times[-1] + _ROUNDING else -1,
                event.row,
            )
        )
    return tuple(found)


def require_events(events: Iterable[MotionEvent], duration: float) -> tuple[MotionEvent, ...]:
    """Returns events in the order of their times.

    Raises:
        InvalidValueError: They are too many, or one of them is not within the motion.
    """
    found = tuple(events)
    if not all(isinstance(event, MotionEvent) for event in found):
        raise InvalidValueError("events", found, "must be a list of MotionEvent(...)")
    if len(found) > MOST_EVENTS:
        problem = f"are too many: a motion has at most {MOST_EVENTS}; use fewer repetitions or rounds"
        raise InvalidValueError("events", len(found), problem).coded("most_events", most=MOST_EVENTS)
    for event in found:
        if max(event.time, event.until) > duration + CYCLE_TIME:
            raise InvalidValueError("events", event.time, f"is after the end of the motion, {duration:.3f} s")
    return tuple(sorted(found, key=lambda event: event.time))


def event_rows(events: tuple[MotionEvent, ...]) -> Array:
    """Returns events as numbers for a file, shape (E, 7)."""
    kinds = get_args(EventKind)
    rows = [(kinds.index(e.kind), e.time, e.signal, e.level, e.timeout, e.until, e.row) for e in events]
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


def events_in(rows: ArrayLike) -> tuple[MotionEvent, ...]:
    """Returns the events of `event_rows`.

    Raises:
        InvalidValueError: The numbers are not valid.
    """
    table = np.asarray(rows, dtype=np.float64)
    kinds = get_args(EventKind)
    if table.ndim != 2 or table.shape[1] != 7 or not np.isfinite(table).all():
        raise InvalidValueError("events", table.shape, "must have 7 finite numbers each")
    if len(table) and not (set(table[:, 0].tolist()) <= set(range(len(kinds))) and (table[:, [2, 6]] >= 0.0).all()):
        raise InvalidValueError("events", table[:, 0].tolist(), "have an unknown kind or number")
    return tuple(
        MotionEvent(kinds[int(kind)], time, int(signal), bool(level), timeout, until, int(row))
        for kind, time, signal, level, timeout, until, row in table.tolist()
    )


def _row(times: Array, time: float) -> int:
    """Returns the first row that is not before a time in the plan."""
    return min(int(np.searchsorted(times, time - _ROUNDING)), len(times) - 1)
