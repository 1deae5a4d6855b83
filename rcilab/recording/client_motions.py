"""The record of a virtual controller, cut into the motions of its client."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import RATE_FIELDS, cycle_dtype
from rcilab.core.cycle_ring import CycleRing
from rcilab.core.errors import UsageError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.recording.run_setup import Setup

LAG = 1100
"""[cycles] Rows this young are left for the next poll: their commands may still arrive."""
_SETTLED = 300  # [cycles] After the first played command: all that came in one burst with it have been played.
_ANSWER = (
    "sent_ns", "lateness", "command", "command_pose", "command_psi", "command_tau", "command_number", *RATE_FIELDS,
)  # fmt: skip
_BEFORE = LAG  # [cycles] A first command answers a state that is at most so old: the vendor's client has a buffer.

_PARTS = {
    "begin": {"motion", "row", "mode", "client", "wall_ns", "tool", "load", "settings"},
    "end": {"motion", "row", "stopped"},
}
"""Parts of each event that a reader needs."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ClientMotion:
    """A motion of a client, known when it begins."""

    number: int
    """From 1 since the start of the controller."""
    client: str
    """Address of the client."""
    model: RobotModel
    """The arm with the tool and load in force."""
    setup: Setup
    """Circumstances, with the settings in force."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionEnd:
    """The end of a motion, and the counts of its commands."""

    stopped: Remark | None
    """Why it did not run to its end."""
    received: int
    """Commands that arrived."""
    lost: int
    """Cycles without a command."""
    most_lost: int
    """Most cycles in a row without a command."""
    late: int
    """Commands that came after their cycle."""
    dropped: int
    """Commands that found the queue full."""
    duplicates: int
    """Datagrams that arrived twice."""
    unrecorded: int = 0
    """Commands that came late, were skipped or came before the first played one, and are not in the record."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionPart:
    """Cycles of a motion, in order; the last part has its end."""

    motion: ClientMotion
    cycles: NDArray[np.void]
    """From the state on that the first played command answers, with the time `t` since then, shape (N,)."""
    next: int
    """Number of the row after these in the record."""
    length: int = 0
    """With the end: cycles of the whole motion."""
    end: MotionEnd | None = None
    skipped: int = 0
    """Cycles of the motion right before these that were overwritten before they were read."""


class _Facts(NamedTuple):
    """The controller, as its record describes it."""

    model: str
    plant: str
    url: str

    @classmethod
    def of(cls, ring: CycleRing) -> _Facts:
        """Returns the facts of a record.

        Raises:
            UsageError: One is missing.
        """
        texts = [ring.facts.get(name) for name in cls._fields]
        if not all(isinstance(text, str) for text in texts):
            raise UsageError("the record of the controller is damaged: it does not name its arm, plant and address")
        return cls(*map(str, texts))


class ClientMotions:
    """Reads the record of a controller from now on. Owned by one thread.

    Args:
        ring: The record.
        lag: Rows that are left for the next poll, see `LAG`; fewer for a display, which reads them again: `refresh`.

    Raises:
        UsageError: The record is not that of a known arm.
    """

    def __init__(self, ring: CycleRing, lag: int = LAG) -> None:
        self._ring, self._lag = ring, lag
        self._reader = ring.open_reader()
        events = self._take_events(0)
        in_progress = events[-1] if events and events[-1]["event"] == "begin" else None
        self._reader.skip(None if in_progress is None else max(in_progress["row"] - _BEFORE, 0))
        self._facts = _Facts.of(ring)
        self._model = load_model(self._facts.model)
        self._waiting: NDArray[np.void] = np.zeros(0, cycle_dtype(ring.n, complete=True, playout=True))
        self._first = self._reader.position  # Number of the first waiting row.
        self._motion: ClientMotion | None = None
        self._row = 0  # Number of the first row of the motion.
        self._origin: int | None = None  # Number of its row with t = 0.
        self._is_resumed = False  # Its rows before the waiting ones were overwritten.
        self._cut = 0  # Commands of its rows before t = 0.
        self._gaps: list[range] = []  # Numbers of the rows that were overwritten and are not yet reported.
        if in_progress is not None:
            self._begin(in_progress)

    @property
    def position(self) -> int:
        """Number of rows that were read so far."""
        return self._reader.position

    @property
    def model(self) -> RobotModel:
        """The arm, without tool and load."""
        return self._model

    def poll(self, *, is_last: bool = False) -> list[MotionPart]:
        """Returns the new parts of motions, oldest first.

        Args:
            is_last: Whether no row is left for another poll.
        """
        parts: list[MotionPart] = []
        events = self._take_events(self._next_event)
        self._read(events, 0 if is_last else self._lag, parts)
        for event in events:
            if event["event"] == "begin":
                self._begin(event)
            elif self._motion is not None and event["motion"] == self._motion.number:
                parts.append(self._part(_end(event), event["row"], is_whole=True))
                self._motion = None
        if self._motion is not None:
            part = self._part()
            if len(part.cycles):
                parts.append(part)
        else:
            self._drop(len(self._waiting) - _BEFORE)
        return parts

    def refresh(self, cycles: NDArray[np.void], next: int) -> None:
        """Reads the commands of some cycles again, which may have arrived since, up to those that are overwritten.

        Args:
            cycles: Cycles of a motion, in order, shape (N,); changed in place.
            next: Number of the row after them, `MotionPart.next`.
        """
        rows = self._reader.read(next - len(cycles), next)
        for name in _ANSWER:
            cycles[name][len(cycles) - len(rows) :] = rows[name]

    def _take_events(self, start: int) -> list[dict[str, Any]]:
        """Returns the events from a number on, without those of a damaged record that lack a part."""
        events, self._next_event = self._ring.events(start)
        return [event for event in events if _PARTS.get(str(event.get("event")), {""}) <= event.keys()]

    def _read(self, events: list[dict[str, Any]], lag: int, parts: list[MotionPart]) -> None:
        """Reads new rows. After a gap the waiting ones are a part of their own."""
        ended = max((event["row"] for event in events if event["event"] == "end"), default=0)
        expected = self._reader.position
        rows = self._reader.drain(max(self._reader.count - lag, ended))
        first = self._reader.position - len(rows)
        if first == expected:
            self._waiting = np.concatenate([self._waiting, rows])
            return
        if self._motion is not None:
            part = self._part(is_whole=True)
            if len(part.cycles):
                parts.append(part)
        self._waiting, self._first = rows, first
        self._gaps.append(range(expected, first))
        self._is_resumed = True

    def _part(self, end: MotionEnd | None = None, row: int | None = None, *, is_whole: bool = False) -> MotionPart:
        """Returns the next part of the motion, of which `row` is the first one after its end.

        Args:
            end: The end of the motion; None: it goes on.
            row: Number of the first row after it; None: it goes on.
            is_whole: Whether no more rows can be joined to the waiting ones.
        """
        assert self._motion is not None
        cycles = self._take(is_whole=is_whole)
        skipped = 0
        if len(cycles) or end is not None:
            skipped = sum(len(range(max(gap.start, self._row), min(gap.stop, row or gap.stop))) for gap in self._gaps)
            self._gaps = [range(max(gap.start, row), gap.stop) for gap in self._gaps if row and gap.stop > row]
        length = 0 if row is None else row - self._row
        end = end and replace(end, unrecorded=end.unrecorded + self._cut)
        return MotionPart(motion=self._motion, cycles=cycles, next=self._first, length=length, end=end, skipped=skipped)

    def _take(self, *, is_whole: bool) -> NDArray[np.void]:
        """Returns the waiting rows of the motion, with their times.

        They begin with the oldest row whose command is played: of a burst of answers to earlier states, the first one
        played need not answer the first state.
        """
        assert self._motion is not None
        rows = self._waiting
        of_motion = np.flatnonzero(rows["motion"] == self._motion.number)
        if not of_motion.size:
            return rows[:0]
        start, end = int(of_motion[0]), int(of_motion[-1]) + 1
        if self._origin is None or self._is_resumed:
            played = start + np.flatnonzero(rows["played"][start:end])
            sources = played - rows["age"][played].astype(np.intp)
            is_there = (sources >= 0) & (sources <= played)
            if not is_whole and (not is_there.any() or end - played[0] < _SETTLED):
                return rows[:0]
            if is_there.any():
                start = int(sources[is_there].min())
            elif self._origin is None:
                return rows[:0]
            if self._origin is None:
                self._cut = int((rows["sent_ns"][of_motion[0] : start] != 0).sum())
            self._origin = self._first + start if self._origin is None else self._origin
            self._is_resumed = False
        taken = rows[start:end].copy()
        taken["t"] = CYCLE_TIME * (self._first + start - self._origin + np.arange(len(taken)))
        self._drop(end)
        return taken

    def _drop(self, count: int) -> None:
        """Removes the oldest waiting rows."""
        if count > 0:
            self._waiting, self._first = self._waiting[count:], self._first + count

    def _begin(self, event: dict[str, Any]) -> None:
        self._motion, self._row, self._origin, self._cut = self._begun(event), event["row"], None, 0
        self._is_resumed = self._row < self._first

    def _begun(self, event: dict[str, Any]) -> ClientMotion:
        mass, center, inertia = event["load"]
        load = Payload(mass=mass, center_of_mass=np.array(center), inertia=np.array(inertia))
        setup = Setup(
            target=self._facts.url,
            plant=self._facts.plant,
            mode=event["mode"],
            commands=str(event.get("commands", "")),
            started_ns=event["wall_ns"],
            client=event["client"],
            settings=event["settings"],
        )
        model = self._model.with_tool(Pose.from_row_major(event["tool"])).with_load(load)
        return ClientMotion(number=event["motion"], client=event["client"], model=model, setup=setup)


def _end(event: dict[str, Any]) -> MotionEnd:
    names = ("received", "lost", "most_lost", "late", "dropped", "duplicates", "unrecorded")
    counts = {name: event.get(name, 0) for name in names}
    return MotionEnd(stopped=Remark.from_dict(event["stopped"]) if event["stopped"] else None, **counts)
