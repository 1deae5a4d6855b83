"""The distances of an arm, in a cell or without one."""

from __future__ import annotations

from typing import Protocol

from rcilab.cell.cell import Cell
from rcilab.core.arrays import Array, JointVector
from rcilab.core.clearance import ClearanceLimit, LinkPair
from rcilab.model.robot_model import RobotModel


class DistanceQuery(Protocol):
    """Computes distances in one configuration, [m], and their pairs; q has the shape (n,), [rad]."""

    def links(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance between two links, tool and part included."""
        ...

    def floor(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance from the floor."""
        ...

    def cell(self, q: JointVector) -> tuple[float, LinkPair]:
        """Returns the smallest distance from an obstacle; infinite without one."""
        ...


def build_query(model: RobotModel, distance: ClearanceLimit, cell: Cell | None) -> tuple[DistanceQuery, Array]:
    """Returns a query, owned by one thread, and the largest distance of the arm from each joint's axis, (n,), [m].

    Args:
        model: The arm, with its tool.
        distance: Required distances, with the floor.
        cell: The cell; None without one.
    """
    from rcilab.cell.cell_geometry import CellQuery, cell_geometry
    from rcilab.model.kinematics.collision import ClearanceQuery

    if cell is None:
        own = model.collision_geometry(distance)
        return ClearanceQuery(own), own.levers
    geometry = cell_geometry(model, cell, distance)
    return CellQuery(geometry), geometry.levers
