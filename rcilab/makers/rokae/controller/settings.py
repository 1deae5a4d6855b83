"""All settings of a client over TCP, checked again by the controller.

The vendor's client checks some values before it sends them and lets NaN through nearly every check, so here every
value is checked: finite, inside its range, a proper pose. An invalid value is answered with "invalid argument" and
changes nothing. On 6-axis arms the seventh elements are ignored.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.bounds import (
    FARTHEST_BOX,
    FILTER_OFF,
    LARGEST_BOX,
    LIMIT_TOLERANCE,
    LONGEST_TOOL,
    LOWEST_FREQUENCY,
    REPORT_FREQUENCY,
    SIGNAL_COUNT,
)
from rcilab.model.dynamics.payload import Payload
from rcilab.robots import RobotDescription
from rcilab.sim.arm_parameters import ArmParameters, Floats, ForceAxesKind
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.hand_guiding import FREE, FREE_ROTATION, FREE_TRANSLATION, GuidedFreedom

_FORCE_AXES = {
    rci.ForceFrame.WORLD: ForceAxesKind.WORLD,
    rci.ForceFrame.TOOL: ForceAxesKind.TOOL,
    rci.ForceFrame.PATH: ForceAxesKind.PATH,
}
_FREEDOMS = {
    rci.DragType.FREE: FREE,
    rci.DragType.TRANSLATION: FREE_TRANSLATION,
    rci.DragType.ROTATION: FREE_ROTATION,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ArmParameters):
    """All settable values: those of the arm, and those of the controller alone."""

    torque_report_filter: float = REPORT_FREQUENCY
    """Cut-off frequency of the filtered torques in the state, [Hz]."""
    outputs: tuple[bool, ...] = (False,) * SIGNAL_COUNT
    inputs: tuple[bool, ...] = (False,) * SIGNAL_COUNT
    """Levels of the digital inputs; a virtual controller has no wiring; the simulation port sets them."""
    loop_back: bool = False
    """Whether every digital output is wired to the input of the same number."""

    def with_input(self, signal: int, level: bool) -> Settings:
        """Returns the settings with another level at a digital input.

        Raises:
            InvalidValueError: There is no such input.
        """
        if not 0 <= signal < SIGNAL_COUNT:
            raise InvalidValueError("digital input", signal, f"does not exist; needs 0 to {SIGNAL_COUNT - 1}")
        return replace(self, inputs=(*self.inputs[:signal], bool(level), *self.inputs[signal + 1 :]))

    def with_loop_back(self, on: bool) -> Settings:
        """Returns the settings with every digital output wired to its input, or none."""
        return replace(self, loop_back=on, inputs=self.outputs if on else self.inputs)

    def rebooted(self, pendant: Settings) -> Settings:
        """Returns the settings after a reboot: those of the teach pendant, and values set outside of the controller."""
        kept = replace(pendant, inputs=self.inputs, auto_limit=self.auto_limit)
        return kept.with_loop_back(self.loop_back)


def apply_setup(settings: Settings, setup: ArmSetup, arm: RobotDescription) -> Settings:
    """Returns the settings with those of a configuration, whose bounds are those of a client's requests.

    Raises:
        InvalidValueError: A value is out of its bounds; it names the part and the value.
    """
    for part, request in _setup_requests(setup, arm.n):
        try:
            settings = apply_request(settings, request, arm)
        except InvalidValueError as error:
            raise InvalidValueError(f"{part}: {error.name}", error.value, error.requirement) from error
    return settings


def _setup_requests(setup: ArmSetup, n: int) -> Iterator[tuple[str, rci.Request]]:
    tool, load, box = setup.T_flange_tool, setup.load, setup.safety_box
    if tool is not None:
        yield "tool", rci.SetCoor(tool.as_row_major())
    if load is not None:
        center, inertia = tuple(load.center_of_mass.tolist()), tuple(load.inertia.ravel().tolist())
        yield "load", rci.SetLoad(load.mass, center, inertia)
    if box is not None:
        yield "safety box", rci.SetCartesianLimit(box.size, box.T_base_box.as_row_major(), box.active)
    if setup.soft_limits is not None:
        for bounds in setup.soft_limits:
            if len(bounds) != n:
                raise InvalidValueError("soft limits", bounds, f"must have {n} numbers each [rad]")
        lower, upper = ((*bounds, *[0.0] * (7 - n)) for bounds in setup.soft_limits)
        yield "soft limits", rci.SetJointLimit(upper, lower)


def apply_request(settings: Settings, request: rci.Request, arm: RobotDescription) -> Settings:
    """Returns the settings with the values of a request.

    Args:
        settings: The settings before.
        request: A setter; other requests have no effect.
        arm: The arm, for its ranges.

    Raises:
        InvalidValueError: A value is out of its bounds, or values do not fit together; it names the first.
    """
    return replace(settings, **_changes(request, arm, settings))


def guided_freedom(request: rci.StartDrag) -> GuidedFreedom:
    """Returns the free directions of a drag: in joint space all joints, for any type, as with the vendor's client."""
    return FREE if request.space == rci.DragSpace.JOINT else _FREEDOMS[rci.DragType(request.type)]


def _changes(request: rci.Request, arm: RobotDescription, settings: Settings) -> dict[str, object]:
    """Returns the fields to change."""
    n, joint, cartesian = arm.n, arm.limits.joint, arm.limits.cartesian
    match request:
        case rci.SetCollisionBehavior(thresholds=values):
            _require_joints("threshold", values[:n], joint.collision_threshold.tolist(), "N m")
            return {"collision_thresholds": values[:n]}
        case rci.SetJointImpedance(stiffness=values):
            _require_joints("stiffness", values[:n], joint.stiffness.tolist(), "N m/rad")
            return {"joint_stiffness": values[:n]}
        case rci.SetCartesianImpedance(stiffness=values):
            for name, value, largest, unit in (
                *_along("stiffness", values, cartesian.translation_stiffness, "N/m"),
                *_about("stiffness", values, cartesian.rotation_stiffness, "N m/rad"),
            ):
                _require(name, value, 0.0, largest, unit)
            return {"cartesian_stiffness": values}
        case rci.SetCartImpDesiredTau(wrench=values):
            for name, value, largest, unit in (
                *_along("force", values, cartesian.force, "N"),
                *_about("moment", values, cartesian.moment, "N m"),
            ):
                _require(name, value, -largest, largest, unit)
            return {"desired_wrench": values}
        case rci.SetTorqueFilterCutOffFrequency(frequency=value):
            return {"torque_report_filter": _frequency("frequency", value)}
        case rci.SetFilters():
            return {
                "joint_filter": _frequency("joint frequency", request.joint_frequency),
                "cartesian_filter": _frequency("Cartesian frequency", request.cartesian_frequency),
                "torque_filter": _frequency("torque frequency", request.torque_frequency),
            }
        case rci.SetJointLimit():
            return _soft_limits(request, arm)
        case rci.SetCartesianLimit():
            pose = Pose.from_row_major(request.frame)
            for axis, x, edge in zip("xyz", pose.parts[1], request.size, strict=True):
                _require(f"{axis} of the box's centre", x, -FARTHEST_BOX, FARTHEST_BOX, "m")
                _require(f"{axis} of the box's size", edge, 0.0, LARGEST_BOX, "m")
            return {"safety_box": SafetyBox(size=request.size, T_base_box=pose, active=request.active)}
        case rci.SetCoor(T_flange_tool=numbers):
            return {"T_flange_tool": _pose_at_flange("tool", numbers)}
        case rci.SetFcCoor(frame=numbers, type=kind):
            if kind not in tuple(rci.ForceFrame):
                raise InvalidValueError("type", kind, "is not a force-control frame; there are 0 to 2")
            return {
                "T_flange_force": _pose_at_flange("frame", numbers),
                "force_axes": _FORCE_AXES[rci.ForceFrame(kind)],
            }
        case rci.SetLoad():
            return {"load": _load(request, arm)}
        case rci.EnableVirtualGuide(enable=enable):
            return {"virtual_guide": enable}
        case rci.SetDO(signal=signal, level=level):
            if signal >= SIGNAL_COUNT:
                raise InvalidValueError("signal", signal, f"does not exist; there are 0 to {SIGNAL_COUNT - 1}")
            outputs = (*settings.outputs[:signal], level, *settings.outputs[signal + 1 :])
            return {"outputs": outputs, "inputs": outputs if settings.loop_back else settings.inputs}
        case _:
            return {}


def _require(name: str, value: float, lowest: float, largest: float, unit: str) -> None:
    if not lowest <= value <= largest:  # Also True for NaN.
        raise InvalidValueError(name, _round(value), f"{unit} is outside {lowest:g} to {largest:g} {unit}")


def _round(value: float) -> float:
    return float(f"{value:.9g}")


def _require_joints(name: str, values: Floats, largest: Sequence[float], unit: str) -> None:
    for number, (value, bound) in enumerate(zip(values, largest, strict=True), 1):
        _require(f"{name} of joint {number}", value, 0.0, bound, unit)


def _along(name: str, values: Floats, largest: float, unit: str) -> Iterator[tuple[str, float, float, str]]:
    return ((f"{name} along {axis}", value, largest, unit) for axis, value in zip("xyz", values[:3], strict=True))


def _about(name: str, values: Floats, largest: float, unit: str) -> Iterator[tuple[str, float, float, str]]:
    return ((f"{name} about {axis}", value, largest, unit) for axis, value in zip("xyz", values[3:], strict=True))


def _frequency(name: str, value: float) -> float:
    _require(name, value, LOWEST_FREQUENCY, FILTER_OFF, "Hz")
    return value


def _soft_limits(request: rci.SetJointLimit, arm: RobotDescription) -> dict[str, object]:
    upper, lower = request.upper[: arm.n], request.lower[: arm.n]
    bounds = zip(lower, upper, arm.limits.joint.lower.tolist(), arm.limits.joint.upper.tolist(), strict=True)
    for number, (low, high, lowest, highest) in enumerate(bounds, 1):
        _require(f"lower limit of joint {number}", low, lowest - LIMIT_TOLERANCE, highest + LIMIT_TOLERANCE, "rad")
        _require(f"upper limit of joint {number}", high, lowest - LIMIT_TOLERANCE, highest + LIMIT_TOLERANCE, "rad")
        if not low < high:
            raise InvalidValueError(
                f"lower limit of joint {number}", _round(low), f"rad is not below the upper, {high:g} rad"
            )
    return {"joint_lower": lower, "joint_upper": upper}


def _load(request: rci.SetLoad, arm: RobotDescription) -> Payload:
    _require("mass", request.mass, 0.0, arm.rated_payload, "kg")
    return Payload(
        mass=request.mass,
        center_of_mass=np.array(request.center_of_mass),
        inertia=np.array(request.inertia).reshape(3, 3),
    )


def _pose_at_flange(name: str, numbers: Floats) -> Pose:
    pose = Pose.from_row_major(numbers)
    _require(f"distance of the {name} from the flange", hypot(*pose.parts[1]), 0.0, LONGEST_TOOL, "m")
    return pose
