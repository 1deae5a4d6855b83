"""Smoothing of streamed joint angles that arrive at irregular times."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Literal, TypeAlias

from rcilab.core.clock import CYCLE_TIME
from rcilab.sim.planner.stream_curve import StreamCurve

StreamMode: TypeAlias = Literal["direct", "linear", "fit", "filter"]
"""How streamed angles are followed: to standstill at each; on straight lines through them that are rounded over a
period, one period later; on a curve at their mean period, a few periods later; or low-pass filtered."""

_LONGEST_TIME = 0.1  # [s] Time constant of the filter, and length of the mean over the curve, at smoothing 1; tuned.
_MOST_STEPS = 3.0  # Which the joints may be behind the newest target.
_LATE = 1.7  # [periods] A target this late is several steps away, or others follow at once; a tuning value.
_KEPT = 0.9  # Share of a delay that a line to the next target keeps; a tuning value.
_MEAN_OF = 16  # Intervals in the mean period; a tuning value.
_LONGEST_PERIOD = 100  # [cycles] A client that streams more slowly is not streaming.


class StreamFilter:
    """Turns the newest streamed angles into those to follow, cycle by cycle.

    Args:
        q: Joint angles at the start, n plain floats, [rad].
        mode: How they are followed.
        smoothing: From 0 to 1.
    """

    def __init__(self, q: Sequence[float], mode: StreamMode, smoothing: float) -> None:
        self.mode: StreamMode = mode
        self.smoothing = smoothing
        self._target = list(q)
        self._first = self._second = list(q)  # Of the filter's two stages.
        time = smoothing * _LONGEST_TIME
        self._share = CYCLE_TIME / (CYCLE_TIME + 0.5 * time)
        window = max(1, round(time / CYCLE_TIME))
        self._recent = deque([list(q)] * window, window)
        self._sum = [window * x for x in q]
        self._curve = StreamCurve(q)
        self._before = list(q)  # The angles before the newest.
        self._period, self._since = 1, _LONGEST_PERIOD
        self._periods: deque[int] = deque(maxlen=_MEAN_OF)
        self._mean_period = 1.0  # [cycles] Of "linear", which irregular arrivals disturb less.
        self._steps, self._duration = 1.0, 1.0  # Of the straight line, in targets and in cycles.
        self._start, self._output = list(q), list(q)  # Of the straight line.
        self._points_on_line = deque([list(q)], 2 * _LONGEST_PERIOD)
        self._rounded = list(q)
        self._velocity = [0.0] * len(self._target)

    @property
    def is_settled(self) -> bool:
        """Whether its output stays at the newest angles."""
        if self.mode == "filter":
            return max(abs(a - b) for a, b in zip(self._second, self._target, strict=True)) < 1e-9
        if self.mode == "fit":
            return self._curve.cycles_at_end > len(self._recent)
        if self.mode == "linear":
            return self._since > self._duration + self._mean_period + 1.0
        return True

    @property
    def velocity(self) -> list[float]:
        """Velocities of the output of "linear", n plain floats, [rad/s]."""
        return list(self._velocity)

    @property
    def output(self) -> list[float]:
        """Where the straight line to the newest angles is, n plain floats, [rad]."""
        return self._output

    def take(self, q: Sequence[float], shortest: float = 0.0) -> None:
        """Takes the newest angles, n numbers, [rad].

        Args:
            q: The angles.
            shortest: Least duration of the straight line to them, [cycles].
        """
        self._period = min(max(1, self._since), _LONGEST_PERIOD)
        left = self._steps * max(0.0, 1.0 - self._since / self._duration)
        late = self._since / self._mean_period if self._periods else 1.0  # In periods.
        if self._since < _LONGEST_PERIOD:
            self._periods.append(self._since)
            self._mean_period = max(1.0, sum(self._periods) / len(self._periods))
        else:  # The first angles, to which the joints move at once.
            self._periods.clear()
            self._mean_period = late = 1.0
        # A target that comes early does not make the joints faster: they still have a part of the last step to go. Nor
        # does a late one.
        self._steps = max(min(1.0 + left, _MOST_STEPS), late if late > _LATE else 1.0)
        self._duration = max(shortest, self._mean_period * (1.0 + _KEPT * (self._steps - 1.0)))
        self._since = 0
        self._start = self._output
        self._before, self._target = self._target, list(q)
        if self.mode == "fit":
            self._curve.take(self._target)

    def step(self) -> list[float]:
        """Returns the angles to follow in this cycle, n plain floats, [rad]."""
        if self.mode == "direct":
            return self._target
        if self.mode == "linear":
            self._since += 1
            u = min(1.0, self._since / self._duration)
            self._output = [a + u * (b - a) for a, b in zip(self._start, self._target, strict=True)]
            return self._round(self._output)
        if self.mode == "filter":
            return self._filtered()
        return self._mean(self._curve.step())

    def _round(self, q: list[float]) -> list[float]:
        """Returns the mean of the straight lines over the last period, and notes its velocity."""
        self._points_on_line.append(q)
        window = min(max(1, round(self._mean_period)), len(self._points_on_line))
        recent = list(self._points_on_line)[-window:]
        before = self._rounded
        self._rounded = q if self.is_settled else [sum(column) / window for column in zip(*recent, strict=True)]
        is_streaming = self._mean_period > 1.0
        self._velocity = [
            (new - old) / CYCLE_TIME if is_streaming else 0.0 for new, old in zip(self._rounded, before, strict=True)
        ]
        return self._rounded

    def _filtered(self) -> list[float]:
        """Returns the output of two low-pass stages, whose input goes from one target to the next in a period."""
        self._since += 1
        u = min(1.0, self._since / self._period)
        share = self._share
        inputs = [a + u * (b - a) for a, b in zip(self._before, self._target, strict=True)]
        self._first = [x + share * (t - x) for x, t in zip(self._first, inputs, strict=True)]
        self._second = [x + share * (t - x) for x, t in zip(self._second, self._first, strict=True)]
        return self._target if self.is_settled else self._second

    def _mean(self, q: list[float]) -> list[float]:
        oldest = self._recent[0]
        self._recent.append(q)
        self._sum = [total + x - y for total, x, y in zip(self._sum, q, oldest, strict=True)]
        if self.is_settled:
            return self._target
        return [total / len(self._recent) for total in self._sum]
