"""The description of an arm: geometry, limits and inertias, each with its source."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from rcilab.core.arrays import JointVector, Matrix, Vector3, readonly_copy
from rcilab.core.condition import ConditionTable
from rcilab.core.fault import FaultCode
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose


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


@dataclass(frozen=True, slots=True, kw_only=True)
class CraigRow:
    """One row of a Craig (proximal, modified) Denavit-Hartenberg table: RotX(alpha) TransX(a) RotZ(theta) TransZ(d)."""

    a: float
    """[m]."""
    alpha: float
    """[rad]."""
    d: float
    """[m]."""
    theta_offset: float = 0.0
    """Added to the joint angle, [rad]."""


def rows_from_craig(table: Sequence[CraigRow]) -> tuple[DhRow, ...]:
    """Returns the standard rows of the chain that a Craig table describes.

    Both are the same product, grouped differently: rotation and translation along z of one row are combined with those
    along x of the next. The pose of the flange is the same at all joint angles; the frames between follow the
    standard convention and lie on the next joint's axis, not on their own.

    Args:
        table: One row per joint and one for the flange; the first joint turns about the base z axis.

    Raises:
        ValueError: The first or the flange row has a translation or rotation that the standard table cannot express.
    """
    first, *_, flange = table
    if first.a or first.alpha or flange.a or flange.alpha:
        raise ValueError("a Craig table needs joint 1 on the base z axis and the flange on the last joint's axis")
    rows = [
        DhRow(a=after.a, alpha=after.alpha, d=row.d, theta_offset=row.theta_offset) for row, after in pairwise(table)
    ]
    rows[-1] = DhRow(a=0.0, alpha=0.0, d=table[-2].d + flange.d, theta_offset=table[-2].theta_offset)
    return tuple(rows)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rod:
    """A round rod with spherical ends, in the link's frame: shape and collision capsule of a link without a drawing."""

    start: tuple[float, float, float]
    """[m]."""
    end: tuple[float, float, float]
    """[m]."""
    radius: float
    """[m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Link:
    """A rigid body of the arm.

    Its frame is parallel to the base frame when all joint angles are zero, and its origin is then in the base's xz
    plane, unless the arm has an offset across it.
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
    """Source of mass, centre and tensor."""
    origin_ahead: float = 0.0
    """Distance of that origin from the base z axis along base x when all joint angles are zero, [m]."""
    origin_aside: float = 0.0
    """The same along base y, [m]."""

    @property
    def origin(self) -> Vector3:
        """Origin of the link's frame in base when all joint angles are zero, shape (3,), [m]."""
        return readonly_copy([self.origin_ahead, self.origin_aside, self.origin_height])

    def __repr__(self) -> str:
        centre = " ".join(f"{x:.4g}" for x in self.center_of_mass.tolist())
        return f"<Link of {self.mass:.4g} kg, centre of mass at {centre} m: .inertia, .origin_height, .source>"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MountedTool:
    """A tool that a maker sells for an arm: a hand, a gripper."""

    name: str
    """In small letters, such as "hand"."""
    T_flange_tool: Pose
    mass: float
    """[kg]."""
    center_of_mass: Vector3
    """In the flange frame, shape (3,), [m]."""
    inertia: Matrix
    """About the centre of mass, axes of the flange frame, shape (3, 3), [kg m^2]."""
    source: str
    """Source of pose, mass, centre and tensor."""
    rods: tuple[Rod, ...] = ()
    """Its shape in the flange frame, for collisions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoFigures:
    """The position servo of a joint, as a second-order system."""

    bandwidth: float
    """Natural frequency, [rad/s]."""
    damping: float
    """Damping ratio, [1]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointImperfection:
    """What a real joint has and its model has not."""

    friction: float
    """Coulomb friction, [N m]."""
    torque_step: float
    """Resolution of the torque reading, [N m]."""
    torque_noise: float
    """Standard deviation of its noise from one cycle to the next, [N m]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RobotDescription:
    """An arm: the data that all computations use."""

    name: str
    """Name, spelled as by the maker."""
    dh: tuple[DhRow, ...]
    """One row per joint, base to flange."""
    dh_source: str
    """Source of the table, and changes to it."""
    base: Link
    """The fixed body."""
    links: tuple[Link, ...]
    """The moving bodies, one per joint, base to flange."""
    limits: Limits
    home: JointVector
    """Joint angles away from limits and singularities, shape (n,), [rad]."""
    rated_payload: float
    """Rated payload, [kg]."""
    rated_payload_source: str
    maker: str = ""
    """Name of its maker: the folder in `rcilab/makers`; empty for an arm without a driver."""
    faults: type[FaultCode] = FaultCode
    """The faults of the maker's controller."""
    conditions: Callable[[], ConditionTable] | None = None
    """Returns the conditions of the maker's interface; None: the common ones, which raise no fault."""
    elbow_flip: float | None = None
    """Angle of joint 4 beyond which the elbow counts as flipped, [rad]; None if the maker defines no flip."""
    servos: tuple[ServoFigures, ...] | None = None
    """Response of the joints to commands that stop coming, one per joint; None: no figures."""
    imperfections: tuple[JointImperfection, ...] | None = None
    """Friction and torque sensors of real joints, one per joint; None: no figures."""
    rotor_inertia: JointVector | None = None
    """Rotor inertia at the joints under commanded torques, shape (n,), [kg m^2]; None: the drives compensate it."""
    damping: JointVector | None = None
    """Viscous friction at the joints under commanded torques, shape (n,), [N m s/rad]; None: it is compensated."""
    rods: tuple[tuple[Rod, ...], ...] | None = None
    """Shapes of base and links for drawing and collisions, base first; None for arms with designed housings."""
    friction: tuple[JointVector, JointVector, JointVector] | None = None
    """Identified joint friction: viscous [N m s/rad], Coulomb [N m] and offset [N m], each of shape (n,); None if it is
    not known."""
    tools: tuple[MountedTool, ...] = ()
    """Tools of the maker, which `load_model` and `with_tool` take by name."""
    nominal: RobotDescription | None = None
    """The arm of the maker's table if this one is calibrated: its shapes, and the frames of its links."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.dh)

    def find_tool_at(self, T_flange_tool: Pose) -> MountedTool | None:
        """Returns the maker's tool whose frame is at a pose in the flange frame, within single precision, or None."""
        return next((tool for tool in self.tools if tool.T_flange_tool.is_close(T_flange_tool, 1e-6)), None)

    def __repr__(self) -> str:
        mass = sum(link.mass for link in self.links)
        return (
            f"<RobotDescription {self.name}: {self.n} joints, {mass:.4g} kg moving, carries {self.rated_payload:g} kg; "
            ".dh, .base, .links, .limits, .home>"
        )
