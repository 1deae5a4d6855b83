"""A load at the flange."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, inf

import numpy as np

from rcilab.core.arrays import Matrix, Vector3, as_number, as_vector, readonly_copy
from rcilab.core.errors import InvalidValueError

_MAX_DISTANCE = 2.0  # [m] From the flange, as the controllers have it; a value in millimetres is above it.
POINT_MASS = readonly_copy(np.zeros((3, 3)))
"""Inertia of a point mass about itself, [kg m^2]."""
LARGEST_INERTIA = 100.0  # [kg m^2] Tuning value: a hundred times that of any load of an xMate.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Payload:
    """A rigid body fixed to the flange.

    Raises:
        InvalidValueError: The mass is negative, the inertia is physically impossible, or a number is not finite.
    """

    mass: float = 0.0
    """Mass, [kg]."""
    center_of_mass: Vector3 = field(default_factory=lambda: np.zeros(3))
    """Centre of mass in the flange frame, shape (3,), [m]."""
    inertia: Matrix = field(default_factory=lambda: np.zeros((3, 3)))
    """Inertia about the centre of mass, flange axes, shape (3, 3), [kg m^2]."""

    def __post_init__(self) -> None:
        """Checks the values and makes them read-only."""
        mass = as_number(self.mass, "load mass", "kg")
        if not 0.0 <= mass < inf:  # How heavy it may be is a matter of the arm.
            raise InvalidValueError("load mass", mass, "must be a finite number, 0 or more [kg]")
        try:
            moments = np.array(self.inertia, dtype=np.float64).ravel()
        except (TypeError, ValueError, OverflowError):
            moments = self.inertia  # The error shows the value as passed.
        inertia = as_vector(moments, 9, "load inertia", "kg m^2").reshape(3, 3)
        if mass == 0.0 and np.any(inertia):
            raise InvalidValueError("load inertia", inertia.tolist(), "must be zero: a load without mass has none")
        if np.abs(inertia - inertia.T).max() > 1e-9 * max(1.0, float(np.abs(inertia).max())):
            raise InvalidValueError("load inertia", inertia.tolist(), "must be symmetric")
        inertia = _valid_inertia(0.5 * inertia + 0.5 * inertia.T)
        object.__setattr__(self, "mass", mass)
        center = as_vector(self.center_of_mass, 3, "load centre of mass", "m")
        if not hypot(*center.tolist()) <= _MAX_DISTANCE:
            raise InvalidValueError(
                "load centre of mass", center.tolist(), f"is farther than {_MAX_DISTANCE:g} m; the unit is metres"
            )
        object.__setattr__(self, "center_of_mass", center)
        object.__setattr__(self, "inertia", readonly_copy(inertia))

    def __repr__(self) -> str:
        centre = " ".join(f"{x:.4g}" for x in self.center_of_mass.tolist())
        moments = " ".join(f"{x:.4g}" for x in np.diagonal(self.inertia).tolist())
        return f"<Payload of {self.mass:.4g} kg, centre of mass at {centre} m, moments of inertia {moments} kg m^2>"


def _valid_inertia(inertia: Matrix) -> Matrix:
    """Returns the inertia, without negative moments caused by rounding.

    The principal moments of a body are not negative, and none exceeds the sum of the other two.
    """
    is_small = bool(np.abs(inertia).max() <= LARGEST_INERTIA)
    moments, axes = np.linalg.eigh(inertia) if is_small else (np.array((-1.0, 0.0, 0.0)), np.eye(3))
    smallest, middle, largest = moments.tolist()
    tolerance = 1e-9 * max(1.0, largest)
    if smallest < -tolerance or largest > smallest + middle + tolerance:
        raise InvalidValueError(
            "load inertia",
            inertia.tolist(),
            f"is physically impossible: its principal moments must be from 0 to {LARGEST_INERTIA:g} kg m^2, "
            "and none larger than the sum of the other two",
        )
    if smallest >= 0.0:
        return inertia
    possible = axes * np.maximum(moments, 0.0) @ axes.T
    return (possible + possible.T) / 2.0


NO_LOAD = Payload()


def combine_payloads(first: Payload, second: Payload) -> Payload:
    """Returns two bodies at the flange as one."""
    mass = first.mass + second.mass
    if not (first.mass and second.mass):
        return second if second.mass else first
    center = (first.mass * first.center_of_mass + second.mass * second.center_of_mass) / mass
    inertia = np.zeros((3, 3))
    for body in (first, second):
        d = body.center_of_mass - center
        inertia += body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Payload(mass=mass, center_of_mass=center, inertia=inertia)
