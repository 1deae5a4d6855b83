"""The log of a controller's phases: power, motions with their figures, hand guiding, safety stops, recoveries."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum
from typing import NamedTuple

from rcilab.conformance.advice import plural
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import FaultCode, name_faults
from rcilab.sim.jitter_buffer import JitterBuffer


class Activity(Enum):
    """What a controller does, as far as the log is concerned."""

    OFF = "the motors are off"
    SAFETY_STOPPED = "a safety stop is pressed"
    READY = "the motors are on"
    MOVING = "a motion of a client is in progress, or stops"
    GUIDING = "the arm is guided by hand"


_UNPOWERED = (Activity.OFF, Activity.SAFETY_STOPPED)


class Situation(NamedTuple):
    """What the log describes the changes of."""

    activity: Activity
    phase: str
    """Name of the maker's phase, such as "idle"."""
    faults: tuple[FaultCode, ...]
    mode: str
    """Control mode of a motion, such as "joint_position"."""
    motion: str
    """A motion as the text names it."""


class PhaseLog:
    """Logs the changes of a controller. Owned by the server's thread.

    Args:
        playout: Its queue of commands, for the figures of a motion.
        log: `ClientLink.log`.
        pressed: Text of a safety stop.
        released: Text of its end.
    """

    def __init__(self, playout: JitterBuffer, log: Callable[..., None], *, pressed: str, released: str) -> None:
        self._playout, self._log = playout, log
        self._pressed, self._released = pressed, released

    def record(self, before: Situation, after: Situation) -> None:
        """Logs what changed; called after every transition."""
        for kind, text in self._changes(before, after):
            self._log(kind, text, phase=after.phase)
        was_moving, is_moving = before.activity is Activity.MOVING, after.activity is Activity.MOVING
        if is_moving and not was_moving:
            self._log("motion_started", f"motion started: {after.motion}", mode=after.mode)
        elif was_moving and not is_moving:
            self._log_end(before, after)

    def _log_end(self, before: Situation, after: Situation) -> None:
        playout, is_new = self._playout, after.faults != before.faults
        is_whole = is_new or not playout.is_streamed  # Up to the stop, not to the last command.
        duration = CYCLE_TIME * (max(playout.cycles - 1, 0) if is_whole else playout.span)
        is_fault = is_new or after.activity in _UNPOWERED
        figures = f"{plural(playout.cycles, 'cycle')}, {playout.lost} without a command"
        figures += f"; {plural(playout.late, 'command')} late"
        if playout.repeated:
            figures += f"; {playout.repeated} answered a state again because the next one came late"
        self._log(
            "motion_ended",
            f"motion {'stopped' if is_fault else 'ended'} after {duration:.3f} s: {figures}",
            duration=round(duration, 3),
            cycles=playout.cycles,
            without_command=playout.lost,
            late=playout.late,
            repeated=playout.repeated,
            is_fault=is_fault,
        )

    def _changes(self, before: Situation, after: Situation) -> Iterator[tuple[str, str]]:
        """Yields kind and text of every change except motions."""
        if before.faults and not after.faults:
            yield "recovered", f"faults cleared: {name_faults(before.faults)}"
        was, now = before.activity, after.activity
        if was is now:
            return
        if now is Activity.SAFETY_STOPPED:
            yield "safety_stop", self._pressed
        elif was is Activity.SAFETY_STOPPED:
            yield "safety_release", self._released
        elif now is Activity.OFF:
            yield "power_off", "motors off"
        elif was is Activity.OFF:
            yield "power_on", "motors on"
        if now is Activity.GUIDING:
            yield "guiding_started", "hand guiding started"
        elif was is Activity.GUIDING:
            yield "guiding_ended", "hand guiding ended"
