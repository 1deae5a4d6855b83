"""Piecewise polynomials of time for all joints: the curve of every motion."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import Array, JointPath, JointVector, readonly_copy
from rcilab.core.errors import InvalidValueError

DERIVATIVES = 4
"""Number of derivatives with the position: position, velocity, acceleration and jerk."""

_MAX_POWERS = 64  # Tuning value: a motion has up to 6.
_MAX_TIME = 1e12  # [s] The number of rows must be an integer.
_SHOWN_BREAKS = 10  # In an error.
_SAME_BREAK = 1e-11  # [s] Closer breaks of two joints are merged; at 1e4 rad/s^3 that is 1e-7 rad/s^2.


def require_piece_shapes(breaks: tuple[int, ...], coefficients: tuple[int, ...]) -> None:
    """Requires shapes of breaks and coefficients that fit together.

    Raises:
        InvalidValueError: They do not fit.
    """
    if len(breaks) != 1 or breaks[0] < 2 or len(coefficients) != 3 or coefficients[0] != breaks[0] - 1:
        shapes = f"breaks of shape {breaks}, coefficients of shape {coefficients}"
        raise InvalidValueError("polynomial pieces", shapes, "must have shapes (S + 1,) and (S, n, k)")
    if coefficients[1] < 1 or not 1 <= coefficients[2] <= _MAX_POWERS:
        problem = f"must have at least one joint and one power, and at most {_MAX_POWERS} powers"
        raise InvalidValueError("coefficients", f"array of shape {coefficients}", problem)


@dataclass(frozen=True, slots=True, eq=False)
class PiecewisePolynomial:
    """Joint angles over time: S polynomial pieces for n joints, powers of the time since each piece began.

    On piece s, [breaks[s], breaks[s + 1]), the angle of joint i is the sum over p of
    `coefficients[s, i, p] * (t - breaks[s])**p`.
    """

    breaks: Array
    """Start of each piece and end of the last one, shape (S + 1,), not decreasing, first 0, [s]."""
    coefficients: Array
    """Shape (S, n, k), ascending powers, [rad, rad/s, ...]."""
    _factors: tuple[Array, ...] = field(init=False, repr=False)
    """For each derivative the factors on the coefficients that remain, from the lowest power; at least one."""
    _table_powers: NDArray[np.intp] = field(init=False, repr=False)
    """Index of the coefficient for each power and derivative, shape (k, DERIVATIVES)."""
    _table_factors: Array = field(init=False, repr=False)
    """Factor on that coefficient, shape (k, DERIVATIVES, 1)."""
    _starts: list[float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        breaks, coefficients = readonly_copy(self.breaks), readonly_copy(self.coefficients)
        require_piece_shapes(breaks.shape, coefficients.shape)
        if not np.isfinite(breaks).all() or not np.isfinite(coefficients).all():
            raise InvalidValueError("polynomial pieces", "breaks, coefficients", "must be finite in every element")
        if breaks[0] != 0.0 or (breaks[1:] < breaks[:-1]).any():
            raise InvalidValueError("breaks", breaks[:_SHOWN_BREAKS].tolist(), "must begin at 0 and never decrease [s]")
        if breaks[-1] > _MAX_TIME:
            raise InvalidValueError("breaks", float(breaks[-1]), f"must end before {_MAX_TIME:g} [s]")
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)
        powers = coefficients.shape[2]
        factors = _derivative_factors(powers)
        table = np.zeros((powers, DERIVATIVES, 1))
        for derivative, column in enumerate(factors):
            table[: len(column), derivative, 0] = column
        object.__setattr__(self, "_factors", factors)
        object.__setattr__(self, "_table_factors", table)
        object.__setattr__(self, "_table_powers", np.add.outer(np.arange(powers), np.arange(DERIVATIVES)) % powers)
        object.__setattr__(self, "_starts", breaks[:-1].tolist())

    def __repr__(self) -> str:
        pieces, n, powers = self.coefficients.shape
        return f"<PiecewisePolynomial of {pieces} pieces, {n} joints, degree {powers - 1}, {self.duration:.3f} s>"

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.breaks, self.coefficients)

    @property
    def duration(self) -> float:
        """End of the last piece, [s]."""
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
            Shape (N, n), writable. At a break the later piece applies.
        """
        t = np.clip(np.asarray(times, dtype=np.float64), 0.0, self.breaks[-1])
        piece = np.searchsorted(self.breaks[:-1], t, side="right") - 1
        factors = self._factors[derivative]
        lowest = self.coefficients.shape[2] - len(factors)
        tau = (t - self.breaks[piece])[:, np.newaxis]
        value = factors[-1] * self.coefficients[:, :, -1][piece]
        for power in range(len(factors) - 2, -1, -1):
            value *= tau
            value += factors[power] * self.coefficients[:, :, lowest + power][piece]
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

    def extremes(self) -> tuple[tuple[JointVector, JointVector], tuple[JointVector, JointVector]]:
        """Returns the smallest and the largest angle of each joint, with their times.

        For pieces up to cubics. An extremum is at a break or at a zero of the velocity, a parabola.

        Returns:
            ((lowest, times), (highest, times)), each of shape (n,), [rad] and [s].
        """
        assert self.coefficients.shape[2] <= 4
        q, dq = (
            [factor * self.coefficients[:, :, p - len(factors)] for p, factor in enumerate(factors)]
            for factors in self._factors[:2]
        )
        c, b, a = (dq[p] if p < len(dq) else np.zeros_like(q[0]) for p in range(3))
        length = np.broadcast_to(np.diff(self.breaks)[:, np.newaxis], c.shape)
        root = np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0))
        sum_ = -0.5 * (b + np.copysign(root, b))  # Numerical Recipes 5.6.4: no difference of close numbers.
        with np.errstate(divide="ignore", invalid="ignore"):
            extrema = [np.nan_to_num(sum_ / a), np.nan_to_num(c / sum_)]
        # A zero that does not exist or is outside the piece becomes an end of the piece, which is on the curve too.
        tau = np.stack([np.zeros_like(c), length, *(np.clip(extremum, 0.0, length) for extremum in extrema)])
        angles = q[-1]
        for coefficient in reversed(q[:-1]):
            angles = angles * tau + coefficient
        angles = np.broadcast_to(angles, tau.shape).reshape(-1, self.n)
        times = (tau + self.breaks[:-1, np.newaxis]).reshape(-1, self.n)
        joint = np.arange(self.n)
        low, high = angles.argmin(axis=0), angles.argmax(axis=0)
        return (angles[low, joint], times[low, joint]), (angles[high, joint], times[high, joint])

    def at_end(self) -> tuple[JointVector, JointVector, JointVector, JointVector]:
        """Returns the left-hand limits at the end of the last piece."""
        return self._at_piece(-1, float(self.breaks[-1]) - self._starts[-1])

    def slowed(self, factor: float) -> PiecewisePolynomial:
        """Returns the same curve `factor` times slower: q(t / factor), exact within rounding.

        Args:
            factor: Factor on the duration, above 0; below 1 the curve is faster.
        """
        powers = np.arange(self.coefficients.shape[2])
        return PiecewisePolynomial(self.breaks * factor, self.coefficients / factor**powers)

    def _at_piece(self, piece: int, tau: float) -> tuple[JointVector, JointVector, JointVector, JointVector]:
        # All derivatives together; the highest powers of the higher derivatives are zero.
        table = self._table_factors * self.coefficients[piece].T[self._table_powers]
        value = table[-1]
        for coefficient in table[-2::-1]:
            value *= tau
            value += coefficient
        return value[0], value[1], value[2], value[3]


def join_pieces(starts: Array, coefficients: Array, duration: float) -> PiecewisePolynomial:
    """Returns the curve of joints that have different pieces, on the union of all breaks.

    Args:
        starts: Start of each piece of each joint, shape (n, m), not decreasing along a joint, first 0, [s]. The last
            piece of a joint extends to the end; a piece of zero length is skipped.
        coefficients: Shape (n, m, k), ascending powers of the time since the piece began, [rad, rad/s, ...].
        duration: End of the curve, [s].
    """
    breaks = _union(starts, duration)
    middle = (breaks[:-1] + breaks[1:]) / 2.0
    piece = (starts[:, np.newaxis, :] <= middle[:, np.newaxis]).sum(axis=2) - 1
    joint = np.arange(len(starts))[:, np.newaxis]
    tau = breaks[:-1] - starts[joint, piece]
    shifted = np.moveaxis(coefficients[joint, piece], 2, 0).copy()
    # Taylor shift by repeated synthetic division: the same polynomial in powers of the time since the new break.
    powers = len(shifted)
    for lowest in range(powers - 1):
        for power in range(powers - 2, lowest - 1, -1):
            shifted[power] += tau * shifted[power + 1]
    return PiecewisePolynomial(breaks, shifted.transpose(2, 1, 0))


def _union(starts: Array, duration: float) -> Array:
    inner = np.sort(starts, axis=None)
    inner = inner[(inner > _SAME_BREAK) & (inner < duration - _SAME_BREAK)]
    if inner.size:
        inner = inner[np.concatenate(([True], np.diff(inner) > _SAME_BREAK))]
    return np.concatenate(([0.0], inner, [duration]))


def _derivative_factors(powers: int) -> tuple[Array, ...]:
    factors = [np.ones(powers)]
    for _ in range(DERIVATIVES - 1):
        last = factors[-1]
        factors.append(np.arange(1, len(last)) * last[1:] if len(last) > 1 else np.zeros(1))
    return tuple(factors)
