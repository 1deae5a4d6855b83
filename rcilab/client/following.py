"""A prepared motion as a callback: one row of joint angles for every controller cycle."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from rcilab.arrays import JointPath
from rcilab.client.control_loop import Callback
from rcilab.clock import CYCLE_TIME
from rcilab.command import JointPosition
from rcilab.state import RobotState

if TYPE_CHECKING:
    from rcilab.motion import Motion

Progress: TypeAlias = Callable[[float, float], None]
"""`(t, duration)`, both [s]; called about 20 times a second from inside the loop, so it must be quick."""

_PROGRESS_CYCLES = 50


def follow(rows: JointPath, on_cycle: Callable[[int], None] | None = None) -> Callback:
    """Returns the callback that streams prepared joint angles: row k in controller cycle k.

    Args:
        rows: Joint angles, shape (N, n), [rad].
        on_cycle: Told the number of every cycle.
    """
    last = len(rows) - 1

    def callback(state: RobotState, t: float) -> JointPosition:
        cycle = min(round(t / CYCLE_TIME), last)
        if on_cycle is not None:
            on_cycle(cycle)
        return JointPosition(rows[cycle], finished=cycle == last)

    return callback


def report_progress(motion: Motion, progress: Progress | None) -> Callable[[int], None] | None:
    """Returns what tells somebody about 20 times a second, and at the end, how far a motion is; None for nobody."""
    if progress is None:
        return None
    last = len(motion.q) - 1

    def report(cycle: int) -> None:
        if cycle % _PROGRESS_CYCLES == 0 or cycle == last:
            progress(min(cycle * CYCLE_TIME, motion.duration), motion.duration)

    return report
