"""Roots of trigonometric polynomials: their sign changes on a fine grid, refined by Newton's method."""

from __future__ import annotations

from math import tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array

_GRID = 256
"""Angles at which a sign is evaluated: fine enough that no two extrema lie within a step, unless it is flat."""
_FLAT, _FINER = 1e-6, 16
"""Below what part of its size a polynomial is flat, and into how many parts a step is cut there; tuning value."""
_CELL = tau / _GRID
_NEWTON = 6  # Steps, each of which halves the range of a root if Newton's method leaves it.
_ROUNDING = 1e-13  # How far a polynomial may miss zero, by the sum of its coefficients, where two roots meet.


def fourier_coefficients(values: Array, degree: int) -> NDArray[np.complex128]:
    """Returns the coefficients of trigonometric polynomials, of order 0 to a degree, shape (N, degree + 1).

    Args:
        values: At equally spaced angles from 0, more than twice the degree, shape (N, K).
        degree: Of the polynomials.
    """
    found = np.fft.rfft(values, axis=1)[:, : degree + 1] * (2.0 / values.shape[1])
    found[:, 0] *= 0.5
    return found


def find_roots(c: NDArray[np.complex128]) -> tuple[NDArray[np.intp], Array]:
    """Returns the real roots of polynomials: which each belongs to, shape (R,), and the angle, [rad].

    Args:
        c: Coefficients, shape (N, degree + 1): the value at an angle t is the real part of the sum of c_k exp(i k t).
    """
    spectrum = np.zeros((2, len(c), _GRID // 2 + 1), dtype=np.complex128)
    spectrum[0, :, : c.shape[1]] = c * (_GRID / 2.0)
    spectrum[0, :, 0] *= 2.0
    spectrum[1, :, : c.shape[1]] = 1j * np.arange(c.shape[1]) * spectrum[0, :, : c.shape[1]]
    table = np.empty((2, len(c), _GRID + 1))
    table[:, :, :-1] = np.fft.irfft(spectrum, _GRID, axis=2)
    table[:, :, -1] = table[:, :, 0]
    rows, low, high = _steps(c, np.arange(len(c)), np.zeros(len(c)), _CELL, table)
    # Where a polynomial is flat, several roots may be close together; refine there.
    sizes = np.abs(table[0])
    flat, places = np.nonzero(np.maximum(sizes[:, 1:], sizes[:, :-1]) < _FLAT * np.abs(c).sum(axis=1, keepdims=True))
    if len(flat):
        starts: Array = places.astype(np.float64) * _CELL
        fine = _CELL / _FINER
        t = starts[:, None] + fine * np.arange(_FINER + 1)
        again = np.stack(_evaluated(np.repeat(c[flat], _FINER + 1, axis=0), t.ravel())).reshape(2, *t.shape)
        more_rows, more_low, more_high = _steps(c, flat, starts, fine, again)
        is_flat = np.zeros(sizes[:, 1:].shape, dtype=np.bool_)
        is_flat[flat, places] = True
        left = ~is_flat[rows, np.minimum((low / _CELL + 1e-6).astype(np.intp), _GRID - 1)]
        rows = np.concatenate((rows[left], more_rows))
        low, high = np.concatenate((low[left], more_low)), np.concatenate((high[left], more_high))
    return rows, _settled(c[rows], low, high)


def _steps(
    c: NDArray[np.complex128], owners: NDArray[np.intp], starts: Array, step: float, table: Array
) -> tuple[NDArray[np.intp], Array, Array]:
    """Returns ranges in which a polynomial changes its sign once: whose they are, and their ends, [rad].

    Args:
        c: Polynomials, shape (N, degree + 1).
        owners: Which of them each row of the table is of, shape (m,).
        starts: Where each row begins, shape (m,), [rad].
        step: From place to place, [rad].
        table: Values and slopes, shape (2, m, places).
    """
    before, after = table[:, :, :-1], table[:, :, 1:]
    is_negative = before[0] < 0.0
    crosses = is_negative != (after[0] < 0.0)
    rows, places = np.nonzero(crosses)
    low = starts[rows] + step * places
    # Two roots within a step: both ends are on one side, and the way there leads to the other.
    sign = np.where(is_negative, -1.0, 1.0)
    twins, tops = np.nonzero(~crosses & (sign * before[1] < 0.0) & (sign * after[1] > 0.0))
    picked, left = c[owners[twins]], starts[twins] + step * tops
    bottom = _settled(picked * (1j * np.arange(c.shape[1])), left, left + step)
    deep = sign[twins, tops] * _evaluated(picked, bottom)[0] < _ROUNDING * np.abs(picked).sum(axis=1)
    twins, left, bottom = owners[twins[deep]], left[deep], bottom[deep]
    ends = np.concatenate((low + step, bottom, left + step))
    return np.concatenate((owners[rows], twins, twins)), np.concatenate((low, left, bottom)), ends


def _settled(c: NDArray[np.complex128], low: Array, high: Array) -> Array:
    """Returns the root of each polynomial between two angles at which its signs differ, shape (R,), [rad]."""
    above = _evaluated(c, high)[0] > 0.0
    t = 0.5 * (low + high)
    for _ in range(_NEWTON):
        value, slope = _evaluated(c, t)
        beyond = (value > 0.0) == above
        high, low = np.where(beyond, t, high), np.where(beyond, low, t)
        newton = t - value / np.where(slope == 0.0, 1.0, slope)
        t = np.where((low <= newton) & (newton <= high), newton, 0.5 * (low + high))
    return t


def _evaluated(c: NDArray[np.complex128], t: Array) -> tuple[Array, Array]:
    """Returns values and slopes of polynomials at an angle each, [rad], shape (R,)."""
    powers = np.empty_like(c)
    powers[:, 0] = 1.0
    powers[:, 1:] = np.exp(1j * t)[:, None]
    terms = c * np.multiply.accumulate(powers, axis=1)
    return terms.real.sum(axis=1), -(terms.imag @ np.arange(c.shape[1], dtype=np.float64))
