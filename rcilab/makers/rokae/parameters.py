"""The parameters of the modes: stiffness, desired wrench, collision thresholds, filters.

The settings of the RCI that belong to the five modes: `setJointImpedance`, `setCartesianImpedance`,
`setCartImpDesiredTau`, `setCollisionBehavior`, `setFilters` and `setTorqueFilterCutOffFrequency`. A controller starts
with the stiffest springs, the highest thresholds and no filter of commands.
"""

from __future__ import annotations

from rcilab.core.limits import Limits
from rcilab.core.state import MODES
from rcilab.i18n.translator import message
from rcilab.makers.parameters import Parameter, ParameterGroup
from rcilab.makers.rokae.bounds import FILTER_OFF, LOWEST_FREQUENCY, REPORT_FREQUENCY

_AXES = ("x", "y", "z", "a", "b", "c")


def parameter_groups(limits: Limits) -> tuple[ParameterGroup, ...]:
    """Returns the parameters of an arm; the ranges come from its table of limits."""
    joint, tool = limits.joint, limits.cartesian
    stiffness = (tool.translation_stiffness,) * 3 + (tool.rotation_stiffness,) * 3
    wrench = (tool.force,) * 3 + (tool.moment,) * 3
    return (
        ParameterGroup(
            name="joint_stiffness",
            parameters=_joints(joint.stiffness.tolist(), "N·m/rad"),
            modes=("joint_impedance",),
            is_first=True,
        ),
        ParameterGroup(
            name="cartesian_stiffness",
            parameters=tuple(
                Parameter(label=message(f"control.axis.{axis}"), low=0.0, high=k, default=k, unit=unit)
                for axis, k, unit in zip(_AXES, stiffness, ("N/m",) * 3 + ("N·m/rad",) * 3, strict=True)
            ),
            modes=("cartesian_impedance",),
            is_first=True,
        ),
        ParameterGroup(
            name="desired_wrench",
            parameters=tuple(
                Parameter(label=message(f"control.axis.{axis}"), low=-most, high=most, default=0.0, unit=unit)
                for axis, most, unit in zip(_AXES, wrench, ("N",) * 3 + ("N·m",) * 3, strict=True)
            ),
            modes=("cartesian_impedance",),
        ),
        ParameterGroup(
            name="collision_thresholds",
            parameters=_joints(joint.collision_threshold.tolist(), "N·m"),
            modes=MODES,
        ),
        ParameterGroup(
            name="filters",
            parameters=tuple(_filter(name, FILTER_OFF) for name in ("joint", "cartesian", "torque")),
            modes=MODES,
        ),
        ParameterGroup(name="report_filter", parameters=(_filter("report", REPORT_FREQUENCY),), modes=MODES),
    )


def _joints(highest: list[float], unit: str) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(label=message("control.joint", number=number), low=0.0, high=high, default=high, unit=unit)
        for number, high in enumerate(highest, 1)
    )


def _filter(name: str, default: float) -> Parameter:
    label = message(f"control.filter.{name}")
    return Parameter(label=label, low=LOWEST_FREQUENCY, high=FILTER_OFF, default=default, unit="Hz")
