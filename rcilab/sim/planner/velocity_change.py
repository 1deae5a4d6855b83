"""Changes of a velocity with bounded acceleration and jerk, to constant velocity: how far they go."""

from __future__ import annotations

import math

_BISECTIONS = 40


def change_distance(v: float, a: float, w: float, a_max: float, j_max: float) -> float:
    """Returns the distance of the fastest change from velocity v and acceleration a to constant velocity w.

    The acceleration rises or falls with full jerk to its peak, stays at its bound if it reaches that, and returns to
    zero (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, 3.4).
    """
    sign = 1.0 if w >= v + a * abs(a) / (2.0 * j_max) else -1.0
    v, a, w = sign * v, sign * a, sign * w
    peak = min(math.sqrt(max(j_max * (w - v) + 0.5 * a * a, 0.0)), a_max)
    t = abs(peak - a) / j_max
    jerk = math.copysign(j_max, peak - a)
    distance = t * (v + t * (0.5 * a + t * jerk / 6.0))
    v += 0.5 * (a + peak) * t
    if peak > 0.0:
        t = max(0.0, (w - v - peak * peak / (2.0 * j_max)) / peak)
        distance += t * (v + 0.5 * peak * t)
        v += peak * t
        t = peak / j_max
        distance += t * (v + peak * t / 3.0)
    return sign * distance


def fastest_before(w: float, distance: float, a_max: float, j_max: float) -> float:
    """Returns the largest constant velocity from which w is reached within a distance; also in the other direction."""
    # Up to a change of a_max^2 / j_max the acceleration does not reach its bound: (2 w + c) sqrt(c / j) = distance.
    largest = a_max * a_max / j_max
    if (2.0 * w + largest) * a_max / j_max >= distance:
        return w + _root(2.0 * w, distance * math.sqrt(j_max)) ** 2
    # Otherwise (w + c / 2) (c / a + a / j) = distance.
    half = 0.5 * (largest + 2.0 * w)
    rest = 2.0 * a_max * distance - 2.0 * w * largest
    return w - half + math.sqrt(half * half + rest)


def fastest_after(v: float, a: float, distance: float, cap: float, a_max: float, j_max: float) -> float:
    """Returns the largest constant velocity up to `cap` that is reached within a distance, from a moving state.

    At least the velocity at which the acceleration is zero at once, unless that is above `cap`.
    """
    if change_distance(v, a, cap, a_max, j_max) <= distance:
        return cap
    low = max(0.0, v + a * abs(a) / (2.0 * j_max))
    return cap if low >= cap else _bisect(v, a, distance, low, cap, a_max, j_max)


def slowest_after(v: float, a: float, distance: float, least: float, a_max: float, j_max: float) -> float:
    """Returns a constant velocity close above `least` that is reached within a distance, from a moving state.

    At most the velocity at which the acceleration is zero at once.
    """
    if change_distance(v, a, least, a_max, j_max) <= distance:
        return least
    high = max(least, v + a * abs(a) / (2.0 * j_max))
    return _bisect(v, a, distance, high, least, a_max, j_max)


def _bisect(v: float, a: float, distance: float, inside: float, outside: float, a_max: float, j_max: float) -> float:
    """Returns the velocity between two whose change takes the distance, or a little less."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (inside + outside)
        if change_distance(v, a, middle, a_max, j_max) <= distance:
            inside = middle
        else:
            outside = middle
    return inside


def _root(p: float, q: float) -> float:
    """Returns the root x >= 0 of x^3 + p x = q for p, q >= 0."""
    if p == 0.0:
        return q ** (1.0 / 3.0)
    # Hyperbolic form for one real root: https://en.wikipedia.org/wiki/Cubic_equation.
    scale = math.sqrt(p / 3.0)
    return 2.0 * scale * math.sinh(math.asinh(1.5 * q / (p * scale)) / 3.0)
