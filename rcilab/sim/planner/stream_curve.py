"""A curve along streamed points, at the mean period of their arrival: a point that comes early or late changes nothing.

It is the uniform cubic B-spline of the points. A few of them wait, so that the next one is there when it is needed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

_FIRST_PERIOD = 5.0  # [cycles] Until `_FEWEST` intervals are known.
_LONGEST_PERIOD = 100  # [cycles] A longer interval is a pause.
_FEWEST = 3  # Intervals of which a mean is taken.
_KNOWN = 64  # Intervals in their mean: an arrival that is off by a cycle changes it little.
_BACKLOG = 3  # Points that wait, with parts of one for the times until the next one is needed and arrives.
_GAIN = 0.02  # Share by which the curve is faster for each point more that waits; tuned.
_LARGEST_CHANGE = 0.1
_SHARE = 0.02  # Of a new change that counts in a cycle.
_WHOLE = 0.3  # [cycles] A mean that is closer to a whole number is that number.
_ENDS = 2  # Repetitions of the last point until the curve ends there.


class StreamCurve:
    """Owned by a `StreamFilter`.

    Attributes:
        cycles_at_end: Cycles since the curve has reached the last point; 0: it has not.

    Args:
        q: Joint angles at the start, n plain floats, [rad].
    """

    def __init__(self, q: Sequence[float]) -> None:
        self.cycles_at_end = 1
        self._stands = True
        self._points = [list(q)] * 4  # The curve is between the second and the third.
        self._phase = 1.0  # From the second to the third.
        self._waiting: deque[list[float]] = deque()
        self._repeated = _ENDS  # How often the last point was repeated, because none waited.
        self._change = 0.0  # Of the velocity along the curve, because of the points that wait.
        self._intervals: deque[int] = deque(maxlen=_KNOWN)
        self._since = _LONGEST_PERIOD + 1  # Cycles since the newest point.

    def take(self, q: list[float]) -> None:
        """Takes the newest point, n plain floats, [rad]."""
        if self._since <= _LONGEST_PERIOD:
            self._intervals.append(self._since)
        self._since = self.cycles_at_end = 0
        self._waiting.append(q)

    def step(self) -> list[float]:
        """Returns the next point of the curve, n plain floats, [rad]."""
        self._since += 1
        if self._stands and not self._may_begin:
            self.cycles_at_end += not self._waiting
            return list(self._points[-1])
        self._stands = False
        self._phase += self._next_rate()
        if self._phase >= 1.0:
            self._go_on()
        return self._value(min(self._phase, 1.0))

    @property
    def _period(self) -> float:
        known = self._intervals
        if len(known) < _FEWEST:
            return _FIRST_PERIOD
        mean = max(1.0, sum(known) / len(known))
        return float(round(mean)) if abs(mean - round(mean)) < _WHOLE else mean

    @property
    def _may_begin(self) -> bool:
        """Whether enough points wait, or no more come."""
        waiting = len(self._waiting)
        return waiting >= _BACKLOG or (waiting > 0 and self._since >= _BACKLOG * self._period)

    def _next_rate(self) -> float:
        """Returns the part of a section that is passed in this cycle."""
        period = self._period
        backlog = len(self._waiting) + 1.0 - self._phase + min(self._since / period, 1.0)
        change = min(max(_GAIN * (backlog - _BACKLOG), -_LARGEST_CHANGE), _LARGEST_CHANGE)
        self._change += _SHARE * (change - self._change)
        return (1.0 + self._change) / period

    def _go_on(self) -> None:
        if self._waiting:
            self._points, self._repeated = [*self._points[1:], self._waiting.popleft()], 0
            self._phase -= 1.0
        elif self._repeated < _ENDS:
            self._points, self._repeated = [*self._points[1:], self._points[-1]], self._repeated + 1
            self._phase -= 1.0
        else:
            self._phase, self._stands, self.cycles_at_end = 1.0, True, 1

    def _value(self, u: float) -> list[float]:
        left = 1.0 - u
        a = left * left * left / 6.0
        b = (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0
        c = (3.0 * left * left * left - 6.0 * left * left + 4.0) / 6.0
        d = u * u * u / 6.0
        return [a * p + b * q + c * r + d * s for p, q, r, s in zip(*self._points, strict=True)]
