"""The log of a controller's phases: power, motions with their figures, hand guiding, safety stops, recoveries."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import name_faults
from rcilab.core.state import ControllerMode
from rcilab.makers.rokae.controller.state_machine import Phase
from rcilab.makers.rokae.faults import Fault
from rcilab.sim.jitter_buffer import JitterBuffer

_POWERED = (Phase.IDLE, Phase.STARTING, Phase.MOVING, Phase.STOPPING, Phase.GUIDING, Phase.REFLEX, Phase.RECOVERING)
_IN_MOTION = (Phase.MOVING, Phase.STOPPING)


class Situation(NamedTuple):
    """What the log describes the changes of."""

    phase: Phase
    faults: tuple[Fault, ...]
    controller_mode: ControllerMode
    """As shown in the states."""


class PhaseLog:
    """Logs the changes of a controller. Owned by the server's thread.

    Args:
        playout: Its queue of commands, for the figures of a motion.
        log: `ClientLink.log`.
    """

    def __init__(self, playout: JitterBuffer, log: Callable[..., None]) -> None:
        self._playout, self._log = playout, log

    def record(self, before: Situation, after: Situation) -> None:
        """Logs what changed; called after every transition."""
        for kind, text in _changes(before, after):
            self._log(kind, text, phase=after.phase.name.lower())
        was_moving, is_moving = before.phase in _IN_MOTION, after.phase in _IN_MOTION
        if is_moving and not was_moving:
            mode = after.controller_mode.name.lower()
            self._log("motion_started", f"motion started: {mode.replace('_', ' ')}", mode=mode)
        elif was_moving and not is_moving:
            self._log_end(before, after)

    def _log_end(self, before: Situation, after: Situation) -> None:
        playout, is_new = self._playout, after.faults != before.faults
        duration = CYCLE_TIME * (max(playout.cycles - 1, 0) if is_new else playout.span)  # Up to the stop.
        is_fault = is_new or after.phase is not Phase.IDLE
        figures = f"{playout.cycles} cycles, {playout.lost} without a command; {playout.late} commands late"
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


def _changes(before: Situation, after: Situation) -> Iterator[tuple[str, str]]:
    """Yields kind and text of every change except motions."""
    if before.faults and not after.faults:
        yield "recovered", f"faults cleared: {name_faults(before.faults)}"
    if before.phase is after.phase:
        return
    if after.phase is Phase.USER_STOPPED:
        yield "safety_stop", "a safety stop was pressed: the motors are off"
    elif before.phase is Phase.USER_STOPPED:
        yield "safety_release", "the safety stop was released; the motors stay off"
    elif before.phase in _POWERED and after.phase not in _POWERED:
        yield "power_off", "motors off"
    elif before.phase not in _POWERED and after.phase in _POWERED:
        yield "power_on", "motors on"
    if after.phase is Phase.GUIDING:
        yield "guiding_started", "hand guiding started"
    elif before.phase is Phase.GUIDING:
        yield "guiding_ended", "hand guiding ended"
