"""The parameters of a controller: the largest speeds and accelerations of joints and tool, and the collision stage."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

from rcilab.core.state import MODES
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import tool_limits_of
from rcilab.makers.parameters import Parameter, ParameterGroup
from rcilab.makers.realman.bounds import FASTEST_TOOL, LARGEST_JOINT_ACCELERATION, MOST_SENSITIVE, STRONGEST_TOOL
from rcilab.makers.realman.wire.units import speed_from_millirpm
from rcilab.model.robot_model import RobotModel
from rcilab.robots import describe_robot

_SLOWEST = {"rad": radians(0.5), "m": 0.01}
"""Of speeds and accelerations by their unit, [rad/s], [m/s] and so on; rcilab's own bound: zero would not move."""


def parameter_groups(model: RobotModel) -> tuple[ParameterGroup, ...]:
    """Returns the parameters of an arm; the defaults are the limits of a new one."""
    limits = describe_robot(model.name).limits
    joint = limits.joint
    accelerations = [speed_from_millirpm(LARGEST_JOINT_ACCELERATION)] * model.n
    speed, acceleration, rotation_speed, rotation_acceleration = tool_limits_of(limits)
    stage = Parameter(
        label=message("control.collision_level"), low=0.0, high=float(MOST_SENSITIVE), default=0.0, unit=""
    )
    return (
        _joint_group("joint_velocity", joint.velocity.tolist(), joint.velocity.tolist(), "rad/s"),
        _joint_group("joint_acceleration", accelerations, joint.acceleration.tolist(), "rad/s²"),
        ParameterGroup(
            name="tool_limits",
            parameters=(
                _number(message("control.tip_velocity"), FASTEST_TOOL, speed, "m/s"),
                _number(message("control.tip_acceleration"), STRONGEST_TOOL, acceleration, "m/s²"),
                _number(message("control.tip_rotation_velocity"), FASTEST_TOOL, rotation_speed, "rad/s"),
                _number(message("control.tip_rotation_acceleration"), STRONGEST_TOOL, rotation_acceleration, "rad/s²"),
            ),
            modes=MODES,
        ),
        ParameterGroup(name="collision_stage", parameters=(stage,), modes=MODES),
    )


def _joint_group(name: str, largest: Sequence[float], defaults: Sequence[float], unit: str) -> ParameterGroup:
    numbers = zip(largest, defaults, strict=True)
    parameters = (
        _number(message("control.joint", number=joint), high, own, unit) for joint, (high, own) in enumerate(numbers, 1)
    )
    return ParameterGroup(name=name, parameters=tuple(parameters), modes=MODES)


def _number(label: Message, high: float, default: float, unit: str) -> Parameter:
    return Parameter(label=label, low=_SLOWEST[unit.partition("/")[0]], high=high, default=default, unit=unit)
