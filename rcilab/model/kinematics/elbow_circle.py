"""The circle on which the elbow of a 7-axis arm can move at a fixed pose of the tool, in base."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, remainder, tau

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.errors import SingularError
from rcilab.model.kinematics.arm_angle import reference_frame

_SAMPLES = 720  # Arm angles at which a ray is compared with the circle: half a degree, refined by a parabola.
_NEAR_WEIGHT = (
    1e-3  # [m/rad] Weight of the difference to `near` if a ray passes both sides of the circle. Tuning value.
)
_MIN_RADIUS = 1e-6  # [m] Below it the arm counts as stretched.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ElbowCircle:
    """Possible positions of the elbow at one pose of the tool."""

    center: Array
    """On the shoulder-wrist line, in base, shape (3,), [m]."""
    radius: float
    """Radius, [m]."""
    axis: Array
    """Direction from shoulder to wrist, shape (3,): axis of the arm angle, right-handed."""
    upward: Array
    """Direction from the centre to the elbow at arm angle 0, shape (3,)."""
    across: Array
    """Direction from the centre to the elbow at arm angle 90 degrees, shape (3,)."""

    def points(self, psi: ArrayLike, outward: float = 0.0) -> Array:
        """Returns the elbow at arm angles, shape (N, 3), [m].

        Args:
            psi: Arm angles, shape (N,), [rad].
            outward: Distance of the points outside the circle, [m].
        """
        angles = np.atleast_1d(np.asarray(psi, dtype=np.float64))[:, None]
        return self.center + (self.radius + outward) * (np.cos(angles) * self.upward + np.sin(angles) * self.across)

    def angle_along(self, eye: ArrayLike, through: ArrayLike, near: float, outward: float = 0.0) -> float:
        """Returns the arm angle, [rad], at which the circle comes closest to a line of sight.

        Args:
            eye: Start of the line, shape (3,), [m].
            through: Another point on it, shape (3,), [m].
            near: Preferred arm angle, [rad], if the line passes two sides of the circle.
            outward: As in `points`.
        """
        origin = np.asarray(eye, dtype=np.float64)
        direction = np.asarray(through, dtype=np.float64) - origin
        direction = direction / max(float(np.linalg.norm(direction)), 1e-12)
        psi = np.linspace(-pi, pi, _SAMPLES, endpoint=False)
        distance = np.linalg.norm(np.cross(self.points(psi, outward) - origin, direction), axis=1)
        offset = np.abs((psi - near + pi) % tau - pi)
        best = int((distance + _NEAR_WEIGHT * offset).argmin())
        before, center_value, after = (float(distance[(best + step) % _SAMPLES]) for step in (-1, 0, 1))
        curvature = before - 2.0 * center_value + after
        step = 0.5 * (before - after) / curvature if curvature > 1e-12 else 0.0
        return remainder(float(psi[best]) + min(max(step, -0.5), 0.5) * tau / _SAMPLES, tau)


def elbow_circle(shoulder: Array, elbow: Array, wrist: Array) -> ElbowCircle:
    """Returns the circle of an elbow.

    Args:
        shoulder: In base, shape (3,), [m].
        elbow: In base, shape (3,), [m].
        wrist: Centre of the wrist in base, shape (3,), [m].

    Raises:
        SingularError: The arm is stretched, or shoulder and wrist are above each other.
    """
    line = wrist - shoulder
    length = float(np.linalg.norm(line))
    if length < _MIN_RADIUS:
        raise SingularError("elbow circle: the wrist is on the shoulder, so there is no shoulder-wrist line").coded(
            "no_arm_angle"
        )
    axis = line / length
    upward, across = reference_frame((float(axis[0]), float(axis[1]), float(axis[2])))
    center = shoulder + axis * float(axis @ (elbow - shoulder))
    radius = float(np.linalg.norm(elbow - center))
    if radius < _MIN_RADIUS:
        raise SingularError("elbow circle: the arm is stretched, the elbow is on the shoulder-wrist line").coded(
            "stretched"
        )
    return ElbowCircle(
        center=readonly_copy(center),
        radius=radius,
        axis=readonly_copy(axis),
        upward=readonly_copy(upward),
        across=readonly_copy(across),
    )
