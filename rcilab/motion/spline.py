"""Cubic spline through given samples that starts and ends at standstill."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointPath, as_path, as_vector
from rcilab.core.errors import InvalidValueError
from rcilab.motion.piecewise import PiecewisePolynomial

MAX_DURATION = 7200.0
"""Longest motion through samples, [s]. Its rows take 400 MB, like those of the longest planned motion."""


def spline_through(times: ArrayLike, q: ArrayLike) -> tuple[PiecewisePolynomial | None, JointPath]:
    """Returns the curve through joint angles at given times, with continuous acceleration, and the checked angles.

    A cubic spline that passes every sample. Velocity and acceleration are zero at both ends, as the robot requires; for
    this the first and the last interval are split in two (Biagiotti and Melchiorri, Trajectory Planning for Automatic
    Machines and Robots, 2008, 4.4.4). The curve of a single sample is None.

    Args:
        times: Time of each sample, shape (N,), increasing, [s]; the motion starts at the first.
        q: Joint angles, shape (N, n), N >= 1, [rad].

    Raises:
        InvalidValueError: Not finite, numbers of times and rows differ, the times do not increase, or span too long.
    """
    rows = as_path(q, None, "q", "rad")
    t = as_vector(times, len(rows), "times", "s")
    not_later = np.flatnonzero(np.diff(t) <= 0.0)
    if not_later.size:
        i = int(not_later[0]) + 1
        raise InvalidValueError(f"times at row {i} (from 0)", float(t[i]), f"must be later than {t[i - 1]:g} [s]")
    if (whole := float(t[-1] - t[0])) > MAX_DURATION:
        unit = "check that times are in s, or the rate in samples per second"
        raise InvalidValueError("duration", whole, f"s is more than {MAX_DURATION:g} s, the longest motion; {unit}")
    if len(rows) == 1:
        return None, rows
    knots, angles, accelerations = _spline(t - t[0], rows)
    h = np.diff(knots)[:, np.newaxis]
    pieces = np.empty((len(h), rows.shape[1], 4))
    pieces[:, :, 0] = angles[:-1]
    pieces[:, :, 1] = np.diff(angles, axis=0) / h - h * (2.0 * accelerations[:-1] + accelerations[1:]) / 6.0
    pieces[:, :, 2] = accelerations[:-1] / 2.0
    pieces[:, :, 3] = np.diff(accelerations, axis=0) / (6.0 * h)
    return PiecewisePolynomial(knots, pieces), rows


def _spline(t: Array, q: JointPath) -> tuple[Array, JointPath, JointPath]:
    """Returns the knots [s], and angles [rad] and accelerations [rad/s^2] there: two knots more than samples.

    The accelerations M solve h0 M0 + 2 (h0 + h1) M1 + h1 M2 = 6 ((q2 - q1) / h1 - (q1 - q0) / h0) at every inner knot.
    At the two added knots the angles follow from standstill at the ends: q1 = q0 + M1 h0^2 / 6.
    """
    part = 2.0 if len(t) > 2 else 3.0
    knots = np.concatenate((t[:1], [t[0] + (t[1] - t[0]) / part], t[1:-1], [t[-1] - (t[-1] - t[-2]) / part], t[-1:]))
    angles = np.concatenate((q[:1], q[:1], q[1:-1], q[-1:], q[-1:]))
    h = np.diff(knots)
    lower, upper = h[:-1].copy(), h[1:].copy()
    diagonal = 2.0 * (h[:-1] + h[1:])
    diagonal[0] += h[0] ** 2 * (1.0 / h[0] + 1.0 / h[1])
    diagonal[-1] += h[-1] ** 2 * (1.0 / h[-1] + 1.0 / h[-2])
    lower[1] -= h[0] ** 2 / h[1]
    upper[-2] -= h[-1] ** 2 / h[-2]
    accelerations = np.zeros_like(angles)
    accelerations[1:-1] = _solve_tridiagonal(
        lower, diagonal, upper, 6.0 * np.diff(np.diff(angles, axis=0) / h[:, None], axis=0)
    )
    angles[1] += accelerations[1] * h[0] ** 2 / 6.0
    angles[-2] += accelerations[-2] * h[-1] ** 2 / 6.0
    return knots, angles, accelerations


def _solve_tridiagonal(lower: Array, diagonal: Array, upper: Array, right: Array) -> Array:
    """Returns x, shape (m, n), for a diagonally dominant matrix, by elimination without pivoting."""
    a, b, c = lower.tolist(), diagonal.tolist(), upper.tolist()
    x = right.copy()
    for i in range(1, len(b)):
        factor = a[i] / b[i - 1]
        b[i] -= factor * c[i - 1]
        x[i] -= factor * x[i - 1]
    x[-1] /= b[-1]
    for i in range(len(b) - 2, -1, -1):
        x[i] -= c[i] * x[i + 1]
        x[i] /= b[i]
    return x
