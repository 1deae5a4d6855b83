"""The bodies of an arm in Craig's frames of its joints, as Franka's controllers describe them to their clients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Matrix, Vector3
from rcilab.makers.franka.robots.arm import CRAIG
from rcilab.robots.description import CraigRow, RobotDescription


@dataclass(frozen=True, slots=True, eq=False)
class CraigBody:
    """A link in the frame of its joint, which turns with it."""

    mass: float
    """[kg]."""
    center_of_mass: Vector3
    """Shape (3,), [m]."""
    inertia: Matrix
    """About the centre of mass, shape (3, 3), [kg m^2]."""


def craig_placement(row: CraigRow) -> Matrix:
    """Returns the pose of a joint's frame in the one before at angle zero: RotX(alpha) TransX(a) TransZ(d), (4, 4)."""
    c, s = (round(x, 15) for x in (np.cos(row.alpha), np.sin(row.alpha)))  # Exact for multiples of 90 degrees.
    return np.array([[1.0, 0.0, 0.0, row.a], [0.0, c, -s, -s * row.d], [0.0, s, c, c * row.d], [0.0, 0.0, 0.0, 1.0]])


def craig_bodies(description: RobotDescription) -> tuple[CraigBody, ...]:
    """Returns base and links, base first; the base has the frame of the base."""
    bodies: list[CraigBody] = []
    T_base_joint = np.eye(4)
    for row, link in zip((None, *CRAIG[:-1]), (description.base, *description.links), strict=True):
        T_base_joint = T_base_joint if row is None else T_base_joint @ craig_placement(row)
        R = T_base_joint[:3, :3].T
        center = R @ (link.origin + link.center_of_mass - T_base_joint[:3, 3])
        inertia = R @ link.inertia @ R.T
        bodies.append(CraigBody(link.mass, center, (inertia + inertia.T) / 2.0))
    return tuple(bodies)
