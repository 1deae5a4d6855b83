"""How a controller follows and when it gives up: stiffness, desired force, collision thresholds, filters.

The settings of the RCI that belong to the five modes: `setJointImpedance`, `setCartesianImpedance`,
`setCartImpDesiredTau`, `setCollisionBehavior`, `setFilters` and `setTorqueFilterCutOffFrequency`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rcilab.makers.configuration import ControllerParameters, ControlPart, RobotConfiguration, require_control
from rcilab.makers.rokae.wire.bounds import FILTER_OFF, LOWEST_FREQUENCY

if TYPE_CHECKING:
    from rcilab.core.limits import Limits
    from rcilab.makers.rokae.driver.settings import RciSettings

REPORT_FREQUENCY = 100.0  # [Hz] What a controller wakes up with for the torques that it reports.


class Range(NamedTuple):
    """What one number of the settings may be."""

    low: float
    high: float
    unit: str


def control_ranges(limits: Limits) -> dict[ControlPart, tuple[Range, ...]]:
    """Returns the range of every number, from the arm's one table of limits."""
    joint, tool = limits.joint, limits.cartesian
    frequency = Range(LOWEST_FREQUENCY, FILTER_OFF, "Hz")
    return {
        "joint_stiffness": tuple(Range(0.0, k, "N·m/rad") for k in joint.stiffness.tolist()),
        "cartesian_stiffness": (Range(0.0, tool.translation_stiffness, "N/m"),) * 3
        + (Range(0.0, tool.rotation_stiffness, "N·m/rad"),) * 3,
        "desired_wrench": (Range(-tool.force, tool.force, "N"),) * 3 + (Range(-tool.moment, tool.moment, "N·m"),) * 3,
        "collision_thresholds": tuple(Range(0.0, tau, "N·m") for tau in joint.collision_threshold.tolist()),
        "filters": (frequency,) * 3,
        "report_filter": (frequency,),
    }


def standard_control(limits: Limits) -> ControllerParameters:
    """Returns what a controller wakes up with: the stiffest springs, the highest thresholds, no filter of commands."""
    top = {name: tuple(item.high for item in ranges) for name, ranges in control_ranges(limits).items()}
    return ControllerParameters(**top | {"desired_wrench": (0.0,) * 6, "report_filter": (REPORT_FREQUENCY,)})


def send_parameters(settings: RciSettings, control: ControllerParameters) -> None:
    """Sends parameters to a controller; nothing may move meanwhile. After a refusal those before it are in force.

    Args:
        settings: The commands of a connection.
        control: What to send.

    Raises:
        InvalidValueError: A number is outside its range; it was not sent.
        CommandRejectedError: The controller refused; the error names the command.
    """
    require_control(control)
    if control.joint_stiffness is not None:
        settings.set_joint_impedance(control.joint_stiffness)
    if control.cartesian_stiffness is not None:
        settings.set_cartesian_impedance(control.cartesian_stiffness)
    if control.desired_wrench is not None:
        settings.set_cart_imp_desired_tau(control.desired_wrench)
    if control.collision_thresholds is not None:
        settings.set_collision_behavior(control.collision_thresholds)
    if control.filters is not None:
        settings.set_filters(*control.filters)
    if control.report_filter is not None:
        settings.set_torque_filter_cut_off_frequency(control.report_filter[0])


def send_configuration(settings: RciSettings, setup: RobotConfiguration) -> None:
    """Sends a configuration to a controller; nothing may move meanwhile. A refusal leaves earlier parts in force.

    Args:
        settings: The commands of a connection.
        setup: What to send.

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
