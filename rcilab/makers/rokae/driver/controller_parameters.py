"""How a controller follows and when it gives up: stiffness, desired force, collision thresholds, filters.

The settings of the RCI that belong to the five modes: `setJointImpedance`, `setCartesianImpedance`,
`setCartImpDesiredTau`, `setCollisionBehavior`, `setFilters` and `setTorqueFilterCutOffFrequency`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.makers.rokae.wire.bounds import FILTER_OFF, LOWEST_FREQUENCY

if TYPE_CHECKING:
    from rcilab.core.limits import Limits
    from rcilab.makers.rokae.driver.settings import RciSettings

ControlPart: TypeAlias = Literal[
    "joint_stiffness", "cartesian_stiffness", "desired_wrench", "collision_thresholds", "filters", "report_filter"
]

REPORT_FREQUENCY = 100.0  # [Hz] What a controller wakes up with for the torques that it reports.


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerParameters:
    """Parameters of the modes; what is None is left as the controller has it. Ranges: `control_ranges`."""

    joint_stiffness: tuple[float, ...] | None = None
    """Of joint impedance, n numbers, [N m/rad]."""
    cartesian_stiffness: tuple[float, ...] | None = None
    """Of Cartesian impedance: three [N/m], three [N m/rad]."""
    desired_wrench: tuple[float, ...] | None = None
    """What Cartesian impedance presses with: three [N], three [N m]."""
    collision_thresholds: tuple[float, ...] | None = None
    """Torques from outside that are a collision, n numbers, [N m]."""
    filters: tuple[float, ...] | None = None
    """Cut-off frequencies for commanded angles, poses and torques, [Hz]; 1000 switches one off."""
    report_filter: tuple[float, ...] | None = None
    """Cut-off frequency for reported torques, one number, [Hz]."""


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


def require_control(control: object) -> ControllerParameters:
    """Returns `control` if these are settings of control.

    Raises:
        InvalidValueError: They are not.
    """
    if isinstance(control, ControllerParameters):
        return control
    raise InvalidValueError("control", control, "are none; ControllerParameters(joint_stiffness=...) makes some")


def give_control(settings: RciSettings, control: ControllerParameters) -> None:
    """Tells a controller; nothing may move meanwhile. A refusal leaves what came before it in force.

    Args:
        settings: The commands of a connection, or a session.
        control: What to tell.

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
