"""Writes each motion of a controller's client to a folder: a run, a report and a line for the log."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from rcilab.core.atomic_file import replacing
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.cycle_ring import CycleRing
from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.recording.client_motions import ClientMotions, MotionEnd, MotionPart
from rcilab.recording.client_report import report_on_client
from rcilab.recording.run import load_run
from rcilab.recording.run_file import ENDING, RunFile

_LONGEST = DEFAULT_MAX_ROWS  # [cycles] A longer motion is continued in another file.


class ClientRecorder:
    """Writes the motions of a record. Owned by one thread.

    Args:
        folder: Destination.
        ring: The record.
        show: Called with every line for the log: "recorded" or "not_recorded", and a sentence.
    """

    def __init__(self, folder: Path, ring: CycleRing, show: Callable[[str, str], None]) -> None:
        self._folder, self._show = folder, show
        self._ring = ring
        self._motions = ClientMotions(ring)
        self._is_realtime = bool(ring.facts["realtime"])
        self._file: RunFile | None = None
        self._written = self._part = 0
        self._failed = 0  # Number of the motion whose file cannot be written.
        self._overrun = 0

    def poll(self) -> None:
        """Writes what is new."""
        for part in self._motions.poll():
            self._add(part)
        if self._motions.overrun > self._overrun:
            self._show(
                "not_recorded",
                f"{self._motions.overrun - self._overrun} cycles were not recorded: this machine was too busy",
            )
            self._overrun = self._motions.overrun

    def close(self) -> None:
        """Closes the file of a motion in progress."""
        if self._file is not None:
            self._file.close(stopped="the controller was ended")
            self._file = None

    def _add(self, part: MotionPart) -> None:
        number = part.motion.number
        try:
            if len(part.cycles) and number != self._failed:
                if self._file is None:
                    self._file = self._open(part)
                self._file.add(part.cycles)
                self._written += len(part.cycles)
                if self._written >= _LONGEST and part.end is None:
                    self._finish(part, None)
                    self._part += 1
            if part.end is not None:
                if self._file is not None:
                    self._finish(part, part.end)
                elif number != self._failed:
                    why = part.end.stopped or "no command was played"
                    self._show("not_recorded", f"motion {number}, {part.motion.setup.mode}, is not recorded: {why}")
                self._part = 0
        except InvalidValueError as error:
            self._file, self._failed = None, number
            self._show("not_recorded", f"motion {number} is not recorded from here on: {error}")

    def _open(self, part: MotionPart) -> RunFile:
        motion = part.motion
        stamp = time.strftime("%Y%m%d-%H%M%S", time.localtime(motion.setup.started_ns * 1e-9))
        suffix = f"-part{self._part + 1}" if self._part else ""
        name = f"{stamp}-{motion.number:03d}-{motion.model.name}-{motion.setup.mode}{suffix}{ENDING}"
        self._written = 0
        return RunFile(
            self._folder / name,
            cycle_dtype(self._ring.n, complete=True, playout=True),
            plan=None,
            model=motion.model,
            setup=motion.setup,
            realtime=self._is_realtime,
        )

    def _finish(self, part: MotionPart, end: MotionEnd | None) -> None:
        file, self._file = self._file, None
        assert file is not None
        file.close(stopped=None if end is None else end.stopped)
        run = load_run(file.path, max_rows=2 * _LONGEST)
        found = report_on_client(run, end, f"motion {part.motion.number} of {part.motion.client}")
        target = file.path.with_suffix(".txt")
        try:
            with replacing(target) as stream:
                stream.write(found.text.encode())
        except OSError as error:
            self._show("not_recorded", f"{target} cannot be written: {error.strerror}")
        self._show("recorded", f"{found.line}; {file.path}")
