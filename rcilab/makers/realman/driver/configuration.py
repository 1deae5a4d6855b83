"""Sending a configuration to a RealMan controller: tool, load, ranges of the joints, and parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import InvalidValueError
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, require_control

if TYPE_CHECKING:
    from rcilab.makers.realman.driver.settings import RealManSettings


def send_parameters(settings: RealManSettings, control: ControllerParameters) -> None:
    """Sends parameters to a controller at standstill. After a refusal, earlier ones are in force.

    Args:
        settings: The settings of a connection.
        control: The parameters.

    Raises:
        InvalidValueError: A number is outside its range, or the collision stage not whole; it was not sent.
        CommandRejectedError: The controller refused; the error names the request.
    """
    known = {
        "joint_velocity": lambda *values: settings.set_joint_velocities(values),
        "joint_acceleration": lambda *values: settings.set_joint_accelerations(values),
        "tool_limits": settings.set_tool_limits,
        "collision_stage": lambda value: settings.set_collision_stage(_whole(value)),
    }
    unknown = require_control(control).keys() - known
    if unknown:
        raise InvalidValueError("control", sorted(unknown), f"does not exist; known: {', '.join(known)}")
    for name, send in known.items():
        if name in control:
            send(*control[name])


def send_configuration(settings: RealManSettings, setup: RobotConfiguration) -> None:
    """Sends a configuration to a controller at standstill. After a refusal, earlier parts are in force.

    Args:
        settings: The settings of a connection.
        setup: The configuration; the interface has no safety box and no force-control frame.

    Raises:
        CommandRejectedError: The controller refused a part; the error names the request.
    """
    if setup.tool is not None:
        settings.set_tool(setup.tool)
    if setup.load is not None:
        settings.set_load(setup.load.mass, setup.load.center_of_mass, setup.load.inertia)
    if setup.joints is not None:
        settings.set_joint_ranges(setup.joints.lower, setup.joints.upper)
    if setup.control is not None:
        send_parameters(settings, setup.control)


def _whole(value: float) -> int:
    if value != round(value):
        raise InvalidValueError("collision_stage", value, "must be a whole number from 0 to 8")
    return round(value)
