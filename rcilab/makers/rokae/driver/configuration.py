"""Sending a configuration to an RCI controller: tool, load, safety box, and the parameters of the modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import InvalidValueError
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, require_control

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
    known = {
        "joint_stiffness": settings.set_joint_impedance,
        "cartesian_stiffness": settings.set_cartesian_impedance,
        "desired_wrench": settings.set_cart_imp_desired_tau,
        "collision_thresholds": settings.set_collision_behavior,
        "filters": lambda values: settings.set_filters(*values),
        "report_filter": lambda values: settings.set_torque_filter_cut_off_frequency(*values),
    }
    unknown = require_control(control).keys() - known
    if unknown:
        raise InvalidValueError("control", sorted(unknown), f"does not exist; known: {', '.join(known)}")
    for name, send in known.items():
        if name in control:
            send(control[name])


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
