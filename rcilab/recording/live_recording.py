"""Recording of a run: cycles are collected in memory and optionally written to a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.recording.run import Run, build_run, find_delay
from rcilab.recording.run_setup import Setup

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion
    from rcilab.recording.run_file import RunFile

_FIRST_CAPACITY = 4096  # Cycles; doubled when full.
_DELAY_WINDOW = (
    1000  # Cycles in which the play-out delay is searched; longer than any delay, and every motion has started by then.
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunFacts:
    """Facts of a run that are known before its first cycle."""

    plan: Motion | None
    model: RobotModel
    setup: Setup
    cell: Cell | None = None
    """The cell that the motion was checked in; None without one."""


class LiveRecording:
    """Collects the cycles of one run. Owned by one thread; returned arrays are not changed later.

    Args:
        facts: Facts of the run.
        file: File for the cycles; None keeps them in memory only.
    """

    def __init__(self, facts: RunFacts, file: RunFile | None = None) -> None:
        self.facts = facts
        self.file = file
        self._memory: NDArray[np.void] | None = None
        self._count = 0

    def add(self, cycles: NDArray[np.void]) -> None:
        """Adds the cycles that belong to the motion: those from its first command on.

        Raises:
            InvalidValueError: They cannot be written to the file, which is not used any more; they are in memory.
        """
        rows = cycles[np.isfinite(cycles["t"])]
        if not len(rows):
            return
        self._reserve(rows)
        assert self._memory is not None
        self._memory[self._count : self._count + len(rows)] = rows
        self._count += len(rows)
        if self.file is not None:
            file, self.file = self.file, None
            file.add(rows)
            self.file = file

    @property
    def cycles(self) -> NDArray[np.void] | None:
        """All cycles so far, read-only; None before the first."""
        if self._memory is None:
            return None
        rows = self._memory[: self._count]
        rows.flags.writeable = False
        return rows

    @property
    def delay(self) -> int:
        """Cycles between a command and the state that shows it, see `find_delay`."""
        cycles = self.cycles
        if cycles is None:
            return 1
        first = cycles[:_DELAY_WINDOW]
        return find_delay(first["q_c"], first["command"])

    def finish(self, stopped: str | None = None, plan: Motion | None = None) -> Run | None:
        """Ends the recording and returns the run; without any cycle, returns None and deletes the file.

        Args:
            stopped: Why the motion did not reach its end; None if it did.
            plan: The motion as executed, if the speed override was changed during the motion.

        Raises:
            InvalidValueError: The end of the file cannot be written; all cycles before it are in the file.
        """
        file, self.file = self.file, None
        cycles = self.cycles
        if cycles is None:
            if file is not None:
                file.discard()
            return None
        if file is not None:
            file.close(stopped=stopped, plan=plan)
        facts = self.facts
        return build_run(
            cycles,
            plan=plan or facts.plan,
            stopped=stopped,
            model=facts.model,
            setup=facts.setup,
            cell=facts.cell,
            has_speed_override=plan is not None,
        )

    def _reserve(self, rows: NDArray[np.void]) -> None:
        needed = self._count + len(rows)
        if self._memory is None or needed > len(self._memory):
            larger = np.zeros(max(needed, _FIRST_CAPACITY, 2 * self._count), rows.dtype)
            if self._memory is not None:
                larger[: self._count] = self._memory[: self._count]
            self._memory = larger
