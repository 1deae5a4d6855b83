"""The parameters of the modes: stiffness of joints and tool, collision thresholds.

The settings `setJointImpedance`, `setCartesianImpedance` and `setCollisionBehavior` of the interface. The stiffness of
the joints also acts in the position modes, which have no other controller.
"""

from __future__ import annotations

from rcilab.core.state import MODES
from rcilab.i18n.translator import message
from rcilab.makers.franka.bounds import (
    CARTESIAN_STIFFNESS,
    DEFAULT_CARTESIAN_STIFFNESS,
    DEFAULT_THRESHOLD,
    JOINT_STIFFNESS,
    LARGEST_JOINT_STIFFNESS,
    LARGEST_THRESHOLD,
)
from rcilab.makers.parameters import Parameter, ParameterGroup

_AXES = ("x", "y", "z", "a", "b", "c")
_JOINTS = range(1, 8)


def parameter_groups() -> tuple[ParameterGroup, ...]:
    """Returns the parameters of an arm."""
    return (
        ParameterGroup(
            name="joint_stiffness",
            parameters=tuple(
                _joint(number, LARGEST_JOINT_STIFFNESS, stiffness, "N·m/rad")
                for number, stiffness in zip(_JOINTS, JOINT_STIFFNESS, strict=True)
            ),
            modes=("joint_position", "joint_impedance", "cartesian_position"),
            is_first=True,
        ),
        ParameterGroup(
            name="cartesian_stiffness",
            parameters=tuple(
                Parameter(label=message(f"control.axis.{axis}"), low=low, high=high, default=default, unit=unit)
                for axis, (low, high), default, unit in zip(
                    _AXES,
                    (CARTESIAN_STIFFNESS[0],) * 3 + (CARTESIAN_STIFFNESS[1],) * 3,
                    DEFAULT_CARTESIAN_STIFFNESS,
                    ("N/m",) * 3 + ("N·m/rad",) * 3,
                    strict=True,
                )
            ),
            modes=("cartesian_impedance",),
            is_first=True,
        ),
        ParameterGroup(
            name="collision_thresholds",
            parameters=(
                *(_joint(number, LARGEST_THRESHOLD, DEFAULT_THRESHOLD, "N·m") for number in _JOINTS),
                *(
                    Parameter(
                        label=message(f"control.axis.{axis}"),
                        low=0.0,
                        high=LARGEST_THRESHOLD,
                        default=DEFAULT_THRESHOLD,
                        unit=unit,
                    )
                    for axis, unit in zip(_AXES, ("N",) * 3 + ("N·m",) * 3, strict=True)
                ),
            ),
            modes=MODES,
        ),
    )


def _joint(number: int, high: float, default: float, unit: str) -> Parameter:
    label = message("control.joint", number=number)
    return Parameter(label=label, low=0.0, high=high, default=default, unit=unit)
