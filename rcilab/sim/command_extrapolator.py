"""Extrapolation of a command stream over missing commands."""

from __future__ import annotations

from collections.abc import Sequence

_DISTANCE_RATIO = 4.0  # Between the nearer and the farther prediction, so that a jerk is not decisive; a tuning value.
_LONGEST = 50  # [cycles] The longest gap in which a cubic follows a motion; the path over a longer one is straight.


class CommandExtrapolator:
    """The last three commands of a motion, as vectors of numbers. Owned by a motion generator.

    Attributes:
        last: The last command, or its replacement.

    Args:
        start: The stationary arm at the start of the motion.
    """

    def __init__(self, start: Sequence[float]) -> None:
        self.last = self._before = self._oldest = list(start)

    def take(self, values: Sequence[float]) -> None:
        """Appends the command of this cycle, or its replacement."""
        self._oldest, self._before, self.last = self._before, self.last, list(values)

    def predict(self, steps: int, target: Sequence[float] | None = None, target_steps: int = 1) -> list[float]:
        """Returns the extrapolated command after a number of cycles.

        Without a target the acceleration is constant. With one, the jerk is constant and leads to it.

        Args:
            steps: Cycles from now.
            target: A known command of a later cycle.
            target_steps: Cycles from now to the target.
        """
        curvature = steps * (steps + 1) / 2.0
        extrapolated = [
            x + steps * (x - y) + curvature * (x - 2.0 * y + z)
            for x, y, z in zip(self.last, self._before, self._oldest, strict=True)
        ]
        if target is None:
            return extrapolated
        # Newton's form of the cubic through the last three commands and the target, at cycles -2, -1, 0, target_steps.
        share = steps * (steps + 1) * (steps + 2) / (target_steps * (target_steps + 1) * (target_steps + 2))
        at_target = self.predict(target_steps)
        return [x + share * (goal - y) for x, goal, y in zip(extrapolated, target, at_target, strict=True)]

    def bridge(self, target: Sequence[float], steps: int) -> list[list[float]]:
        """Takes and returns the commands between the last one and a known one, `_LONGEST` at most.

        Args:
            target: The known command; it is left to `take`.
            steps: Cycles from the last command to it.
        """
        if steps <= _LONGEST:
            # As `predict` with this target, but with its differences computed once: all of it is done in one cycle.
            full = steps * (steps + 1) * (steps + 2)
            terms = [
                (x, x - y, (x - 2.0 * y + z) / 2.0, (goal - far) / full)
                for x, y, z, goal, far in zip(
                    self.last, self._before, self._oldest, target, self.predict(steps), strict=True
                )
            ]
            factors = [(k, k * (k + 1), k * (k + 1) * (k + 2)) for k in range(1, steps)]
            between = [[x + k * v + k2 * c + k3 * j for x, v, c, j in terms] for k, k2, k3 in factors]
        else:
            velocity = [(x - y) / steps for x, y in zip(target, self.last, strict=True)]
            between = [
                [x - left * v for x, v in zip(target, velocity, strict=True)] for left in range(_LONGEST - 1, 0, -1)
            ]
        for values in between:
            self.take(values)
        return between

    def is_next(self, values: Sequence[float], steps: int, in_doubt: bool = False) -> bool:
        """Returns whether a command continues the stream by one step rather than by `steps`.

        Args:
            values: The command.
            steps: More than 1.
            in_doubt: The result if neither is clearly nearer. A step that is too small disturbs a motion less than one
                that is too large, so it is false unless there is another reason for one step.
        """
        near, far = self.predict(1), self.predict(steps)
        off_near = sum(abs(a - b) for a, b in zip(values, near, strict=True))
        off_far = sum(abs(a - b) for a, b in zip(values, far, strict=True))
        return off_near <= _DISTANCE_RATIO * off_far if in_doubt else _DISTANCE_RATIO * off_near <= off_far
