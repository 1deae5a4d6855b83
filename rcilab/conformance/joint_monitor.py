"""Check of commanded joint angles, cycle by cycle, in plain floats."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from operator import sub

from rcilab.conformance.bounds_table import BoundsTable
from rcilab.conformance.common_conditions import JOINT_CONDITIONS
from rcilab.conformance.divided_differences import EVEN_TIMES, difference_times
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits

_ROUNDING = 1e-9  # Of the distance from the ends beyond which a velocity bound is constant.


class JointMonitor:
    """Checks one commanded position per cycle by the same rows as `check`, with the same arithmetic.

    Owned by the thread that runs the cycle. It allocates four short lists.

    After a gap in the commands the differences are Newton's divided differences over the actual number of cycles. They
    are weighted means of the differences of the complete sequence, so a conforming motion never violates a bound
    because of a gap, whichever commands are missing.

    Attributes:
        q: Last commanded joint angles, [rad].
        dq: Their first backward difference over one cycle, [rad/s].
        ddq: The second, [rad/s^2].
        jerk: The third, [rad/s^3].
        is_even: Whether the last differences are over single cycles, without a gap.

    Args:
        limits: Bounds of the joints. The monitor starts at standstill at zero; `reset` sets another state.
        rows: The conditions on position, velocity, acceleration and jerk. The common ones raise no fault; those of a
            maker's table do, see `faults_of`.
    """

    def __init__(self, limits: JointLimits, rows: Sequence[Condition] = JOINT_CONDITIONS) -> None:
        self._n = len(limits.velocity)
        self._rows = BoundsTable(rows, limits)
        self._ends = _EndBounds(limits, rows)
        self.reset([0.0] * self._n)

    def reset(self, q: Sequence[float], dq: Sequence[float] | None = None, ddq: Sequence[float] | None = None) -> None:
        """Restarts the history at `q`, at standstill or with the given backward differences.

        Args:
            q: Joint angles, n numbers, [rad].
            dq: First backward difference, n numbers, [rad/s]; None is standstill.
            ddq: Second backward difference, n numbers, [rad/s^2]; None is zero.

        Raises:
            InvalidValueError: Not n numbers.
        """
        self.q = self._numbers(q, "q")
        self.dq = self._numbers(dq, "dq") if dq is not None else [0.0] * self._n
        self.ddq = self._numbers(ddq, "ddq") if ddq is not None else [0.0] * self._n
        self.jerk = [0.0] * self._n
        self.is_even = True
        self._spacing = (1, 1)

    def step(self, q_c: Sequence[float], cycles: int = 1) -> list[LimitViolation]:
        """Checks the commanded angles of this cycle and returns their violations, in the order of the rows.

        NaN violates every condition. The history advances in any case; after a violation the caller must `reset`.

        Args:
            q_c: Commanded joint angles, at least n numbers, [rad]; a 6-axis arm ignores the protocol's seventh.
            cycles: Cycles since the last step, 1 or more.
        """
        first, second, third = times = difference_times(cycles, self._spacing)
        self.is_even = times is EVEN_TIMES
        self._spacing = (cycles, self._spacing[0])
        q = list(q_c[: self._n])
        dq = [(new - old) / first for new, old in zip(q, self.q, strict=True)]
        ddq = [change / second for change in map(sub, dq, self.dq)]
        jerk = [change / third for change in map(sub, ddq, self.ddq)]
        if self._ends.rows:
            self._ends.apply(self._rows, self.q)
        self.q, self.dq, self.ddq, self.jerk = q, dq, ddq, jerk
        return self._rows.evaluate([*q, *dq, *ddq, *jerk])

    def violations(self) -> list[LimitViolation]:
        """Returns the violations of the last step."""
        return self._rows.violations((*self.q, *self.dq, *self.ddq, *self.jerk))

    def _numbers(self, values: Sequence[float], name: str) -> list[float]:
        if len(values) != self._n:
            raise InvalidValueError(name, values, f"must be {self._n} numbers")
        return [float(value) for value in values]


class _EndBounds:
    """`JointLimits.checked_velocity_bounds` near the ends of the joints' ranges, in plain floats."""

    def __init__(self, limits: JointLimits, rows: Sequence[Condition]) -> None:
        n, own, ends = len(limits.velocity), limits if limits.own is None else limits.own, limits.near_ends
        self.rows = [i * n for i, row in enumerate(rows) if row.depends_on_angles(limits)]
        """First index of each affected condition in the table of bounds."""
        self._joints: list[tuple[float, ...]] = []
        if ends is not None:
            velocity, offset, twice = limits.velocity, ends.offset, 2.0 * ends.deceleration
            near = (1.0 + _ROUNDING) * (velocity + offset) ** 2 / twice
            columns = own.lower, own.upper, velocity, offset, twice, own.lower + near, own.upper - near, ends.rounding
            self._joints = list(zip(*(column.tolist() for column in columns), strict=True))

    def apply(self, table: BoundsTable, q: Sequence[float]) -> None:
        """Sets the bounds for a command after joint angles, n numbers, [rad]."""
        lowest: list[float] = []
        highest: list[float] = []
        for angle, (low, high, velocity, offset, twice, near_low, near_high, least) in zip(
            q, self._joints, strict=True
        ):
            speed = velocity if angle > near_low else _end_velocity(twice * (angle - low), offset, velocity, least)
            lowest.append(-speed)
            speed = velocity if angle < near_high else _end_velocity(twice * (high - angle), offset, velocity, least)
            highest.append(speed)
        for first in self.rows:
            table.set_bounds(first, lowest, highest)


def _end_velocity(square: float, offset: float, velocity: float, least: float) -> float:
    speed = sqrt(square) - offset if square > 0.0 else 0.0
    return min(max(speed, least), velocity)
