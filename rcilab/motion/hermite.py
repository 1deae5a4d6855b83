"""Quintic Hermite interpolation: given value, first and second derivative at both ends of an interval."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array

State: TypeAlias = tuple[Array, Array, Array]
"""Values with their first two derivatives, each of the same shape."""

DIFFERENCE_STEP = 3e-4
"""Step of the finite differences, as a share of a path. Tuning value: the errors of both orders are below 1e-7."""


def central_state(before: Array, here: Array, after: Array, *, step: float | Array = DIFFERENCE_STEP) -> State:
    """Returns the state at `here` from the values one step before and after it, by central differences.

    The step is a number, or an array that broadcasts with the values.
    """
    return here, (after - before) / (2.0 * step), (after - 2.0 * here + before) / step**2


def quintic(left: State, right: State, length: float | Array) -> tuple[Array, ...]:
    """Returns the coefficients in ascending powers of u, which runs from 0 to 1, each of the values' shape.

    Args:
        left: State at the start; for many intervals at once, the first axis counts them.
        right: State at the end.
        length: Length of the interval; a number, or an array that broadcasts with the values.
    """
    slope = left[1] * length
    bend = left[2] * (length * length / 2.0)
    rise = right[0] - left[0] - slope - bend
    slope_change = right[1] * length - slope - 2.0 * bend
    bend_change = right[2] * (length * length) - 2.0 * bend
    return (
        left[0],
        slope,
        bend,
        10.0 * rise - 4.0 * slope_change + bend_change / 2.0,
        -15.0 * rise + 7.0 * slope_change - bend_change,
        6.0 * rise - 3.0 * slope_change + bend_change / 2.0,
    )


def evaluate(coefficients: tuple[Array, ...], parameters: Array) -> Array:
    """Returns the values of one quintic at many parameters u, shape (N,) to (N, *shape)."""
    u = parameters.reshape(-1, *([1] * coefficients[0].ndim))
    value = np.broadcast_to(coefficients[-1], (len(parameters), *coefficients[0].shape)).copy()
    for coefficient in reversed(coefficients[:-1]):
        value = value * u + coefficient
    return value


def derivative(coefficients: tuple[Array, ...], length: float | Array) -> tuple[Array, ...]:
    """Returns the coefficients of the derivative, also in powers of u."""
    return tuple(float(p) * coefficients[p] / length for p in range(1, len(coefficients)))
