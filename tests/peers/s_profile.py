"""The vendor's S profile: of one axis, of joints that are all made as slow as the slowest, and of a path."""

from __future__ import annotations

import math
from collections.abc import Sequence

SPEED = (1.0, 1.0, 1.0, 1.0, 1.25, 1.25, 1.25)  # [rad/s] of the joint generator at full speed
ACCELERATION = 2.5  # [rad/s^2] of the joint generator, [m/s^2] of the path generator
PATH_SPEED = 1.0  # [m/s]
_STILL = 1e-6  # Distances up to this are none.


class Axis:
    """A distance, covered at speed v with acceleration a at both ends."""

    def __init__(self, distance: float, v: float, a: float) -> None:
        self.distance = distance
        self.a = a
        way = abs(distance)
        self.v = math.sqrt(2.0 / 3.0 * way * a) if way < 1.5 * v * v / a else v
        self.duration = 1.5 * self.v / a + way / self.v if way > _STILL else 0.0

    def stretch(self, duration: float) -> None:
        """Lowers the speed so that the whole takes as long as told, [s]."""
        if self.duration > 0.0:
            a, way = self.a, abs(self.distance)
            # The smaller root of 1.5 a V^2 - T a^2 V + |D| a^2 = 0.
            root = math.sqrt(max(0.0, (duration * a * a) ** 2 - 6.0 * a * way * a * a))
            self.v = (duration * a * a - root) / (3.0 * a)
            self.duration = duration

    def at(self, t: float) -> float:
        """Returns the distance covered at a time, [s]."""
        if self.duration == 0.0:
            return 0.0
        ramp = 1.5 * self.v / self.a
        if t >= self.duration:
            return self.distance
        if t < ramp:
            covered = self._rise(t / ramp) * ramp
        elif t <= self.duration - ramp:
            covered = 0.5 * self.v * ramp + self.v * (t - ramp)
        else:
            covered = abs(self.distance) - self._rise((self.duration - t) / ramp) * ramp
        return math.copysign(covered, self.distance)

    def _rise(self, u: float) -> float:
        return self.v * (u**3 - 0.5 * u**4)


class JointGenerator:
    """Joint angles on the way from start to goal."""

    def __init__(self, factor: float, start: Sequence[float], goal: Sequence[float]) -> None:
        self.start = tuple(start)
        speeds = SPEED if len(self.start) == 7 else SPEED[:3] + SPEED[4:]
        self.axes = [
            Axis(b - a, factor * v, factor * ACCELERATION) for a, b, v in zip(start, goal, speeds, strict=True)
        ]
        self.duration = max(axis.duration for axis in self.axes)
        for axis in self.axes:
            axis.stretch(self.duration)

    def at(self, t: float) -> tuple[float, ...]:
        """Returns the joint angles at a time, [s]."""
        return tuple(a + axis.at(t) for a, axis in zip(self.start, self.axes, strict=True))


def path(factor: float, length: float) -> Axis:
    """Returns the path generator for a length, [m]."""
    return Axis(length, factor * PATH_SPEED, factor * ACCELERATION)
