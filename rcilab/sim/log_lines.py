"""The log of a controller's loop, which must not block: entries are limited in rate, and a thread writes them."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from rcilab.sim.log_entry import LogEntry, LogFormat

_MAX_QUEUED = 200  # [entries] A tuning value.
_PERIOD = 10.0  # [s] For which entries of a kind that any peer can cause are counted together. A tuning value.
_FOREIGN = 5  # [entries] Per period, of a kind that any machine in the network can cause. A tuning value.
_CLOSE_TIMEOUT = 0.5  # [s] For the last entries at the end of the controller, if they are not read.


class Kind(NamedTuple):
    """A kind of entries."""

    more: str
    """What the entries that were only counted are about, such as "requests were refused"."""
    most: int = 20
    """Largest number of entries that are written per period. A tuning value."""


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "connected": Kind("clients connected"),
        "disconnected": Kind("clients disconnected"),
        "client_lost": Kind("clients were lost during a motion"),
        "client_dropped": Kind("clients were dropped", _FOREIGN),
        "client_refused": Kind("clients were refused", _FOREIGN),
        "states_elsewhere": Kind("connected", 1),
        "unknown_sender": Kind("were ignored", _FOREIGN),
        "bad_datagram": Kind("datagrams of another size were ignored", _FOREIGN),
        "power_on": Kind("times the motors were switched on"),
        "power_off": Kind("times the motors were switched off"),
        "motion_started": Kind("motions started"),
        "motion_ended": Kind("motions ended"),
        "guiding_started": Kind("hand guidings started"),
        "guiding_ended": Kind("hand guidings ended"),
        "hand": Kind("actions of the hand"),
        "set_up": Kind("times the arm was set up"),
        "refused": Kind("requests were refused"),
        "fault": Kind("faults stopped the arm"),
        "advice": Kind("motions lacked commands", 1),
        "waiting": Kind("times lock-step waited for a command", 1),
        "slip": Kind("motions took longer"),
        "safety_stop": Kind("safety stops"),
        "safety_release": Kind("safety stops ended"),
        "recovered": Kind("recoveries"),
        "warning": Kind("warnings"),
        "skipped": Kind("times entries were dropped"),
    }
)
"""Every kind of entry, by its name in the JSON form."""


class LogHandler(logging.Handler):
    """Passes the records of the loggers of the simulation to a controller's log.

    Args:
        log: The log.
    """

    def __init__(self, log: ControllerLog) -> None:
        super().__init__()
        self._log = log

    def emit(self, record: logging.LogRecord) -> None:
        """Writes one record."""
        self._log.write("warning", record.getMessage())


@dataclass(slots=True)
class _Period:
    """Entries of a kind in the current period."""

    end: float  # [s]
    written: int = 0
    counted: int = 0


class ControllerLog:
    """Stamps entries and limits the rate of each kind, because any peer can cause them; the rest is counted.

    Args:
        put: Takes an entry; does not block.
        clock: Returns the time for the periods, [s].
        cycle: Returns the number of the last state.
        wall: Returns the time of day, [s] since the epoch.
    """

    def __init__(
        self,
        put: Callable[[LogEntry], None],
        clock: Callable[[], float],
        cycle: Callable[[], int],
        wall: Callable[[], float] = time.time,
    ) -> None:
        self._put, self._clock, self._cycle, self._wall = put, clock, cycle, wall
        self._periods: dict[str, _Period] = {}

    def write(self, kind: str, text: str, **facts: object) -> None:
        """Writes an entry, or counts it.

        Args:
            kind: One of `KINDS`.
            text: One sentence.
            facts: Its numbers and names.
        """
        self.write_counts()
        seen = self._periods.setdefault(kind, _Period(self._clock() + _PERIOD))
        if seen.written < KINDS[kind].most:
            seen.written += 1
            self._write(kind, text, facts)
        else:
            seen.counted += 1

    def write_counts(self) -> None:
        """Writes how many entries were skipped in each period that is over. Call it periodically."""
        if not self._periods:
            return
        now = self._clock()
        for kind, seen in list(self._periods.items()):
            if now >= seen.end:
                del self._periods[kind]
                if seen.counted:
                    text = f"{seen.counted} more {KINDS[kind].more} within {_PERIOD:g} s"
                    self._write(kind, text, {"count": seen.counted})

    def _write(self, kind: str, text: str, facts: Mapping[str, object]) -> None:
        self._put(LogEntry(kind=kind, text=text, cycle=self._cycle(), wall=self._wall(), facts=facts))


class LogLines:
    """Writes entries as lines to a descriptor. `write` may be called from one thread, and does not block.

    Args:
        descriptor: Descriptor, such as 2. It is used directly: the lock of a stream would delay the end of the
            interpreter while its reader is blocked.
        form: Format of the lines.
    """

    def __init__(self, descriptor: int, form: LogFormat = "text") -> None:
        self._descriptor = descriptor
        self._form: LogFormat = form
        self._entries: deque[LogEntry] = deque()
        self._skipped = 0
        self._wake, self._is_ending = threading.Event(), False
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def write(self, entry: LogEntry) -> None:
        """Queues an entry; a full queue skips it, and a later entry reports the number of skipped ones."""
        if len(self._entries) >= _MAX_QUEUED:
            self._skipped += 1
            return
        if self._skipped:
            text, facts = f"{self._skipped} lines were dropped: the stream was not read", {"count": self._skipped}
            self._entries.append(LogEntry(kind="skipped", text=text, cycle=entry.cycle, wall=entry.wall, facts=facts))
            self._skipped = 0
        self._entries.append(entry)
        self._wake.set()

    def close(self) -> None:
        """Waits briefly until the last lines are written. May be called twice."""
        self._is_ending = True
        self._wake.set()
        self._thread.join(_CLOSE_TIMEOUT)

    def _run(self) -> None:
        while True:
            self._wake.wait()
            self._wake.clear()
            while self._entries:
                data = f"{self._entries.popleft().written(self._form)}\n".encode(errors="replace")
                try:
                    while data:
                        data = data[os.write(self._descriptor, data) :]
                except OSError:  # The reader has closed it.
                    return
            if self._is_ending:
                return
