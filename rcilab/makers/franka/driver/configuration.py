"""Sending a configuration to a Franka controller: end effector, load, and the parameters of the modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, send_groups

if TYPE_CHECKING:
    from rcilab.makers.franka.driver.settings import FciSettings

_JOINTS = 7


def send_parameters(settings: FciSettings, control: ControllerParameters) -> None:
    """Sends parameters to a controller at standstill. After a refusal, earlier ones are in force.

    Args:
        settings: The requests of a connection.
        control: The parameters. Those of collisions are thresholds of 7 torques and 6 forces, also for contacts.

    Raises:
        InvalidValueError: A number is outside its range; it was not sent.
        CommandRejectedError: The controller refused; the error names the request.
    """

    def set_thresholds(values: tuple[float, ...]) -> None:
        torques, forces = values[:_JOINTS], values[_JOINTS:]
        settings.set_collision_behavior(torques, torques, forces, forces)

    requests: dict[str, Callable[[tuple[float, ...]], None]] = {
        "joint_stiffness": settings.set_joint_impedance,
        "cartesian_stiffness": settings.set_cartesian_impedance,
        "collision_thresholds": set_thresholds,
    }
    send_groups(control, requests)


def send_configuration(settings: FciSettings, setup: RobotConfiguration) -> None:
    """Sends a configuration to a controller at standstill. After a refusal, earlier parts are in force.

    Args:
        settings: The requests of a connection.
        setup: The configuration; the interface has no safety box, force-control frame or soft joint limits.

    Raises:
        CommandRejectedError: The controller refused a part; the error names the request.
    """
    if setup.tool is not None:
        settings.set_tool(setup.tool)
    if setup.load is not None:
        settings.set_load(setup.load.mass, setup.load.center_of_mass, setup.load.inertia)
    if setup.control is not None:
        send_parameters(settings, setup.control)
