"""How far a joint moves until it stands, as fast as its acceleration and jerk allow."""

from __future__ import annotations

from math import sqrt


def stop_distance(v: float, a: float, a_max: float, j_max: float) -> float:
    """Returns how far a joint still moves in the positive direction while it stops.

    Args:
        v: Its velocity, [rad/s].
        a: Its acceleration, [rad/s^2].
        a_max: Bound of its acceleration, above zero, [rad/s^2].
        j_max: Bound of its jerk, above zero, [rad/s^3].
    """
    a = max(a, -a_max)
    square = j_max * v + 0.5 * a * a
    if square <= 0.0 or (v <= 0.0 and a <= 0.0):
        return 0.0
    peak = min(a_max, sqrt(square))  # Of the deceleration.
    t = max(0.0, (a + peak) / j_max)
    first = t * (v + t * (0.5 * a - t * j_max / 6.0))
    v1, v3 = v + t * (a - 0.5 * t * j_max), 0.5 * peak * peak / j_max
    second = max(0.0, (v1 - v3) / peak) * 0.5 * (v1 + v3)
    return first + second + peak**3 / (6.0 * j_max**2)
