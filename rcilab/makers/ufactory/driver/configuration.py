"""Sending a configuration to a UFACTORY controller: tool, load, boundary, ranges of the joints, and parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, as_whole, send_groups
from rcilab.makers.ufactory.bounds import COLLISION_SENSITIVITIES, TEACH_SENSITIVITIES

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
    requests: dict[str, Callable[[tuple[float, ...]], None]] = {
        "collision_sensitivity": lambda values: settings.set_collision_sensitivity(
            _level(values[0], COLLISION_SENSITIVITIES)
        ),
        "teach_sensitivity": lambda values: settings.set_teach_sensitivity(_level(values[0], TEACH_SENSITIVITIES)),
        "motion_limits": lambda values: settings.set_motion_limits(*values),
    }
    send_groups(control, requests)


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


def _level(value: float, levels: tuple[int, int]) -> int:
    least, most = levels
    return as_whole("sensitivity", value, most, least)
