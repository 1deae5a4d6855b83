"""The record of a virtual controller, cut into the motions of its client."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.cycle_ring import CycleRing
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.recording.run_setup import Setup

LAG = 300
"""[cycles] Rows this young are left for the next poll: their commands may still arrive."""
_BEFORE = 512  # [cycles] A first command answers a state that is at most so old: the vendor's client has a buffer.


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


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionPart:
    """Cycles of a motion, in order; the last part has its end."""

    motion: ClientMotion
    cycles: NDArray[np.void]
    """From the state on that the first played command answers, with the time `t` since then, shape (N,)."""
    end: MotionEnd | None = None


class ClientMotions:
    """Reads the record of a controller from now on. Owned by one thread.

    Args:
        ring: The record.
        lag: Rows that are left for the next poll, see `LAG`; fewer for a display.
    """

    def __init__(self, ring: CycleRing, lag: int = LAG) -> None:
        self._ring, self._lag = ring, lag
        self._reader = ring.open_reader()
        self._reader.skip()
        self._next_event = len(ring.events(0))
        facts = ring.facts
        self._model = load_model(facts["model"])
        self._facts = facts
        self._waiting: NDArray[np.void] = np.zeros(0, cycle_dtype(ring.n, complete=True, playout=True))
        self._motion: ClientMotion | None = None
        self._cycle = -1  # Of the next row since the first command; -1 before it is known.

    @property
    def overrun(self) -> int:
        """Cycles that were overwritten before they were read."""
        return self._reader.overrun

    @property
    def model(self) -> RobotModel:
        """The arm, without tool and load."""
        return self._model

    def poll(self) -> list[MotionPart]:
        """Returns the new parts of motions, oldest first."""
        events = self._ring.events(self._next_event)
        self._next_event += len(events)
        ended = max((event["rows"] for event in events if event["event"] == "end"), default=0)
        rows = self._reader.drain(max(self._reader.count - self._lag, ended))
        self._waiting = np.concatenate([self._waiting, rows])
        parts: list[MotionPart] = []
        for event in events:
            if event["event"] == "begin":
                self._motion, self._cycle = self._begun(event), -1
            elif self._motion is not None and event["motion"] == self._motion.number:
                parts.append(MotionPart(motion=self._motion, cycles=self._take(), end=_end(event)))
                self._motion = None
        if self._motion is not None:
            cycles = self._take()
            if len(cycles):
                parts.append(MotionPart(motion=self._motion, cycles=cycles))
        else:
            self._waiting = self._waiting[-_BEFORE:]
        return parts

    def _take(self) -> NDArray[np.void]:
        """Returns the waiting rows of the motion, with their times."""
        assert self._motion is not None
        rows = self._waiting
        of_motion = np.flatnonzero(rows["motion"] == self._motion.number)
        if not of_motion.size:
            return rows[:0]
        start, end = int(of_motion[0]), int(of_motion[-1]) + 1
        if self._cycle < 0:
            played = np.flatnonzero(rows["played"][:end])
            played = played[played >= start]
            if not played.size:
                return rows[:0]
            first = int(played[0])
            start, self._cycle = max(first - int(rows["age"][first]), 0), 0
        taken = rows[start:end].copy()
        taken["t"] = CYCLE_TIME * (self._cycle + np.arange(len(taken)))
        self._cycle += len(taken)
        self._waiting = rows[end:]
        return taken

    def _begun(self, event: dict[str, Any]) -> ClientMotion:
        mass, center, inertia = event["load"]
        load = Payload(mass=mass, center_of_mass=np.array(center), inertia=np.array(inertia))
        setup = Setup(
            target=self._facts["url"],
            plant=self._facts["plant"],
            mode=event["mode"],
            started_ns=event["wall_ns"],
            client=event["client"],
            settings=event["settings"],
        )
        model = self._model.with_tool(Pose.from_row_major(event["tool"])).with_load(load)
        return ClientMotion(number=event["motion"], client=event["client"], model=model, setup=setup)


def _end(event: dict[str, Any]) -> MotionEnd:
    counts = {name: event[name] for name in ("received", "lost", "most_lost", "late", "dropped", "duplicates")}
    return MotionEnd(stopped=Remark.from_dict(event["stopped"]) if event["stopped"] else None, **counts)
