"""Tool and load of a cell, as a controller has them: its interface rounds their numbers."""

from __future__ import annotations

import numpy as np

from rcilab.cell.cell import Cell
from rcilab.core.spatial import Pose, rotation_between
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel

# The coarsest units of an interface are 1 um, 1 mrad about each axis, and 1 g: half a unit, and single precision.
_POSITION = 1e-6  # [m]
_ROTATION = 1e-3  # [rad]
_MASS = 6e-4  # [kg]
_INERTIA = 1e-6  # [kg m^2] Of single precision, for what an arm carries.


def without_rounding(model: RobotModel, cell: Cell) -> RobotModel:
    """Returns a model with exactly the tool and load of its cell, if it differs from them only by rounding.

    Args:
        model: The arm, as its controller reports it.
        cell: Its cell.

    Raises:
        InvalidValueError: The cell is that of another arm, or its load is too heavy.
    """
    exact = cell.applied_to(model)
    is_same = is_same_tool(exact.T_flange_tool, model.T_flange_tool) and is_same_load(exact.load, model.load)
    return exact if is_same else model


def is_same_tool(tool: Pose, other: Pose) -> bool:
    """Returns whether two poses in the flange frame differ only by rounding."""
    turned = rotation_between(tool.parts[0], other.parts[0])
    return bool(np.abs(tool.position - other.position).max() <= _POSITION and np.linalg.norm(turned) <= _ROTATION)


def is_same_load(load: Payload, other: Payload) -> bool:
    """Returns whether a load as a controller reports it, `other`, differs from another one only by rounding."""
    has_inertia = bool(other.inertia.any())  # Not every interface has it.
    return bool(
        abs(load.mass - other.mass) <= _MASS
        and (not load.mass or np.abs(load.center_of_mass - other.center_of_mass).max() <= _POSITION)
        and (not has_inertia or np.abs(load.inertia - other.inertia).max() <= _INERTIA)
    )
