"""Sending a configuration to a UFACTORY controller: tool and load."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.makers.configuration import RobotConfiguration

if TYPE_CHECKING:
    from rcilab.makers.ufactory.driver.settings import XArmSettings


def send_configuration(settings: XArmSettings, setup: RobotConfiguration) -> None:
    """Sends a configuration to a controller at standstill. After a refusal, earlier parts are in force.

    Args:
        settings: The settings of a connection.
        setup: The configuration.

    Raises:
        CommandRejectedError: The controller refused a part; the error names the request.
    """
    if setup.tool is not None:
        settings.set_tool(setup.tool)
    if setup.load is not None:
        settings.set_load(setup.load.mass, setup.load.center_of_mass, setup.load.inertia)
