"""Durations of a callback's calls, and the message about a callback that is too slow for the 1 ms cycle."""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME

_LATE_CYCLES = (
    5  # The jitter buffer of a controller does not always absorb such a delay; shorter ones are not reported.
)
_OFTEN = 10  # Number of slow calls from which the callback counts as slow in general.
_FASTER = (
    "it must return within 1 ms: compute in advance or in another thread, and do not sleep, print or read files in it"
)


class CallTimes:
    """Durations of the calls in one motion."""

    def __init__(self) -> None:
        self._slowest, self._slowest_t = 0.0, 0.0
        self._calls, self._slow, self._sum = 0, 0, 0.0

    def add(self, duration: float, t: float) -> None:
        """Records a call.

        Args:
            duration: Its duration, [s].
            t: Its motion time, [s].
        """
        self._calls += 1
        self._sum += duration
        self._slow += duration > CYCLE_TIME
        if duration > self._slowest:
            self._slowest, self._slowest_t = duration, t

    def describe(self) -> str:
        """Returns a message about a callback that delayed the loop, with advice; "" if it was fast enough."""
        if self._slow >= _OFTEN and 2 * self._slow > self._calls:
            mean = self._sum / self._calls
            return (
                f"{self._slow} of {self._calls} calls of the callback took more than 1 ms, {1e3 * mean:.1f} ms on "
                f"average, so that its commands were increasingly late; {_FASTER}"
            )
        if self._slowest < _LATE_CYCLES * CYCLE_TIME:
            return ""
        return (
            f"the callback took {1e3 * self._slowest:.1f} ms at t = {self._slowest_t:.3f} s, and the cycles meanwhile "
            f"had no command in time; {_FASTER}"
        )
