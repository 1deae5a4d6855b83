"""Sending a configuration to a UFACTORY controller: tool, load, boundary, ranges of the joints, and parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import InvalidValueError
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, require_control

if TYPE_CHECKING:
    from rcilab.makers.ufactory.driver.settings import XArmSettings


def send_parameters(settings: XArmSettings, control: ControllerParameters) -> None:
    """Sends parameters to a controller at standstill. After a refusal, earlier ones are in force.

    Args:
        settings: The settings of a connection.
        control: The parameters.

    Raises:
        InvalidValueError: A number is outside its range, or a sensitivity not whole; it was not sent.
        CommandRejectedError: The controller refused; the error names the request.
    """
    known = {
        "collision_sensitivity": lambda value: settings.set_collision_sensitivity(_whole(value)),
        "teach_sensitivity": lambda value: settings.set_teach_sensitivity(_whole(value)),
        "motion_limits": settings.set_motion_limits,
    }
    unknown = require_control(control).keys() - known
    if unknown:
        raise InvalidValueError("control", sorted(unknown), f"does not exist; known: {', '.join(known)}")
    for name, send in known.items():
        if name in control:
            send(*control[name])


def send_configuration(settings: XArmSettings, setup: RobotConfiguration) -> None:
    """Sends a configuration to a controller at standstill. After a refusal, earlier parts are in force.

    Args:
        settings: The settings of a connection.
        setup: The configuration; the interface has no force-control frame.

    Raises:
        CommandRejectedError: The controller refused a part; the error names the request.
    """
    if setup.tool is not None:
        settings.set_tool(setup.tool)
    if setup.load is not None:
        settings.set_load(setup.load.mass, setup.load.center_of_mass, setup.load.inertia)
    if setup.box is not None:
        settings.set_boundary(setup.box)
    if setup.joints is not None:
        settings.set_joint_ranges(setup.joints.lower, setup.joints.upper)
    if setup.control is not None:
        send_parameters(settings, setup.control)


def _whole(value: float) -> int:
    if value != round(value):
        raise InvalidValueError("sensitivity", value, "must be a whole number from 0 to 5")
    return round(value)
