"""Speed and acceleration of the tool in a stream of poses: their means, compared with the largest that are set.

Poses come in steps, of 0.001 rad for angles, and at irregular times; over the few milliseconds of a period both would
count as large accelerations. Poses that come late, or together, count as further apart in time, never as closer, than
the mean period, so that a client that was held up is not taken for a fast one.
"""

from __future__ import annotations

from collections import deque
from math import ceil, hypot

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import CartesianLimits
from rcilab.core.rotation import rotation_vector
from rcilab.core.spatial import Pose
from rcilab.makers.realman.bounds import SPEED_ALLOWANCE
from rcilab.makers.realman.conditions import REALMAN_CONDITIONS

_WINDOW = 0.07  # [s] Of a mean; a tuning value. An acceleration to the largest speed takes 0.15 s.
_LONGEST_PERIOD = 100  # [cycles] A longer interval is a pause: the next pose begins another stream.
_LENGTH = 2 * round(_WINDOW / CYCLE_TIME) + 1  # [poses]
_KNOWN = 64  # Intervals in the mean period.
_ROWS = {row.id: row for row in REALMAN_CONDITIONS.cartesian}
_BOUNDS = (
    ("cartesian.velocity.translation", "translation_velocity"),
    ("cartesian.velocity.rotation", "rotation_velocity"),
    ("cartesian.acceleration.translation", "translation_acceleration"),
    ("cartesian.acceleration.rotation", "rotation_acceleration"),
)


class ToolWatch:
    """Observes the poses of a stream. Owned by the drive."""

    def __init__(self) -> None:
        self._intervals: deque[int] = deque(maxlen=_KNOWN)
        self._path: deque[tuple[int, list[float]]] = deque(maxlen=_LENGTH)  # Cycle, and moved so far, [m, rad].
        self._last: Pose | None = None

    def reset(self) -> None:
        """Forgets the stream, as when another one begins."""
        self._intervals.clear()
        self._path.clear()
        self._last = None

    def take(
        self, cycle: int, pose: Pose, limits: CartesianLimits, standing: Pose | None
    ) -> tuple[LimitViolation, ...]:
        """Takes the next pose and returns which bounds the tool exceeds.

        Args:
            cycle: Number of the cycle in which it came.
            pose: Of the tool in base.
            limits: Those of the tool in force.
            standing: Where the tool stands before a stream, in base; None: it moves, and how is not known.
        """
        path = self._path
        if path and cycle - path[-1][0] > _LONGEST_PERIOD:
            self.reset()
        is_first = not path
        if is_first and standing is not None:
            path.extend([(cycle, [0.0] * 6)] * _LENGTH)
            self._last = standing
        if path and self._last is not None:
            if not is_first:
                self._intervals.append(cycle - path[-1][0])
            turned = rotation_vector(self._last.rotation, pose.rotation).tolist()
            moved = [*(pose.position - self._last.position).tolist(), *turned]
            path.append((cycle, [x + dx for x, dx in zip(path[-1][1], moved, strict=True)]))
        else:
            path.append((cycle, [0.0] * 6))
        self._last = pose
        return self._compare(limits)

    def _compare(self, limits: CartesianLimits) -> tuple[LimitViolation, ...]:
        if not self._intervals:
            return ()
        period = max(1.0, sum(self._intervals) / len(self._intervals)) * CYCLE_TIME
        steps = ceil(_WINDOW / period)
        if len(self._path) <= steps:
            return ()
        shortest = steps * period
        v, time = self._mean_velocity(len(self._path) - 1, steps, shortest)
        values = [hypot(*v[:3]), hypot(*v[3:])]
        if len(self._path) > 2 * steps:
            before, time_before = self._mean_velocity(len(self._path) - 1 - steps, steps, shortest)
            dv = [(b - a) / (0.5 * (time + time_before)) for a, b in zip(before, v, strict=True)]
            values += [hypot(*dv[:3]), hypot(*dv[3:])]
        return tuple(
            LimitViolation(_ROWS[name], 0, value, bound)
            for (name, limit), value in zip(_BOUNDS, values, strict=False)
            if value > (bound := SPEED_ALLOWANCE * getattr(limits, limit))
        )

    def _mean_velocity(self, end: int, steps: int, shortest: float) -> tuple[list[float], float]:
        """Returns the mean twist over the last poses up to one, and its time, [s], at least `shortest`."""
        (first, start), (last, here) = self._path[end - steps], self._path[end]
        time = max(shortest, (last - first) * CYCLE_TIME)
        return [(b - a) / time for a, b in zip(start, here, strict=True)], time
