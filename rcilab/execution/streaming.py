"""Stream of a motion whose rows can be replaced while it runs: for speed override, pause, or a stop on its path."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.arrays import JointPath
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import Command
from rcilab.core.state import Mode, RobotState
from rcilab.execution.command_builder import build_commander
from rcilab.motion import plan_stop

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

SETTLING = 300  # Cycles that torque mode stays at the end: two time constants of the compliant arm.


class MotionStream:
    """The callback of a prepared motion: row k in controller cycle k. Owned by the control loop's thread.

    Args:
        rows: Joint angles, shape (N, n), [rad].
        mode: Command mode.
        model: The arm, with its tool and load.
        on_cycle: Called with the number of every cycle.
    """

    def __init__(
        self, rows: JointPath, mode: Mode, model: RobotModel, on_cycle: Callable[[int], None] | None = None
    ) -> None:
        self._rows = rows
        self._first = 0  # Cycle of row 0.
        self._holds = False
        self._next: tuple[int, JointPath, bool] | None = None
        self._model = model
        self._command = build_commander(mode, model)
        self._settling = SETTLING if mode == "torque" else 0
        self._on_cycle = on_cycle
        self.cycle = 0
        """Cycle of the newest command."""
        self.held = 0
        """Number of cycles for which the arm has been held; 0: it moves."""

    def __call__(self, state: RobotState, t: float) -> Command:
        """Returns the command that answers a state."""
        cycle = self.cycle = round(t / CYCLE_TIME)
        if self._next is not None and cycle >= self._next[0]:
            self._first, self._rows, self._holds = self._next
            self._next = None
        if self._on_cycle is not None:
            self._on_cycle(cycle)
        rows, last = self._rows, len(self._rows) - 1
        row = cycle - self._first
        # With further rows to follow, the arm is held at the last one.
        self.held = row - last if row > last and (self._holds or self._next is not None) else 0
        is_over = not self._holds and self._next is None and row >= last + self._settling
        command = self._command(rows, min(row, last), state)
        return replace(command, finished=True) if is_over else command

    def switch(self, first: int, rows: JointPath, *, holds: bool) -> bool:
        """Replaces the following rows; returns False, without effect, if they do not continue the stream.

        Args:
            first: Cycle of their first row, in the future; they must continue the present rows.
            rows: Shape (N, n), [rad].
            holds: Whether the arm is held in the last row, before the goal.
        """
        if first <= self.cycle + 1 or not self._continues_stream(first, rows):
            return False
        self._next = (first, rows, holds)
        return True

    def _continues_stream(self, first: int, rows: JointPath) -> bool:
        """Returns whether rows continue the stream without a jump: the caller may have planned from outdated rows."""
        start, before, _ = self._next if self._next is not None else (math.inf, self._rows, False)
        if first <= start:
            start, before = self._first, self._rows
        step = rows[0] - before[min(first - 1 - int(start), len(before) - 1)]
        return bool((np.abs(step) <= CYCLE_TIME * self._model.limits.joint.velocity).all())

    def stop(self) -> None:
        """Stops from here, every joint as fast as its limits allow, and ends there.

        For torque mode, which has no commanded position: the reference stops, and the torques make the arm follow it.
        """
        rows, k = self._rows, min(self.cycle - self._first, len(self._rows) - 1)
        before, earlier = rows[max(k - 1, 0)], rows[max(k - 2, 0)]
        dq, ddq = (rows[k] - before) / CYCLE_TIME, (rows[k] - 2.0 * before + earlier) / CYCLE_TIME**2
        stop = plan_stop(self._model.limits.joint, rows[k], dq, ddq).q
        self._rows, self._first, self._holds, self._next = stop, self.cycle, False, None
