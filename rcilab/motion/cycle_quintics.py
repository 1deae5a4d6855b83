"""The curve along a path from cycle to cycle: quintics with the path's own velocities and accelerations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.motion.hermite import State, quintic
from rcilab.motion.time_parametrization import TimeParametrization

_CHECKED_FRACTIONS = (0.25, 0.5, 0.75, 1.0)
"""Instants of a cycle at which the curve is checked besides its start, in cycles. Its end is not the start of the next
one: where the path's third derivative jumps within a cycle, as at the via orientation of an arc, so does the jerk."""

_QUADRATIC = 3
"""Number of coefficients of the jerk, whose largest value within a cycle is exact."""


def cycle_quintics(path: State, law: TimeParametrization, rows: slice) -> list[Array]:
    """Returns the coefficients by ascending power of the time since the cycle began, each of shape (N - 1, n).

    Args:
        path: Joint angles in N rows with their derivatives by the path parameter, shape (N, n) each.
        law: The time law; the curve starts and ends at standstill.
        rows: The N rows of the law.
    """
    q, first, second = path
    ds, dds = law.ds[rows, np.newaxis], law.dds[rows, np.newaxis]
    v = first * ds
    a = second * ds**2 + first * dds
    if rows.start == 0:
        v[0] = a[0] = 0.0
    if rows.stop == len(law.s):
        v[-1] = a[-1] = 0.0
    parts = quintic((q[:-1], v[:-1], a[:-1]), (q[1:], v[1:], a[1:]), CYCLE_TIME)
    return [part / CYCLE_TIME**power for power, part in enumerate(parts)]


def peak_derivatives(powers: list[Array]) -> Iterator[Array]:
    """Yields the largest absolute velocity, acceleration and jerk of each cycle, each of shape (N - 1, n)."""
    for _ in range(3):
        powers = [float(p) * powers[p] for p in range(1, len(powers))]
        largest = np.abs(powers[0])
        for part in _CHECKED_FRACTIONS:
            value = powers[-1].copy("K")
            for coefficient in reversed(powers[:-1]):
                value *= part * CYCLE_TIME
                value += coefficient
            np.maximum(largest, np.abs(value), out=largest)
        if len(powers) == _QUADRATIC:
            np.maximum(largest, _vertex(*powers), out=largest)
        yield largest


def _vertex(constant: Array, linear: Array, square: Array) -> Array:
    """Returns the absolute value of a quadratic at its vertex, or at the end of the cycle nearest to it."""
    time = np.clip(-0.5 * linear / np.where(square == 0.0, np.inf, square), 0.0, CYCLE_TIME)
    return np.abs(constant + time * (linear + time * square))
