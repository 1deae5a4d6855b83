"""Newton's divided differences of unevenly spaced commands, and the norms of those of a tool."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rcilab.core.clock import CYCLE_TIME

EVEN_TIMES = (CYCLE_TIME, CYCLE_TIME, CYCLE_TIME)
"""Divisors for commands in every cycle."""


def difference_times(cycles: int, previous: tuple[int, int]) -> tuple[float, float, float]:
    """Returns the divisors of the first, second and third difference, [s].

    With commands at t0 > t1 > t2 > t3 they are t0 - t1, (t0 - t2) / 2 and (t0 - t3) / 3: the k-th divided difference,
    times k factorial, estimates the k-th derivative. With even spacing all three are the cycle time.

    Args:
        cycles: Cycles from the last command to this one.
        previous: Cycles between the last two commands, and between the two before them.
    """
    last, oldest = previous
    if cycles == last == oldest == 1:
        return EVEN_TIMES
    return cycles * CYCLE_TIME, (cycles + last) * CYCLE_TIME / 2.0, (cycles + last + oldest) * CYCLE_TIME / 3.0


def tool_norms(values: Sequence[float]) -> tuple[float, float]:
    """Returns the norms of the linear and the angular part of a twist or of one of its derivatives, 6 numbers."""
    a, b, c, d, e, f = values
    return math.sqrt(a * a + b * b + c * c), math.sqrt(d * d + e * e + f * f)
