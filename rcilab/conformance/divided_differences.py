"""Times that Newton's divided differences of unevenly spaced commands are divided by."""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME

EVEN = (CYCLE_TIME, CYCLE_TIME, CYCLE_TIME)
"""The times of commands that come every cycle."""


def spans(cycles: int, before: tuple[int, int]) -> tuple[float, float, float]:
    """Returns what the first, second and third difference are divided by, [s].

    With commands at t0 > t1 > t2 > t3 that is t0 - t1, (t0 - t2) / 2 and (t0 - t3) / 3: the k-th divided difference,
    times k factorial, estimates the k-th derivative. Evenly spaced, all three are the cycle time.

    Args:
        cycles: Cycles from the last command to this one.
        before: Cycles between the last two commands, and between the two before them.
    """
    last, oldest = before
    if cycles == last == oldest == 1:
        return EVEN
    return cycles * CYCLE_TIME, (cycles + last) * CYCLE_TIME / 2.0, (cycles + last + oldest) * CYCLE_TIME / 3.0
