"""The parameters of a controller: sensitivities, and the limits of the motions that it plans."""

from __future__ import annotations

from rcilab.core.state import MODES
from rcilab.i18n.translator import message
from rcilab.makers.parameters import Parameter, ParameterGroup
from rcilab.makers.ufactory.bounds import (
    COLLISION_SENSITIVITIES,
    DEFAULT_JOINT_JERK,
    DEFAULT_SENSITIVITY,
    DEFAULT_TOOL_JERK,
    JOINT_ACCELERATION,
    JOINT_JERK,
    TEACH_SENSITIVITIES,
    TOOL_ACCELERATION,
    TOOL_JERK,
)

_SMALLEST = 0.1
"""Of accelerations and jerks; rcilab's own bound: zero would not move."""


def parameter_groups() -> tuple[ParameterGroup, ...]:
    """Returns the parameters of an arm."""
    return (
        _sensitivity("collision_sensitivity", COLLISION_SENSITIVITIES),
        _sensitivity("teach_sensitivity", TEACH_SENSITIVITIES),
        ParameterGroup(
            name="motion_limits",
            parameters=(
                _limit("joint_acceleration", JOINT_ACCELERATION, JOINT_ACCELERATION, "rad/s²"),
                _limit("joint_jerk", JOINT_JERK, DEFAULT_JOINT_JERK, "rad/s³"),
                _limit("tool_acceleration", TOOL_ACCELERATION, TOOL_ACCELERATION, "m/s²"),
                _limit("tool_jerk", TOOL_JERK, DEFAULT_TOOL_JERK, "m/s³"),
            ),
            modes=MODES,
        ),
    )


def _sensitivity(name: str, levels: tuple[int, int]) -> ParameterGroup:
    low, high = levels
    level = Parameter(
        label=message("control.level"), low=float(low), high=float(high), default=float(DEFAULT_SENSITIVITY), unit=""
    )
    return ParameterGroup(name=name, parameters=(level,), modes=MODES)


def _limit(name: str, high: float, default: float, unit: str) -> Parameter:
    return Parameter(label=message(f"control.limit.{name}"), low=_SMALLEST, high=high, default=default, unit=unit)
