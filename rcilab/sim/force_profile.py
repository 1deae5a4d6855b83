"""The external force over time: it rises and falls linearly in a rise time; with a rise time of 0 it is a step."""

from __future__ import annotations

import math

from rcilab.core.clock import CYCLE_TIME
from rcilab.sim.api import Push

_ZERO = (0.0,) * 6


class ForceProfile:
    """The wrench of one push after another, cycle by cycle. Owned by the environment, which steps it after a cycle.

    Attributes:
        push: The last request.
        wrench: The wrench of the next cycle, [N, N m].
        is_on: Whether a push is active; False while its force falls after a release.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._set(Push(_ZERO), _ZERO, _ZERO)

    def begin(self, push: Push) -> None:
        """Replaces the push; the force changes from the present one, at another link or point from zero."""
        is_same_place = (push.link, push.point) == (self.push.link, self.push.point)
        self._set(push, self.wrench if is_same_place else _ZERO, push.wrench)
        self.is_on = any(push.wrench)

    def release(self) -> None:
        """Ends the push; its force falls in its rise time."""
        self._end(self.wrench)

    def step(self) -> bool:
        """Advances by one cycle; returns whether the wrench has changed."""
        if self._cycle > self._rise and self._length == math.inf:
            return False
        before = self.wrench
        if self._cycle >= self._length:
            self._end(_ZERO)
        else:
            self._advance()
        return self.wrench != before

    def _end(self, start: tuple[float, ...]) -> None:
        self.is_on = False
        self._set(Push(_ZERO, self.push.link, self.push.point, rise_time=self.push.rise_time), start, _ZERO)

    def _set(self, push: Push, start: tuple[float, ...], end: tuple[float, ...]) -> None:
        self.push, self._start, self._end_value = push, start, end
        self._length = math.inf if push.duration is None else round(push.duration / CYCLE_TIME)  # [cycles]
        self._rise = max(1, round(min(push.rise_time / CYCLE_TIME, 0.5 * self._length)))  # [cycles]
        self._cycle = 0
        self._advance()

    def _advance(self) -> None:
        self._cycle += 1
        share = min(1.0, self._cycle / self._rise)
        left = min(1.0, (self._length + 1 - self._cycle) / self._rise)
        pairs = zip(self._start, self._end_value, strict=True)
        self.wrench = tuple(left * ((1.0 - share) * start + share * end) for start, end in pairs)
