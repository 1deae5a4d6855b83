"""Sending a configuration to an RCI controller: tool, load, safety box, and the parameters of the modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, send_groups

if TYPE_CHECKING:
    from rcilab.makers.rokae.driver.settings import RciSettings


def send_parameters(settings: RciSettings, control: ControllerParameters) -> None:
    """Sends parameters to a controller at standstill. After a refusal, earlier ones are in force.

    Args:
        settings: The commands of a connection.
        control: The parameters.

    Raises:
        InvalidValueError: A number is outside its range; it was not sent.
        CommandRejectedError: The controller refused; the error names the command.
    """
    requests: dict[str, Callable[[tuple[float, ...]], None]] = {
        "joint_stiffness": settings.set_joint_impedance,
        "cartesian_stiffness": settings.set_cartesian_impedance,
        "desired_wrench": settings.set_cart_imp_desired_tau,
        "collision_thresholds": settings.set_collision_behavior,
        "filters": lambda values: settings.set_filters(*values),
        "report_filter": lambda values: settings.set_torque_filter_cut_off_frequency(*values),
    }
    send_groups(control, requests)


def send_configuration(settings: RciSettings, setup: RobotConfiguration) -> None:
    """Sends a configuration to a controller at standstill. After a refusal, earlier parts are in force.

    Args:
        settings: The commands of a connection.
        setup: The configuration.

    Raises:
        CommandRejectedError: The controller refused a part; the error names it.
    """
    if setup.tool is not None:
        settings.set_coor(setup.tool)
    if setup.load is not None:
        settings.set_load(setup.load.mass, setup.load.center_of_mass, setup.load.inertia)
    if setup.box is not None:
        settings.set_cartesian_limit(setup.box)
    if setup.force is not None:
        settings.set_fc_coor(setup.force.T_flange_force, setup.force.type)
    if setup.joints is not None:
        settings.set_joint_limit(setup.joints.lower, setup.joints.upper)
    if setup.control is not None:
        send_parameters(settings, setup.control)
