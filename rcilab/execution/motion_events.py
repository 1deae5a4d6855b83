"""The events of a streamed motion: outputs leave in their cycle, and the arm stands until an input has its level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import DeadlineError
from rcilab.makers.driver import SignalRequest
from rcilab.motion.motion_event import CycleEvent

READ_CYCLES = 10
"""Cycles between two readings of an input."""
ANSWER_TIME = 5.0
"""Longest time for the controller's answer, [s]."""


class SignalPort(Protocol):
    """The digital signals of a controller, during a motion."""

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """See `StreamingDriver`."""
        ...


@dataclass(frozen=True, slots=True)
class SignalListener:
    """What is called when signals change or are awaited; called from inside the loop, so it must be quick."""

    on_output: Callable[[int, bool], object]
    """Called with number and level of an output that was set."""
    on_await: Callable[[int | None], object]
    """Called with the number of the input that is awaited from now on; None: none."""


SILENT = SignalListener(lambda signal, level: None, lambda signal: None)


class EventQueue:
    """Runs the events of one motion. Owned by the control loop's thread.

    Args:
        events: In the order of their cycles.
        port: The signals of the controller.
        names: Names of its inputs, for errors.
        listener: See `SignalListener`.
    """

    def __init__(
        self,
        events: Sequence[CycleEvent],
        port: SignalPort,
        names: Sequence[str] = (),
        listener: SignalListener = SILENT,
    ) -> None:
        self._events, self._port, self._names, self._listener = tuple(events), port, names, listener
        self._done = 0  # Number of events that are over, or skipped.
        self._outputs: list[tuple[SignalRequest, int, int, bool]] = []  # With cycle, number and level.
        self._reading: SignalRequest | None = None
        self._began: int | None = None  # Controller cycle in which the wait for the next event began.
        self._asked = 0  # Controller cycle of the last reading.

    @property
    def is_waiting(self) -> bool:
        """Whether the arm stands because of an input."""
        return self._began is not None

    @property
    def is_settled(self) -> bool:
        """Whether no answer is awaited."""
        return not self._outputs and self._reading is None

    def exchange(self, events: Sequence[CycleEvent]) -> None:
        """Takes the cycles of the same events after a change of speed."""
        self._events = tuple(events)

    def advance(self, cycle: int, now: int) -> int:
        """Returns the cycle of the motion to stream: the given one, that of an event that lasts, or one further on.

        Args:
            cycle: The motion's cycle if nothing is awaited.
            now: The controller's cycle, which always advances.

        Raises:
            DeadlineError: An input has not had its level in time, or the controller has not answered.
            CommandRejectedError: The controller refuses.
        """
        self._settle_outputs(now)
        while self._done < len(self._events) and self._events[self._done].cycle <= cycle:
            event = self._events[self._done]
            if event.kind == "output":
                request = self._port.ask_signal(event.signal, event.level)
                self._outputs.append((request, now, event.signal, event.level))
                self._done += 1
                continue
            level = self._read(event, now)
            if level is None or (level is event.level and event.kind == "leave" and event.until < 0):
                return event.cycle
            if level is event.level and event.kind == "leave":
                self._end_wait()
                cycle = event.until
                while self._done < len(self._events) and self._events[self._done].cycle < cycle:
                    self._done += 1
                continue
            if level is event.level or event.kind == "leave":
                self._end_wait()
                self._done += 1
                cycle = event.cycle
                continue
            if self._began is not None and (now - self._began) * CYCLE_TIME >= event.timeout:
                raise self._late(event)
            return event.cycle
        return cycle

    def _read(self, event: CycleEvent, now: int) -> bool | None:
        """Returns the level of an event's input if an answer has just arrived; asks again after some cycles."""
        if self._began is None:
            self._began = now
            self._listener.on_await(event.signal)
        elif self._reading is None and now - self._asked < READ_CYCLES:
            return None
        if self._reading is None:
            self._reading, self._asked = self._port.ask_signal(event.signal), now
        level = self._reading.poll()
        if level is not None:
            self._reading = None
        elif (now - self._asked) * CYCLE_TIME > ANSWER_TIME:
            raise _no_answer("the request for an input")
        return level

    def _end_wait(self) -> None:
        self._began = None
        self._listener.on_await(None)

    def _settle_outputs(self, now: int) -> None:
        for entry in tuple(self._outputs):
            request, since, signal, level = entry
            if request.poll() is not None:
                self._outputs.remove(entry)
                self._listener.on_output(signal, level)
            elif (now - since) * CYCLE_TIME > ANSWER_TIME:
                raise _no_answer("the request for an output")

    def _late(self, event: CycleEvent) -> DeadlineError:
        name = self._names[event.signal] if event.signal < len(self._names) else str(event.signal)
        wanted = "on" if event.level else "off"
        step = f"step {event.row}: " if event.row else ""
        self._end_wait()
        error = DeadlineError(
            f"{step}input {name} was not {wanted} within {event.timeout:g} s, so the program ended there; look at the "
            "device, or allow more time"
        )
        facts = {"number": event.row, "signal": name, "seconds": f"{event.timeout:g}"}
        return error.coded("input_not_on", **facts) if event.level else error.coded("input_not_off", **facts)


def _no_answer(what: str) -> DeadlineError:
    return DeadlineError(
        f"the controller did not answer {what} within {ANSWER_TIME:g} s; look whether it is busy or hangs"
    ).coded("no_answer", command=what, seconds=f"{ANSWER_TIME:g}")
