"""The speed of the tool along streamed angles, for a follower that must not pass it to make up for a late target."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import dist, inf

from rcilab.core.clock import CYCLE_TIME
from rcilab.model.robot_model import RobotModel

_INTERVALS = 8  # Of which one is as long as the client meant it: after a stall some are shorter; a tuning value.
_LONGEST_PERIOD = 100  # [cycles] Angles that come later begin another stream.
_FIRST_PERIOD = 4  # [cycles] Assumed before the first angles of a stream.
_INSIDE = 0.99  # Of the bound: the tool's path between two targets is not exactly straight.


class StreamSpeed:
    """Bounds the speed of a tool whose targets themselves are not too fast. Owned by a `StreamMover`.

    Targets that come late, or together, are far apart for the time between them. They are as fast as over the slowest
    of the last intervals, from each of the last targets to the newest. After one that is too fast, as a jump, there is
    no bound until the joints have caught up.

    Args:
        model: The arm with its tool.
        largest: The bound, [m/s].
    """

    def __init__(self, model: RobotModel, largest: float) -> None:
        self.largest = largest
        self._model = model
        self._points: deque[tuple[int, Sequence[float]]] = deque(maxlen=_INTERVALS)  # Cycle and position.
        self._cycle = 0
        self._is_bounded = True

    def step(self) -> None:
        """Advances one cycle."""
        self._cycle += 1

    def reach(self) -> None:
        """Notes that the joints have caught up with the targets."""
        self._is_bounded = True

    def take(self, start: Sequence[float], q: Sequence[float]) -> float:
        """Takes the newest angles, and returns in how many cycles the tool may be there; 0 for targets too fast.

        Args:
            start: Angles from which they are approached, n numbers, [rad].
            q: The newest angles, n numbers, [rad].
        """
        points, position = self._points, self._model.forward(q).parts[1]
        here = self._model.forward(start).parts[1]
        if not points or self._cycle - points[-1][0] > _LONGEST_PERIOD:
            points.clear()
            points.append((self._cycle - _FIRST_PERIOD, here))
        length, speed, end = 0.0, inf, position
        for cycle, point in reversed(points):
            length, end = length + dist(point, end), point
            if cycle < self._cycle:
                speed = min(speed, length / ((self._cycle - cycle) * CYCLE_TIME))
        points.append((self._cycle, position))
        self._is_bounded = self._is_bounded and speed <= self.largest
        return dist(here, position) / (_INSIDE * self.largest * CYCLE_TIME) if self._is_bounded else 0.0

    def share(self, before: Sequence[float], after: Sequence[float]) -> float:
        """Returns the share of a step of one cycle that the tool may move, up to 1.

        Args:
            before: Angles, n numbers, [rad].
            after: Those a cycle later.
        """
        if not self._is_bounded:
            return 1.0
        moved = dist(self._model.forward(before).parts[1], self._model.forward(after).parts[1])
        return min(1.0, self.largest * CYCLE_TIME / moved) if moved > 0.0 else 1.0
