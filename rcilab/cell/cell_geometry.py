"""Distances of an arm and what it carries from the obstacles of a cell, and of what it carries from links and floor.

Between two configurations the distance of a pair changes by at most the travel of its points. A query therefore
subtracts that from the last known distance of every pair, and computes only those that could still be the nearest.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# pinocchio defines its names in compiled code at import; pyright does not know them.

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rcilab.cell.cell import Cell
from rcilab.cell.collision_solid import convex_solids, half_space
from rcilab.cell.shapes import Solid
from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clearance import FLOOR, OBSTACLE, PART, TOOL, ClearanceLimit, LinkPair
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.kinematics.collision import ClearanceQuery, CollisionGeometry, capsule_solid, compute_levers
from rcilab.model.robot_model import RobotModel
from rcilab.robots.description import RobotDescription
from rcilab.robots.shapes import Capsule
from rcilab.robots.upright import upright_flange

_ROUNDING = 1e-6  # [m] Of distances, which coal iterates to this tolerance.


class _Body(NamedTuple):
    """A convex solid of the geometry model: its number there, its joint, its number in a `LinkPair`."""

    solid: int
    joint: int
    link: int


class _Pairs:
    """Pairs of bodies whose smallest distance is sought. Immutable.

    Args:
        geometry: pinocchio's geometry model, to which they are added.
        pairs: The two bodies of each; the first moves with a later joint than the second.
        n: Number of joints.
    """

    def __init__(self, geometry: Any, pairs: list[tuple[_Body, _Body]], n: int) -> None:
        self.numbers: list[int] = []
        for first, second in pairs:
            self.numbers.append(len(geometry.collisionPairs))
            geometry.addCollisionPair(pin.CollisionPair(first.solid, second.solid))
        self.links = [_link_pair(first.link, second.link) for first, second in pairs]
        joints = np.arange(1, n + 1)
        first, second = (np.array([pair[k].joint for pair in pairs], dtype=np.intp)[:, np.newaxis] for k in (0, 1))
        self.between: NDArray[np.float64] = ((second < joints) & (joints <= first)).astype(np.float64)
        """Whether a joint moves the two of a pair against each other, shape (pairs, n)."""


class CellGeometry:
    """The arm, what it carries, the obstacles, and the pairs to check. Immutable.

    Args:
        own: The capsules of the arm.
        description: The arm.
        T_flange_tool: Pose of the tool.
        cell: The cell.
        floor_height: Height of the floor in the base frame, [m]; None without a floor.
    """

    def __init__(
        self,
        own: CollisionGeometry,
        description: RobotDescription,
        T_flange_tool: Pose,
        cell: Cell,
        floor_height: float | None,
    ) -> None:
        self.own = own
        self.model = pin.GeometryModel()
        n = description.n
        links = [
            self._add(capsule_solid(capsule, min(number, n)), number if number <= n else TOOL)
            for number, capsules in enumerate(self.own.bodies)
            for capsule in capsules
        ]
        carried = self._add_carried(description, T_flange_tool, cell)
        obstacles = [
            body
            for index, obstacle in enumerate(cell.obstacles)
            for body in self._add_solid(cell.solid(obstacle.name), 0, OBSTACLE - index)
        ]
        may_touch = [{{"tool": TOOL, "part": PART}[one] for one in obstacle.may_touch} for obstacle in cell.obstacles]
        moving = [body for body in links if body.link != 0] + carried
        self.obstacles = self._pair(
            [(a, b) for a in moving for b in obstacles if a.link not in may_touch[OBSTACLE - b.link]], n
        )
        before = [body for body in links if 0 <= body.link < n - 1]  # Carried bodies touch the last two links.
        self.links = self._pair([(a, b) for a in carried for b in before], n)
        floor: list[_Body] = []
        if floor_height is not None:
            plane = pin.GeometryObject("", 0, pin.SE3.Identity(), half_space(floor_height))
            floor.append(self._add(plane, FLOOR))
        self.floor = self._pair([(a, b) for a in carried for b in floor], n)
        self.levers = readonly_copy(compute_levers(description, [*self.own.bodies, self._around(carried)]))
        """Largest distance of any point of arm, tool or part from each joint's axis, shape (n,), [m]."""
        self.names = tuple(obstacle.name for obstacle in cell.obstacles)

    def _add(self, solid: Any, link: int) -> _Body:
        solid.name = str(self.model.ngeoms)
        return _Body(self.model.addGeometryObject(solid), solid.parentJoint, link)

    def _add_solid(self, solid: Solid, joint: int, link: int, T_joint: Pose = IDENTITY) -> list[_Body]:
        pose = T_joint @ solid.pose
        placement = pin.SE3(pose.rotation.copy(), pose.position.copy())
        return [
            self._add(pin.GeometryObject("", joint, placement, shape), link) for shape in convex_solids(solid.shape)
        ]

    def _add_carried(self, description: RobotDescription, T_flange_tool: Pose, cell: Cell) -> list[_Body]:
        """Adds the bodies of tool and part, on the last link."""
        T_link_flange = np.eye(4)
        T_link_flange[:3, :3] = upright_flange(description).rotation
        groups = [(TOOL, () if cell.tool is None else cell.tool.solids_at())]
        if cell.part is not None:
            groups.append((PART, cell.part.at_flange(T_flange_tool)[1]))
        T = Pose.from_matrix(T_link_flange)
        return [
            body
            for link, solids in groups
            for solid in solids
            for body in self._add_solid(solid, description.n, link, T)
        ]

    def _around(self, bodies: list[_Body]) -> list[Capsule]:
        """Returns spheres around bodies, in the frame of their link."""
        found: list[Capsule] = []
        for body in bodies:
            solid = self.model.geometryObjects[body.solid]
            solid.geometry.computeLocalAABB()
            center = solid.placement.act(solid.geometry.aabb_center)
            found.append(Capsule(center, center, float(solid.geometry.aabb_radius)))
        return found

    def _pair(self, pairs: list[tuple[_Body, _Body]], n: int) -> _Pairs:
        return _Pairs(self.model, pairs, n)


class CellQuery:
    """Computes distances, configuration by configuration. Owned by one thread.

    Args:
        geometry: The solids and pairs.
    """

    def __init__(self, geometry: CellGeometry) -> None:
        self._geometry, self._own = geometry, ClearanceQuery(geometry.own)
        self._links, self._floor, self._obstacles = (
            _Search(geometry, pairs) for pairs in (geometry.links, geometry.floor, geometry.obstacles)
        )

    def links(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance between two links, or of what the arm carries from a link; q as of `cell`."""
        return min(self._own.links(q), self._links.nearest(q))

    def floor(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance from the floor; q as of `cell`."""
        return min(self._own.floor(q), self._floor.nearest(q))

    def cell(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance from an obstacle, [m], and the pair; infinite without an obstacle.

        Args:
            q: Joint angles, shape (n,), [rad].
        """
        distance, pair = self._obstacles.nearest(q)
        return distance, self._named(pair)

    def closest(self, q: JointVector) -> ClosestPoints | None:
        """Returns where arm and obstacles are nearest to each other; None without an obstacle. q as of `cell`."""
        found = self._obstacles.closest(q)
        return None if found is None else found._replace(pair=self._named(found.pair))

    def _named(self, pair: LinkPair) -> LinkPair:
        first, second, _ = pair
        return LinkPair(first, second, self._geometry.names[OBSTACLE - second] if second <= OBSTACLE else "")


class ClosestPoints(NamedTuple):
    """Where two bodies are nearest to each other."""

    distance: float
    """Below 0 for an overlap, [m]."""
    pair: LinkPair
    points: Array
    """On the arm, and on the obstacle, in base, shape (2, 3), [m]."""


class _Search:
    """The nearest of some pairs, and what is known of the others from the configuration before."""

    def __init__(self, geometry: CellGeometry, pairs: _Pairs) -> None:
        self._geometry, self._pairs = geometry, pairs
        self._joints, self._solids = geometry.own.tree.createData(), geometry.model.createData()
        self._low = np.full(len(pairs.links), -np.inf)
        self._q: Array = np.zeros(len(geometry.levers))

    def nearest(self, q: JointVector) -> tuple[float, LinkPair]:
        pairs, low = self._pairs, self._low
        best, pair = float("inf"), LinkPair(TOOL, FLOOR)
        if not len(low):
            return best, pair
        low -= pairs.between @ (np.abs(q - self._q) * self._geometry.levers) + _ROUNDING
        self._q = q
        pin.updateGeometryPlacements(self._geometry.own.tree, self._joints, self._geometry.model, self._solids, q)
        open_pairs = low.copy()
        while True:
            k = int(open_pairs.argmin())
            if not open_pairs[k] < best:
                return best, pair
            found = pin.computeDistance(self._geometry.model, self._solids, pairs.numbers[k]).min_distance
            low[k], open_pairs[k] = found, np.inf
            if found < best:
                best, pair = found, pairs.links[k]

    def closest(self, q: JointVector) -> ClosestPoints | None:
        self.nearest(q)
        if not len(self._low):
            return None
        k = int(self._low.argmin())  # Those that are not computed are farther.
        found = pin.computeDistance(self._geometry.model, self._solids, self._pairs.numbers[k])
        points = np.stack([found.getNearestPoint1(), found.getNearestPoint2()])
        return ClosestPoints(found.min_distance, self._pairs.links[k], points)


def closest_points(model: RobotModel, cell: Cell, distance: ClearanceLimit, q: JointVector) -> ClosestPoints | None:
    """Returns where an arm and the obstacles of a cell are nearest to each other; None without an obstacle.

    Args:
        model: The arm, with the tool of the cell.
        cell: The cell.
        distance: Required distances, with the floor of the cell.
        q: Joint angles, shape (n,), [rad].
    """
    return CellQuery(cell_geometry(model, cell, distance)).closest(q)


def cell_geometry(model: RobotModel, cell: Cell, distance: ClearanceLimit) -> CellGeometry:
    """Returns the geometry of an arm in a cell; cached for the same cell.

    Args:
        model: The arm, with the tool of the cell.
        cell: The cell.
        distance: Required distances, with the floor of the cell.
    """
    own, tool = model.collision_geometry(distance), model.T_flange_tool.as_row_major()
    return _build(own, model.description, tool, cell, distance.floor_height)


@lru_cache(maxsize=16)
def _build(
    own: CollisionGeometry,
    description: RobotDescription,
    tool: tuple[float, ...],
    cell: Cell,
    floor_height: float | None,
) -> CellGeometry:
    return CellGeometry(own, description, Pose.from_row_major(tool), cell, floor_height)


def _link_pair(first: int, second: int) -> LinkPair:
    """Returns two in the order of texts: links by their number, then floor, tool, part and obstacles."""
    first, second = sorted((first, second), key=lambda number: (number < 0, abs(number)))
    return LinkPair(first, second)
