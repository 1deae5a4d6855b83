"""Writes each motion of a controller's client to a folder: a run, a report and a line for the log."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

from rcilab.core.atomic_file import replacing
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.cycle_ring import CycleRing, RingCounter
from rcilab.core.errors import RcilabError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.recording.client_motions import ClientMotion, ClientMotions, MotionEnd, MotionPart
from rcilab.recording.client_report import report_on_client
from rcilab.recording.run import load_run
from rcilab.recording.run_file import ENDING, RunFile

_LONGEST = DEFAULT_MAX_ROWS  # [cycles] A longer motion is continued in another file.
_CUT = "this file ends here, the motion went on"
_OVERWRITTEN = "overwritten before they were read: the recorder was stopped, or the machine too busy"


class ClientRecorder:
    """Writes the motions of a record. Owned by one thread; another one writes the reports.

    Args:
        folder: Destination; created again if it is gone.
        ring: The record.
        show: Called with every line for the log, from both threads: "recorded" or "not_recorded", and a sentence.
    """

    def __init__(self, folder: Path, ring: CycleRing, show: Callable[[str, str], None]) -> None:
        self._folder, self._show = folder, show
        self._ring = ring
        self._motions = ClientMotions(ring)
        self._is_realtime = bool(ring.facts["realtime"])
        self._file: RunFile | None = None
        self._motion: ClientMotion | None = None
        self._last = 0  # Number of the last motion that was seen.
        self._written = self._part = 0  # Cycles in the file; files of this motion before it.
        self._is_continued = False  # The file begins in mid-motion.
        self._failed = 0  # Number of the motion whose file cannot be written.
        self._reports = ThreadPoolExecutor(1, "reports")

    def poll(self) -> None:
        """Writes what is new."""
        for part in self._motions.poll():
            self._add(part)
        self._ring.counters[RingCounter.READ] = self._motions.position

    def close(self) -> None:
        """Writes the rest, also of a motion in progress, and waits for the reports."""
        try:
            for part in self._motions.poll(is_last=True):
                self._add(part)
            self._finish(stopped="the controller was ended")
        except RcilabError as error:
            self._show("not_recorded", str(error))
        self._reports.shutdown()

    def _add(self, part: MotionPart) -> None:
        motion = part.motion
        try:
            if motion is not self._motion:
                self._finish(stopped=_CUT)
                self._begin(motion)
            if part.skipped:
                self._finish(stopped=_CUT)
                self._show("not_recorded", self._describe_gap(part))
            if len(part.cycles) and motion.number != self._failed:
                if self._file is None:
                    self._file = self._open(motion, is_continued=self._part > 0 or part.skipped > 0)
                self._file.add(part.cycles)
                self._written += len(part.cycles)
                if self._written >= _LONGEST and part.end is None:
                    self._finish(stopped=_CUT)
            if part.end is not None:
                if self._part == 0 and self._file is None and motion.number != self._failed and not part.skipped:
                    why = "no command was played" + (f"; {part.end.stopped}" if part.end.stopped else "")
                    text = f"motion {motion.number}, {motion.setup.motion_kind}, is not recorded: {why}"
                    self._show("not_recorded", text)
                self._finish(part.end, stopped=part.end.stopped)
        except RcilabError as error:
            file, self._file, self._failed = self._file, None, motion.number
            kept = file is not None and file.path.exists()
            rest = f"is recorded up to {_last_time(file.path):.3f} s only" if file and kept else "is not recorded"
            self._show("not_recorded", f"motion {motion.number} {rest}: {error}")

    def _describe_gap(self, part: MotionPart) -> str:
        where = "at its end" if self._part else "which were all of it,"
        if len(part.cycles):
            start = part.cycles["t"][0]
            where = f"before {start:.3f} s" if start > 0.0 else "at its beginning"
        number = part.motion.number
        if not (self._part or len(part.cycles) or part.skipped == part.length):
            unread = f"{part.skipped} of its {part.length} cycles were {_OVERWRITTEN}"
            return f"motion {number} is not recorded: in what was read no command was played; {unread}"
        return f"motion {number}: {part.skipped} cycles {where} are not recorded; they were {_OVERWRITTEN}"

    def _begin(self, motion: ClientMotion) -> None:
        between = range(self._last + 1, motion.number)
        if self._last and between:
            numbers = f"{between[0]} to {between[-1]}" if len(between) > 1 else str(between[0])
            self._show("not_recorded", f"motion {numbers}: not recorded; the cycles were {_OVERWRITTEN}")
        self._motion, self._last, self._part = motion, motion.number, 0

    def _open(self, motion: ClientMotion, *, is_continued: bool) -> RunFile:
        stamp = time.strftime("%Y%m%d-%H%M%S", time.localtime(motion.setup.started_ns * 1e-9))
        suffix = f"-part{self._part + 1}" if self._part else ""
        name = f"{stamp}-{motion.number:03d}-{motion.model.name}-{motion.setup.motion_kind}{suffix}"
        self._written = 0
        self._is_continued = is_continued
        for copy in count(1):  # Another controller may record in this folder, too.
            path = self._folder / f"{name}{f'-{copy}' if copy > 1 else ''}{ENDING}"
            try:
                return RunFile(
                    path,
                    cycle_dtype(self._ring.n, complete=True, playout=True),
                    is_new=True,
                    plan=None,
                    model=motion.model,
                    setup=motion.setup,
                    realtime=self._is_realtime,
                )
            except FileExistsError:
                continue
        raise AssertionError

    def _finish(self, end: MotionEnd | None = None, *, stopped: str | None = None) -> None:
        """Closes the file, if one is open, and has its report written."""
        file = self._file
        if file is None or self._motion is None:
            return
        self._part += 1
        cut = ", without its beginning" if self._is_continued else ""
        name = f"motion {self._motion.number} of {self._motion.client}{cut}"
        file.close(stopped=stopped, truncated=self._is_continued)
        self._file = None
        self._reports.submit(self._report, file.path, None if self._is_continued else end, name)

    def _report(self, path: Path, end: MotionEnd | None, name: str) -> None:
        try:
            found = report_on_client(load_run(path, max_rows=2 * _LONGEST), end, name)
            target = path.with_suffix(".txt")
            with replacing(target) as stream:
                stream.write(found.text.encode())
        except OSError as error:
            self._show("not_recorded", f"the report on {name} cannot be written: {error.strerror}; {path}")
        except RcilabError as error:
            self._show("not_recorded", f"there is no report on {name}: {error}")
        else:
            self._show("recorded", f"{found.line}; {path}")


def _last_time(path: Path) -> float:
    """Returns the time of the last cycle in a file whose end could not be written, [s]; 0 without a cycle."""
    try:
        t = load_run(path, max_rows=2 * _LONGEST).t
    except RcilabError:
        return 0.0
    return float(t[-1]) if len(t) else 0.0
