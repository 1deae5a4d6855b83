"""A path of the tool as a callback, one pose per controller cycle, and reports of progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition
from rcilab.core.state import RobotState
from rcilab.execution.control_loop import Callback

if TYPE_CHECKING:
    from rcilab.motion import Motion
    from rcilab.motion.path import Path

Progress: TypeAlias = Callable[[float, float], None]
"""`(t, duration)`, both [s]; called about 20 times a second from inside the loop, so it must be quick."""

_PROGRESS_CYCLES = 50


def follow_poses(path: Path, shares: Array, with_psi: bool, on_cycle: Callable[[int], None] | None = None) -> Callback:
    """Returns the callback that streams a path of the tool: the pose at share k in controller cycle k.

    Args:
        path: The path.
        shares: From 0 to 1, shape (N,).
        with_psi: Whether to send the arm angle; if not, the controller holds its own.
        on_cycle: Called with the number of every cycle.
    """
    last = len(shares) - 1

    def callback(state: RobotState, t: float) -> CartesianPosition:
        cycle = min(round(t / CYCLE_TIME), last)
        if on_cycle is not None:
            on_cycle(cycle)
        pose, psi = path.at(float(shares[cycle]))
        return CartesianPosition(pose.matrix, psi if with_psi else None, finished=cycle == last)

    return callback


def report_progress(motion: Motion, progress: Progress | None) -> Callable[[int], None] | None:
    """Returns a function that reports the progress about 20 times a second and at the end, or None."""
    if progress is None:
        return None
    last = len(motion.q) - 1

    def report(cycle: int) -> None:
        if cycle % _PROGRESS_CYCLES == 0 or cycle == last:
            progress(min(cycle * CYCLE_TIME, motion.duration), motion.duration)

    return report
