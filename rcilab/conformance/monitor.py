"""The conditions, cycle by cycle, in plain floats: what the controller runs every millisecond."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.clock import CYCLE_TIME
from rcilab.conformance.conditions import CYCLE_CONDITIONS, Condition
from rcilab.errors import InvalidValueError
from rcilab.faults import Fault
from rcilab.limits import JointLimits

_ORDERS = 4


class JointMonitor:
    """Judges one commanded position a cycle by the same rows as `check`, with the same arithmetic.

    Owned by the thread that runs the cycle. About 5 us a cycle for 7 joints; it allocates four short lists.

    Attributes:
        q: Last commanded joint angles, [rad].
        dq: Their first backward difference over one cycle, [rad/s].
        ddq: The second, [rad/s^2].
        jerk: The third, [rad/s^3].

    Args:
        limits: Bounds of the joints. The monitor starts at rest at zero; `reset` places it.
    """

    def __init__(self, limits: JointLimits) -> None:
        self._n = len(limits.velocity)
        self._rows: list[tuple[int, Condition, Fault, list[float], list[float]]] = []
        for row in CYCLE_CONDITIONS:
            assert row.fault is not None
            lower, upper = row.bounds(limits)
            self._rows.append((row.order, row, row.fault, lower.tolist(), upper.tolist()))
        self.reset([0.0] * self._n)

    def reset(self, q: Sequence[float], dq: Sequence[float] | None = None, ddq: Sequence[float] | None = None) -> None:
        """Forgets the past: the arm stands at `q`, or comes along with given backward differences.

        Args:
            q: Joint angles, n numbers, [rad].
            dq: First backward difference, n numbers, [rad/s]; None is rest.
            ddq: Second backward difference, n numbers, [rad/s^2]; None is zero.

        Raises:
            InvalidValueError: Not n numbers.
        """
        self.q = self._numbers(q, "q")
        self.dq = self._numbers(dq, "dq") if dq is not None else [0.0] * self._n
        self.ddq = self._numbers(ddq, "ddq") if ddq is not None else [0.0] * self._n
        self.jerk = [0.0] * self._n

    def step(self, q_c: Sequence[float]) -> tuple[Fault, ...]:
        """Takes the commanded angles of this cycle and returns the faults they raise, in wire order.

        A value that is not a number breaks every condition. The history moves on in any case; after a fault it is for
        the caller to `reset`.

        Args:
            q_c: Commanded joint angles, at least n numbers (a 6-axis arm ignores the wire's seventh), [rad].
        """
        h = CYCLE_TIME
        q = list(q_c[: self._n])
        dq = [(new - old) / h for new, old in zip(q, self.q, strict=True)]
        ddq = [(new - old) / h for new, old in zip(dq, self.dq, strict=True)]
        jerk = [(new - old) / h for new, old in zip(ddq, self.ddq, strict=True)]
        self.q, self.dq, self.ddq, self.jerk = q, dq, ddq, jerk
        signals = (q, dq, ddq, jerk)
        faults: list[Fault] = []
        for order, _, fault, lower, upper in self._rows:
            for value, low, high in zip(signals[order], lower, upper, strict=True):
                if not low < value < high:
                    faults.append(fault)
                    break
        return tuple(faults)

    def broken(self) -> list[tuple[Condition, int, float, float]]:
        """Returns what the last step broke: condition, joint (from 1), value, and the bound it passed."""
        signals = (self.q, self.dq, self.ddq, self.jerk)
        return [
            (row, joint, value, low if value <= low else high)
            for order, row, _, lower, upper in self._rows
            for joint, (value, low, high) in enumerate(zip(signals[order], lower, upper, strict=True), start=1)
            if not low < value < high
        ]

    def _numbers(self, values: Sequence[float], name: str) -> list[float]:
        if len(values) != self._n:
            raise InvalidValueError(name, values, f"needs {self._n} numbers")
        return [float(value) for value in values]
