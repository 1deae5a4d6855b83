"""The model of a session with the tool and the load that its controller reports, and a warning if they are others."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.spatial import IDENTITY, Pose, rotation_between
from rcilab.model.dynamics.payload import Payload

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_SAME_TOOL = 1e-3  # [m], [rad] The accuracy of an arm's own geometry.
_SAME_MASS = 1e-3  # [kg]
_SAME_CENTER = 1e-3  # [m]
_CALLER = 6  # That of `connect`.


def with_reported_tool(model: RobotModel, tool: Pose, name: str) -> RobotModel:
    """Returns the model with the tool of its controller; warns if the model has another one.

    Poses of a session with another tool than its controller's would be off by the difference.

    Args:
        model: The arm.
        tool: Pose of the tool in the flange frame, as the controller has it.
        name: Name of the controller in the warning.
    """
    mine = model.T_flange_tool
    off = float(np.linalg.norm(tool.position - mine.position))
    turned = math.hypot(*rotation_between(tool.parts[0], mine.parts[0]))
    if off < _SAME_TOOL and turned < _SAME_TOOL:
        return model
    if not mine.is_close(IDENTITY, 0.0):
        warnings.warn(
            f"the tool of {name} is {1e3 * off:.1f} mm and {math.degrees(turned):.1f} deg from the model's; the "
            "session goes on with the controller's. robot.set_tool(model.T_flange_tool), or connect(..., apply=True), "
            "sends the model's",
            stacklevel=_CALLER,
        )
    return model.with_tool(tool)


def with_reported_load(model: RobotModel, load: Payload, name: str) -> RobotModel:
    """Returns the model with the load of its controller, if that reports it; warns if the model has another one.

    Of a load above the rated payload, the model has as much as the arm is rated for, and a warning says so.

    Args:
        model: The arm.
        load: The load, as the controller has it.
        name: Name of the controller in the warning.
    """
    rated = model.description.rated_payload
    if load.mass > rated:
        warnings.warn(
            f"the load of {name} is {load.mass:g} kg, above the {rated:g} kg that {model.name} is rated for; the "
            f"session goes on with {rated:g} kg of it. Check the load and the end effector that are set there",
            stacklevel=_CALLER,
        )
        share = rated / load.mass
        load = Payload(mass=rated, center_of_mass=load.center_of_mass, inertia=share * load.inertia)
    mine = model.load
    off = float(np.linalg.norm(load.center_of_mass - mine.center_of_mass)) if load.mass else 0.0
    if abs(load.mass - mine.mass) < _SAME_MASS and off < _SAME_CENTER:
        return model
    if mine.mass:
        warnings.warn(
            f"the load of {name} is {load.mass:.3g} kg, that of the model {mine.mass:.3g} kg or elsewhere; the session "
            "goes on with the controller's. robot.set_load, or connect(..., apply=True), sends the model's",
            stacklevel=_CALLER,
        )
    return model.with_load(load)
