"""The manual's S profile (3.5): one coordinate from standstill to standstill with a smooth speed profile.

Formulas: interoperability notes on the vendor's generators, reproduced independently. The speed rises as
V (3 u^2 - 2 u^3), u = t / t1, stays at V, and falls by the mirrored law; so the acceleration is continuous, with peak
a0 = 1.5 V / t1 on the way up and a1 on the way down, and the jerk is finite but jumps. The coordinate is a joint angle
[rad] or the length along a path [m]; only one of the two units appears below.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, isfinite, sqrt

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError

STANDSTILL_DISTANCE = 1e-6
"""A coordinate with at most this distance to move does not move, [rad or m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SCurve:
    """The S profile of one coordinate, starting at zero."""

    distance: float
    """Signed distance, [rad]; 0 if it does not move."""
    peak: float
    """Speed of the middle part, V, [rad/s]."""
    duration: float
    """Total time T, [s]."""
    start_acceleration: float
    """Largest acceleration of the rise, a0, [rad/s^2]."""
    end_acceleration: float
    """Largest deceleration of the fall, a1, [rad/s^2]."""

    @property
    def rise(self) -> float:
        """Duration of the rise, t1, [s]."""
        return 1.5 * self.peak / self.start_acceleration

    @property
    def fall(self) -> float:
        """Duration of the fall, t2, [s]."""
        return 1.5 * self.peak / self.end_acceleration

    def stretched(self, duration: float) -> SCurve:
        """Returns the curve over the same distance in a longer time: same accelerations, lower peak speed.

        The peak is the smaller root of 0.75 (a0 + a1) V^2 - T a0 a1 V + |D| a0 a1 = 0, in a form without cancellation.

        Args:
            duration: The longer time, [s]; a shorter one has no effect.
        """
        if self.distance == 0.0 or duration <= self.duration:
            return self
        a0, a1, distance = self.start_acceleration, self.end_acceleration, abs(self.distance)
        fastest = _shortest_time(distance, a0, a1)
        peak = 2.0 * distance / (duration + sqrt(max(0.0, (duration - fastest) * (duration + fastest))))
        return replace(self, peak=peak, duration=duration)

    def pieces(self) -> tuple[Array, Array]:
        """Returns the curve as four polynomial pieces: rise, constant speed, fall, standstill at the end.

        Returns:
            Starts, shape (4,), [s], and coefficients, shape (4, 5), ascending powers of the time since each start.
        """
        coefficients = np.zeros((4, 5))
        coefficients[3, 0] = self.distance
        if self.distance == 0.0:
            coefficients[:, 0] = 0.0
            return np.array([0.0, 0.0, 0.0, 0.0]), coefficients
        t1, t2, peak = self.rise, self.fall, copysign(self.peak, self.distance)
        falling = max(self.duration - t2, t1)
        coefficients[0, 3] = peak / t1**2
        coefficients[0, 4] = -0.5 * peak / t1**3
        coefficients[1, :2] = peak * t1 / 2.0, peak
        coefficients[2, :2] = self.distance - peak * t2 / 2.0, peak
        coefficients[2, 3] = -peak / t2**2
        coefficients[2, 4] = 0.5 * peak / t2**3
        return np.array([0.0, t1, falling, self.duration]), coefficients

    def at(self, t: float) -> tuple[float, float, float, float]:
        """Returns coordinate, speed, acceleration and jerk at a time; standstill before the start and after the end.

        Args:
            t: Time, [s].
        """
        if t <= 0.0 or t >= self.duration or self.distance == 0.0:
            return (self.distance if t > 0.0 else 0.0), 0.0, 0.0, 0.0
        starts, coefficients = self.pieces()
        piece = int(np.searchsorted(starts, t, side="right")) - 1
        tau = t - float(starts[piece])
        c = coefficients[piece].tolist()
        return (
            c[0] + tau * (c[1] + tau * (c[2] + tau * (c[3] + tau * c[4]))),
            c[1] + tau * (2.0 * c[2] + tau * (3.0 * c[3] + tau * 4.0 * c[4])),
            2.0 * c[2] + tau * (6.0 * c[3] + tau * 12.0 * c[4]),
            6.0 * c[3] + tau * 24.0 * c[4],
        )


def plan_s_curve(
    distance: float, velocity: float, start_acceleration: float, end_acceleration: float | None = None
) -> SCurve:
    """Returns the fastest S profile over a distance.

    Args:
        distance: Signed distance, [rad]. Up to `STANDSTILL_DISTANCE` the coordinate does not move.
        velocity: Largest speed, > 0, [rad/s].
        start_acceleration: Largest acceleration a0, > 0, [rad/s^2].
        end_acceleration: Largest deceleration a1, > 0, [rad/s^2]; None is that of the start.

    Raises:
        InvalidValueError: A bound is not positive, or a number is not finite.
    """
    a0 = start_acceleration
    a1 = a0 if end_acceleration is None else end_acceleration
    if not isfinite(distance):
        raise InvalidValueError("distance", distance, "must be finite")
    for name, bound in (("velocity", velocity), ("start_acceleration", a0), ("end_acceleration", a1)):
        if not (isfinite(bound) and bound > 0.0):
            raise InvalidValueError(name, bound, "must be positive and finite")
    length = abs(distance)
    if length <= STANDSTILL_DISTANCE:
        return SCurve(distance=0.0, peak=0.0, duration=0.0, start_acceleration=a0, end_acceleration=a1)
    if length < 0.75 * velocity**2 * (1.0 / a0 + 1.0 / a1):
        peak = sqrt(4.0 / 3.0 * length * a0 * a1 / (a0 + a1))
        duration = _shortest_time(length, a0, a1)
    else:
        peak = velocity
        duration = 0.75 * velocity * (1.0 / a0 + 1.0 / a1) + length / velocity
    return SCurve(distance=distance, peak=peak, duration=duration, start_acceleration=a0, end_acceleration=a1)


def synchronize(curves: list[SCurve]) -> list[SCurve]:
    """Returns the curves, all stretched to the duration of the slowest."""
    duration = max(curve.duration for curve in curves)
    return [curve.stretched(duration) for curve in curves]


def _shortest_time(length: float, a0: float, a1: float) -> float:
    """Returns the duration over a length without a speed bound, [s]: fall follows rise directly."""
    return sqrt(3.0 * length * (a0 + a1) / (a0 * a1))
