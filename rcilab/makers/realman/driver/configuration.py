"""Sending a configuration to a RealMan controller: tool, load, ranges of the joints, and parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, as_whole, send_groups
from rcilab.makers.realman.bounds import MOST_SENSITIVE

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
    requests: dict[str, Callable[[tuple[float, ...]], None]] = {
        "joint_velocity": settings.set_joint_velocities,
        "joint_acceleration": settings.set_joint_accelerations,
        "tool_limits": lambda values: settings.set_tool_limits(*values),
        "collision_stage": lambda values: settings.set_collision_stage(
            as_whole("collision_stage", values[0], MOST_SENSITIVE)
        ),
    }
    send_groups(control, requests)


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
