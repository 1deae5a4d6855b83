"""What an arm is, as data: geometry, limits and inertias, each with the place the number came from."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.arrays import JointVector, Matrix, Vector3
from rcilab.limits import Limits


@dataclass(frozen=True, slots=True, kw_only=True)
class DhRow:
    """One row of a standard (distal) Denavit-Hartenberg table: RotZ(theta) TransZ(d) TransX(a) RotX(alpha)."""

    a: float
    """[m]."""
    alpha: float
    """[rad]."""
    d: float
    """[m]."""
    theta_offset: float = 0.0
    """Added to the joint angle, [rad]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Link:
    """A rigid body of the arm.

    Its frame is parallel to the base frame when all joint angles are zero, and its origin is then on the base z axis.
    """

    mass: float
    """[kg]."""
    center_of_mass: Vector3
    """In the link's frame, shape (3,), [m]."""
    inertia: Matrix
    """About the centre of mass, axes of the link's frame, shape (3, 3), [kg m^2]."""
    origin_height: float
    """Height of the link frame's origin above the base when all joint angles are zero, [m]."""
    source: str
    """Where mass, centre and tensor were taken from."""

    def __repr__(self) -> str:
        centre = " ".join(f"{x:.4g}" for x in self.center_of_mass.tolist())
        return f"<Link of {self.mass:.4g} kg, centre of mass at {centre} m: .inertia, .origin_height, .source>"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RobotDescription:
    """An arm: everything the rest of the package computes from."""

    name: str
    """Name as the manual spells it, such as xMatePro7."""
    dh: tuple[DhRow, ...]
    """One row a joint, base to flange."""
    dh_source: str
    """Where the table was taken from, and what was added to it."""
    base: Link
    """The body that does not move."""
    links: tuple[Link, ...]
    """The moving bodies, one a joint, base to flange."""
    limits: Limits
    home: JointVector
    """A comfortable pose away from limits and singularities, shape (n,), [rad]."""
    rated_payload: float
    """Largest load, [kg]."""
    rated_payload_source: str

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.dh)

    def __repr__(self) -> str:
        mass = sum(link.mass for link in self.links)
        return (
            f"<RobotDescription {self.name}: {self.n} joints, {mass:.4g} kg moving, carries {self.rated_payload:g} kg; "
            ".dh, .base, .links, .limits, .home>"
        )
