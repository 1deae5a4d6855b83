"""Distances between the links and to the floor, computed by coal from the capsules of the URDF.

Neighbouring links are not checked, because their housings share a joint and always touch. All other pairs are; none of
them touch within the joint limits (covered by a test). The floor is checked against every link that can move
vertically.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# pinocchio and coal define their names in compiled code at import; pyright does not know them.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from math import hypot
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath, JointVector, Vector3, readonly_copy
from rcilab.core.clearance import FLOOR, OBSTACLE, TOOL, LinkPair
from rcilab.robots.description import MountedTool, RobotDescription
from rcilab.robots.shapes import Capsule, build_shapes, tool_capsules
from rcilab.robots.upright import upright_flange, upright_joints

_AXIS_THRESHOLD = 0.5  # Between the components of axes along y and along z.


@dataclass(frozen=True, slots=True, eq=False)
class Clearance:
    """The smallest distance between two links, or a link and the floor, and their numbers."""

    distance: Array
    """Distance, negative for an overlap, shape () or (N,), [m]; infinite without a pair to check."""
    links: NDArray[np.intp]
    """Numbers of the two, shape (2,) or (N, 2): 0 the base, n the last link, -1 the floor, -2 the tool."""

    def __repr__(self) -> str:
        if self.distance.ndim:
            worst = int(self.distance.argmin())
            return f"<Clearance of {len(self.distance)} rows: smallest {self._text(worst)} in row {worst}>"
        return f"<Clearance: {self._text(())}>"

    def _text(self, row: int | tuple[()]) -> str:
        return f"{self.distance[row]:.4g} m between {LinkPair(*self.links[row].tolist())}"


class CollisionGeometry:
    """The capsules of an arm, the pairs to check, and the levers of the joints. Immutable.

    Args:
        description: The arm.
        tool: Capsules of the tool in the frame of the last link.
        floor_height: Height of the floor in the base frame, [m]; None without a floor.
    """

    def __init__(self, description: RobotDescription, tool: tuple[Capsule, ...], floor_height: float | None) -> None:
        shape = build_shapes(description, "coarse")
        self.bodies = [link.capsules for link in (shape.base, *shape.links)]
        if tool:
            self.bodies.append(tool)
        self.tree = _tree(description)
        n = description.n
        # The tool is fixed to the last link, so neither is compared with the neighbours of the other.
        names = [*range(n + 1), TOOL][: len(self.bodies)]
        checked_pairs = [LinkPair(a, b) for a, b in combinations(names, 2) if (b - a > 1 if b != TOOL else a < n - 1)]
        self.links, self.link_pairs = self._compare(checked_pairs, None)
        moving_vertically = names[_first_moving_vertically(description) :] if floor_height is not None else []
        self.floor, self.floor_pairs = self._compare(
            [LinkPair(name, FLOOR) for name in moving_vertically], floor_height
        )
        self.levers = readonly_copy(compute_levers(description, self.bodies))
        """Largest distance of any point of the arm from each joint's axis, shape (n,), [m]."""

    def _compare(self, pairs: list[LinkPair], floor_height: float | None) -> tuple[Any, list[LinkPair]]:
        """Returns pinocchio's geometry for some pairs, and the pair of each of its comparisons."""
        geometry = pin.GeometryModel()
        last = self.tree.njoints - 1
        solids = {
            number if number <= last else TOOL: [
                geometry.addGeometryObject(capsule_solid(capsule, min(number, last))) for capsule in capsules
            ]
            for number, capsules in enumerate(self.bodies)
        }
        if floor_height is not None:
            plane = coal.Halfspace(np.array([0.0, 0.0, 1.0]), floor_height)
            solids[FLOOR] = [geometry.addGeometryObject(pin.GeometryObject("floor", 0, pin.SE3.Identity(), plane))]
        pair_of_comparison: list[LinkPair] = []
        for pair in pairs:
            for a in solids[pair.first]:
                for b in solids[pair.second]:
                    geometry.addCollisionPair(pin.CollisionPair(a, b))
                    pair_of_comparison.append(pair)
        return geometry, pair_of_comparison


class ClearanceQuery:
    """Computes distances, configuration by configuration. Owned by one thread.

    Args:
        geometry: The capsules and pairs.
    """

    def __init__(self, geometry: CollisionGeometry) -> None:
        self._geometry = geometry
        self._data = geometry.tree.createData()
        self._links, self._floor = geometry.links.createData(), geometry.floor.createData()

    def links(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance between two links, [m], and the pair; q of shape (n,), [rad]."""
        return self._nearest(self._geometry.links, self._links, self._geometry.link_pairs, q)

    def floor(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance of a link from the floor, [m], and the pair; infinite without a floor."""
        if not self._geometry.floor_pairs:
            return float("inf"), LinkPair(self._geometry.tree.njoints - 1, FLOOR)
        return self._nearest(self._geometry.floor, self._floor, self._geometry.floor_pairs, q)

    def cell(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns an infinite distance: an arm alone has no obstacles."""
        del q
        return float("inf"), LinkPair(self._geometry.tree.njoints - 1, OBSTACLE)

    def path(self, q: JointPath) -> Clearance:
        """Returns the smaller of both distances for every row of q, shape (N, n), [rad]."""
        distance, links = np.empty(len(q)), np.empty((len(q), 2), dtype=np.intp)
        for row, angles in enumerate(q):
            distance[row], pair = min(self.links(angles), self.floor(angles))
            links[row] = pair[:2]
        return Clearance(distance, links)

    def _nearest(self, geometry: Any, data: Any, pairs: list[LinkPair], q: JointVector) -> tuple[float, LinkPair]:
        index = pin.computeDistances(self._geometry.tree, self._data, geometry, data, q)
        return data.distanceResults[index].min_distance, pairs[index]


@lru_cache(maxsize=32)
def collision_geometry(
    description: RobotDescription,
    tool: tuple[float, float, float],
    floor_height: float | None,
    tool_radius: float | None,
    mounted: MountedTool | None,
) -> CollisionGeometry:
    """Returns the geometry of an arm with a tool; cached.

    Args:
        description: The arm.
        tool: Origin of the tool in the flange, [m].
        floor_height: Height of the floor in the base frame, [m]; None without a floor.
        tool_radius: Radius of a capsule from the flange to the tool's origin, [m]; None without one.
        mounted: A tool of the maker, with its own capsules; None without one.
    """
    capsules = tool_capsules(description, mounted)
    if tool_radius is not None and any(tool):
        end = upright_flange(description).rotation @ np.array(tool)
        capsules = (*capsules, Capsule(readonly_copy([0.0, 0.0, 0.0]), readonly_copy(end), tool_radius))
    return CollisionGeometry(description, capsules, floor_height)


def _tree(description: RobotDescription) -> pin.Model:
    """Returns the joints between the upright link frames as a pinocchio model."""
    tree = pin.Model()
    for number, joint in enumerate(upright_joints(description), start=1):
        tree.addJoint(number - 1, _joint_type(joint.axis), pin.SE3(np.eye(3), joint.origin.copy()), f"joint{number}")
    return tree


def _joint_type(axis: Vector3) -> Any:
    """Returns the fastest joint type for an axis."""
    if axis[2] > _AXIS_THRESHOLD:
        return pin.JointModelRZ()
    return pin.JointModelRY() if axis[1] > _AXIS_THRESHOLD else pin.JointModelRevoluteUnaligned(axis.copy())


def capsule_solid(capsule: Capsule, link: int) -> Any:
    """Returns a capsule for pinocchio, fixed to a link; that of the tool belongs to the last link."""
    line = capsule.end - capsule.start
    length = float(np.linalg.norm(line))
    rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), line) if length else pin.Quaternion.Identity()
    placement = pin.SE3(rotation.matrix(), (capsule.start + capsule.end) / 2.0)
    return pin.GeometryObject("capsule", link, placement, coal.Capsule(capsule.radius, length))


def _first_moving_vertically(description: RobotDescription) -> int:
    """Returns the first link that moves vertically; those before it only rotate about the vertical."""
    axes = [joint.axis for joint in upright_joints(description)]
    return next(number for number, axis in enumerate(axes, start=1) if abs(axis[2]) < _AXIS_THRESHOLD)


def compute_levers(description: RobotDescription, bodies: Sequence[Sequence[Capsule]]) -> list[float]:
    """Returns the largest distance of the following links from each joint's axis, for any angles of later joints, [m].

    Args:
        description: The arm.
        bodies: Capsules of base and links, in their frames; more of them belong to the last link.

    Computed link by link from the flange. The following links are represented by horizontal rings: centre in the link's
    frame, radius and thickness. A z joint rotates a ring about its axis; any other joint sweeps it into a ball.
    """
    levers: list[float] = []
    rings: list[tuple[float, float, float, float, float]] = []
    for number, joint in reversed(list(enumerate(upright_joints(description), start=1))):
        own = bodies[number] if number < description.n else [c for body in bodies[number:] for c in body]
        rings += [(*point.tolist(), 0.0, c.radius) for c in own for point in (c.start, c.end)]
        if abs(joint.axis[2]) > _AXIS_THRESHOLD:
            rings = [(0.0, 0.0, z, hypot(x, y) + ring, radius) for x, y, z, ring, radius in rings]
            levers.append(max(ring + radius for *_, ring, radius in rings))
        else:
            levers.append(max(hypot(abs(x) + ring, z) + radius for x, _, z, ring, radius in rings))
            rings = [(0.0, 0.0, 0.0, 0.0, max(hypot(hypot(x, y) + ring, z) + r for x, y, z, ring, r in rings))]
        dx, dy, dz = joint.origin.tolist()
        rings = [(x + dx, y + dy, z + dz, ring, radius) for x, y, z, ring, radius in rings]
    return levers[::-1]
