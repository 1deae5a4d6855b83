"""Quintics between states: given value, slope and bend at both ends of an interval."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array

State: TypeAlias = tuple[Array, Array, Array]
"""Values with their first two derivatives, each of the same shape."""


def quintic(left: State, right: State, length: float | Array) -> tuple[Array, ...]:
    """Returns the coefficients, ascending powers of the part of the interval, 0 to 1, each of the values' shape.

    Args:
        left: State at the start; many at once where the first axis counts intervals.
        right: State at the end.
        length: Of the interval, one number or of a shape that multiplies with the values.
    """
    slope = left[1] * length
    bend = left[2] * (length * length / 2.0)
    rise = right[0] - left[0] - slope - bend
    steeper = right[1] * length - slope - 2.0 * bend
    bent = right[2] * (length * length) - 2.0 * bend
    return (
        left[0],
        slope,
        bend,
        10.0 * rise - 4.0 * steeper + bent / 2.0,
        -15.0 * rise + 7.0 * steeper - bent,
        6.0 * rise - 3.0 * steeper + bent / 2.0,
    )


def evaluate(powers: tuple[Array, ...], part: Array) -> Array:
    """Returns the values of one quintic at many parts of its interval, shape (N, *shape)."""
    u = part.reshape(-1, *([1] * powers[0].ndim))
    value = np.broadcast_to(powers[-1], (len(part), *powers[0].shape)).copy()
    for power in reversed(powers[:-1]):
        value = value * u + power
    return value


def derived(powers: tuple[Array, ...], length: float | Array) -> tuple[Array, ...]:
    """Returns the coefficients of the derivative, still in powers of the part of the interval."""
    return tuple(float(p) * powers[p] / length for p in range(1, len(powers)))
