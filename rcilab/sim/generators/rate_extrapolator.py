"""Commanded velocities over missing commands: a constant acceleration, or the straight way to a known command."""

from __future__ import annotations

from collections.abc import Sequence

_DISTANCE_RATIO = 4.0  # As of `CommandExtrapolator`.


class RateExtrapolator:
    """The last two commanded velocities of a motion, as vectors of numbers. Owned by a motion generator.

    Args:
        n: Length of the vectors; the arm is stationary at the start.
    """

    def __init__(self, n: int) -> None:
        self._last = self._before = [0.0] * n

    def step(self, sent: Sequence[float] | None, steps: int = 1) -> list[float]:
        """Takes and returns the velocities of this cycle.

        Args:
            sent: The command; None: it is missing.
            steps: Cycles until the command is due, 1 for now.
        """
        if sent is None:
            now = self._predict(1)
        else:
            now = [last + (goal - last) / steps for last, goal in zip(self._last, sent, strict=True)]
        self._before, self._last = self._last, now
        return now

    def is_next(self, sent: Sequence[float], steps: int, in_doubt: bool) -> bool:
        """Returns whether a command continues the stream by one step rather than by `steps`.

        As `CommandExtrapolator.is_next`.
        """
        near, far = self._predict(1), self._predict(steps)
        off_near = sum(abs(a - b) for a, b in zip(sent, near, strict=True))
        off_far = sum(abs(a - b) for a, b in zip(sent, far, strict=True))
        return off_near <= _DISTANCE_RATIO * off_far if in_doubt else _DISTANCE_RATIO * off_near <= off_far

    def _predict(self, steps: int) -> list[float]:
        return [last + steps * (last - before) for last, before in zip(self._last, self._before, strict=True)]
