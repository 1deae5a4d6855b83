"""A function of time made of polynomial pieces, one set of pieces for all joints: what every motion is built on."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rcilab.arrays import Array, JointPath, JointVector, frozen
from rcilab.errors import InvalidValueError

DERIVATIVES = 4
"""Position, velocity, acceleration and jerk."""


@dataclass(frozen=True, slots=True, eq=False)
class PiecewisePolynomial:
    """Joint angles over time: S polynomial pieces for n joints, powers of the time since each piece began.

    Piece s holds on [breaks[s], breaks[s + 1]); joint i is there at the sum over p of
    `coefficients[s, i, p] * (t - breaks[s])**p`.
    """

    breaks: Array
    """Where the pieces begin, and where the last one ends, shape (S + 1,), not decreasing, first 0, [s]."""
    coefficients: Array
    """Shape (S, n, k), ascending powers, [rad, rad/s, ...]."""
    _tables: tuple[tuple[Array, ...], ...] = field(init=False, repr=False)
    """For each derivative its coefficients by ascending power, each of shape (S, n)."""
    _starts: list[float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        breaks, coefficients = frozen(self.breaks), frozen(self.coefficients)
        if breaks.ndim != 1 or breaks.size < 2 or coefficients.ndim != 3 or coefficients.shape[0] != breaks.size - 1:
            shapes = f"breaks of shape {breaks.shape}, coefficients of shape {coefficients.shape}"
            raise InvalidValueError("polynomial pieces", shapes, "must have shapes (S + 1,) and (S, n, k)")
        if coefficients.shape[1] < 1 or coefficients.shape[2] < 1:
            raise InvalidValueError("coefficients", f"array of shape {coefficients.shape}", "need a joint and a power")
        if not np.isfinite(breaks).all() or not np.isfinite(coefficients).all():
            raise InvalidValueError("polynomial pieces", "breaks, coefficients", "must be finite in every element")
        if breaks[0] != 0.0 or (breaks[1:] < breaks[:-1]).any():
            raise InvalidValueError("breaks", breaks.tolist(), "must begin at 0 and never decrease [s]")
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "_tables", _derivative_tables(coefficients))
        object.__setattr__(self, "_starts", breaks[:-1].tolist())

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.breaks, self.coefficients)

    @property
    def duration(self) -> float:
        """Where the last piece ends, [s]."""
        return float(self.breaks[-1])

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.coefficients.shape[1])

    def sample(self, times: ArrayLike, derivative: int = 0) -> JointPath:
        """Returns the angles, or a derivative of them, at many times.

        Args:
            times: Times, shape (N,), [s]; clamped to [0, duration].
            derivative: 0 for angles [rad], 1 velocities, 2 accelerations, 3 jerks.

        Returns:
            Shape (N, n), writable. At a break the later piece counts.
        """
        t = np.clip(np.asarray(times, dtype=np.float64), 0.0, self.breaks[-1])
        piece = np.searchsorted(self.breaks[:-1], t, side="right") - 1
        table = self._tables[derivative]
        tau = (t - self.breaks[piece])[:, np.newaxis]
        value = table[-1][piece]
        for coefficient in reversed(table[:-1]):
            value *= tau
            value += coefficient[piece]
        return value

    def at(self, t: float) -> tuple[JointVector, JointVector, JointVector, JointVector]:
        """Returns angles, velocities, accelerations and jerks at one time, each of shape (n,).

        The same floating-point operations as `sample`, so the results are the same to the last bit.

        Args:
            t: Time, [s]; clamped to [0, duration].
        """
        t = min(max(float(t), 0.0), float(self.breaks[-1]))
        piece = bisect_right(self._starts, t) - 1
        return self._at_piece(piece, t - self._starts[piece])

    def at_end(self) -> tuple[JointVector, JointVector, JointVector, JointVector]:
        """Returns the limits from the left at the end of the last piece: does it arrive at rest?"""
        return self._at_piece(-1, float(self.breaks[-1]) - self._starts[-1])

    def _at_piece(self, piece: int, tau: float) -> tuple[JointVector, JointVector, JointVector, JointVector]:
        results: list[JointVector] = []
        for table in self._tables:
            value = table[-1][piece].copy()
            for coefficient in reversed(table[:-1]):
                value *= tau
                value += coefficient[piece]
            results.append(value)
        return results[0], results[1], results[2], results[3]


def _derivative_tables(coefficients: Array) -> tuple[tuple[Array, ...], ...]:
    powers = [np.ascontiguousarray(coefficients[:, :, p]) for p in range(coefficients.shape[2])]
    tables = [tuple(powers)]
    for _ in range(DERIVATIVES - 1):
        powers = [float(p) * powers[p] for p in range(1, len(powers))] or [np.zeros_like(powers[0])]
        tables.append(tuple(powers))
    return tuple(tables)
