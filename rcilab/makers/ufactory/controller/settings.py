"""The settings of a client, checked by the controller; an invalid value changes nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import hypot, inf, isfinite
from typing import Any

import numpy as np

from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.makers.ufactory.bounds import (
    COLLISION_SENSITIVITIES,
    DEFAULT_JOINT_JERK,
    DEFAULT_SENSITIVITY,
    DEFAULT_TOOL_JERK,
    FARTHEST_FRAME,
    JOINT_ACCELERATION,
    JOINT_JERK,
    JOINT_VELOCITY,
    LONGEST_TOOL,
    SENSITIVITY_STEP,
    SERVO_SPEED_FACTOR,
    TEACH_SENSITIVITIES,
    TOOL_ACCELERATION,
    TOOL_JERK,
)
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.poses import MILLIMETRE, pose_from_mm_rpy
from rcilab.model.dynamics.payload import Payload
from rcilab.robots import RobotDescription
from rcilab.sim.arm_parameters import ArmParameters, Floats
from rcilab.sim.arm_setup import ArmSetup

WIDEST_BOUNDARY = (9999, -9999, 9999, -9999, 9999, -9999)  # [mm] As the client library has it before any report.
TOOL_SPEED = 1.0  # [m/s] User manual, 10.
_DAMPING_STEP = 1.6  # Factor on the damping of a guided arm for each step of the teach sensitivity; rcilab's own value.
SPEED_FACTOR_PARAMETER = 1  # Number of the factor among the common parameters.

RESETTING = frozenset(
    {
        Function.SET_TCP_OFFSET,
        Function.SET_LOAD,
        Function.SET_COLLISION_SENSITIVITY,
        Function.SET_TEACH_SENSITIVITY,
        Function.SET_GRAVITY_DIRECTION,
        Function.SET_WORLD_OFFSET,
    }
)
"""Settings after which the state must be set to 0: of frames, load and sensitivities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ArmParameters):
    """All settable values: those of the arm, and those of the controller alone."""

    T_base_user: Pose = IDENTITY
    """Frame of poses in requests and reports (`set_world_offset`)."""
    collision_sensitivity: int = DEFAULT_SENSITIVITY
    """0: no collision is detected; 5: the smallest."""
    teach_sensitivity: int = DEFAULT_SENSITIVITY
    """1: the hand moves the arm against the largest damping; 5: the smallest."""
    servo_speed_factor: float = SERVO_SPEED_FACTOR
    """By which joint targets of mode 1 may exceed the tool's largest speed."""
    joint_jerk: float = DEFAULT_JOINT_JERK
    """[rad/s^3]."""
    joint_acceleration: float = JOINT_ACCELERATION
    """Largest one of a command, [rad/s^2]."""
    tool_jerk: float = DEFAULT_TOOL_JERK
    """[m/s^3]."""
    tool_acceleration: float = TOOL_ACCELERATION
    """Largest one of a command, [m/s^2]."""
    reduced: bool = False
    """Whether reduced speeds and ranges apply."""
    reduced_tool_speed: float = TOOL_SPEED
    """[m/s]."""
    reduced_joint_speed: float = JOINT_VELOCITY
    """[rad/s]."""
    reduced_lower: Floats = ()
    """Ranges of the joints in reduced mode, n numbers, [rad]."""
    reduced_upper: Floats = ()
    boundary: tuple[int, ...] = WIDEST_BOUNDARY
    """Of the tool in base: largest and least x, y, z, [mm]."""
    fence: bool = False
    """Whether the boundary acts."""
    rebound: bool = False
    self_collision: bool = True
    tool_model: int = 0
    tool_parameters: Floats = (0.0,) * 6
    approximate: bool = False
    continuous: bool = False
    reports_currents: bool = False
    io_reset: tuple[bool, bool] = (False, False)
    """Whether a stop clears the outputs of controller and tool."""
    is_simulation: bool = False
    """Reported only: this arm is always simulated."""
    largest_thresholds: Floats = field(default=())
    """Collision thresholds of sensitivity 1, n numbers, [N m]."""

    @classmethod
    def of_arm(cls, arm: RobotDescription) -> Settings:
        """Returns the settings after power-up."""
        base = ArmParameters.of(arm)
        return _with_thresholds(
            cls(
                joint_lower=base.joint_lower,
                joint_upper=base.joint_upper,
                collision_thresholds=base.collision_thresholds,
                joint_stiffness=base.joint_stiffness,
                cartesian_stiffness=base.cartesian_stiffness,
                reduced_lower=base.joint_lower,
                reduced_upper=base.joint_upper,
                largest_thresholds=tuple(arm.limits.joint.torque.tolist()),
            )
        )

    @property
    def joint_speed(self) -> float:
        """Largest velocity of the joints, [rad/s]."""
        return self.reduced_joint_speed if self.reduced else JOINT_VELOCITY

    @property
    def tool_speed(self) -> float:
        """Largest velocity of the tool, [m/s]."""
        return self.reduced_tool_speed if self.reduced else TOOL_SPEED

    def servo_tool_speed(self, limits: Limits) -> float:
        """Returns the largest velocity of the tool in mode 1, [m/s].

        Args:
            limits: Those of the arm.
        """
        return limits.joint_tool_velocity * self.servo_speed_factor / SERVO_SPEED_FACTOR

    def is_inside(self, position: tuple[float, float, float]) -> bool:
        """Returns whether a position of the tool in base, [m], is inside the boundary, if it acts."""
        if not self.fence:
            return True
        bounds = self.boundary
        return all(
            MILLIMETRE * bounds[2 * k + 1] <= value <= MILLIMETRE * bounds[2 * k] for k, value in enumerate(position)
        )


def apply_setup(settings: Settings, setup: ArmSetup) -> Settings:
    """Returns the settings with a tool or a load of a configuration.

    Raises:
        InvalidValueError: The controller has no such setting.
    """
    if setup.safety_box is not None:
        raise InvalidValueError("safety box", setup.safety_box, "cannot be set: this controller has a boundary")
    if setup.soft_limits is not None:
        raise InvalidValueError("soft limits", setup.soft_limits, "cannot be set: this controller has a reduced mode")
    if setup.T_flange_tool is not None:
        settings = replace(settings, T_flange_tool=setup.T_flange_tool)
    return settings if setup.load is None else replace(settings, load=setup.load)


def apply_setting(settings: Settings, function: Function, values: tuple[Any, ...]) -> Settings | None:
    """Returns the settings with the values of a request; None for a function that sets none.

    Raises:
        InvalidValueError: A value is out of its bounds.
    """
    match function:
        case Function.SET_TCP_OFFSET:
            return replace(settings, T_flange_tool=_require_near("tool offset", values, LONGEST_TOOL))
        case Function.SET_WORLD_OFFSET:
            return replace(settings, T_base_user=_require_near("world offset", values, FARTHEST_FRAME))
        case Function.SET_LOAD:
            mass, *centre = values
            return replace(settings, load=Payload(mass=mass, center_of_mass=MILLIMETRE * np.array(centre)))
        case Function.SET_COLLISION_SENSITIVITY:
            value = _within("collision sensitivity", values[0], *COLLISION_SENSITIVITIES)
            return _with_thresholds(replace(settings, collision_sensitivity=value))
        case Function.SET_TEACH_SENSITIVITY:
            level = _within("teach sensitivity", values[0], *TEACH_SENSITIVITIES)
            damping = _DAMPING_STEP ** (DEFAULT_SENSITIVITY - level)
            return replace(settings, teach_sensitivity=level, guide_damping=damping)
        case Function.SET_GRAVITY_DIRECTION:
            length = hypot(*values)
            if not 0.0 < length < inf:
                raise InvalidValueError("gravity direction", list(values), "has no direction")
            return replace(settings, gravity=tuple(value / length for value in values))
        case Function.SET_COMMON_PARAMETER:
            number, factor = values
            if number != SPEED_FACTOR_PARAMETER:
                raise InvalidValueError("parameter", number, f"is not known; known: {SPEED_FACTOR_PARAMETER}")
            if not 0.0 < factor < inf:
                raise InvalidValueError("linear speed limit factor", factor, "must be above 0 and finite")
            return replace(settings, servo_speed_factor=factor)
        case Function.SET_JOINT_JERK:
            return replace(settings, joint_jerk=_positive("joint jerk", values[0], JOINT_JERK, "rad/s^3"))
        case Function.SET_JOINT_ACCELERATION:
            found = _positive("joint acceleration", values[0], JOINT_ACCELERATION, "rad/s^2")
            return replace(settings, joint_acceleration=found)
        case Function.SET_TCP_JERK:
            return replace(settings, tool_jerk=_positive("tool jerk", MILLIMETRE * values[0], TOOL_JERK, "m/s^3"))
        case Function.SET_TCP_ACCELERATION:
            found = _positive("tool acceleration", MILLIMETRE * values[0], TOOL_ACCELERATION, "m/s^2")
            return replace(settings, tool_acceleration=found)
        case _:
            return _apply_safety(settings, function, values)


def _apply_safety(settings: Settings, function: Function, values: tuple[Any, ...]) -> Settings | None:
    match function:
        case Function.SET_REDUCED_MODE:
            return replace(settings, reduced=bool(values[0]))
        case Function.SET_REDUCED_TCP_SPEED:
            found = _positive("reduced tool speed", MILLIMETRE * values[0], TOOL_SPEED, "m/s")
            return replace(settings, reduced_tool_speed=found)
        case Function.SET_REDUCED_JOINT_SPEED:
            found = _positive("reduced joint speed", values[0], JOINT_VELOCITY, "rad/s")
            return replace(settings, reduced_joint_speed=found)
        case Function.SET_REDUCED_JOINT_RANGE:
            return _with_ranges(settings, values)
        case Function.SET_BOUNDARY:
            if any(values[k] < values[k + 1] for k in (0, 2, 4)):
                raise InvalidValueError("boundary", list(values), "needs a largest and then a least x, y and z [mm]")
            return replace(settings, boundary=tuple(min(max(value, -32768), 32767) for value in values))
        case Function.SET_FENCE:
            return replace(settings, fence=bool(values[0]))
        case Function.SET_COLLISION_REBOUND:
            return replace(settings, rebound=bool(values[0]))
        case Function.SET_SELF_COLLISION:
            return replace(settings, self_collision=bool(values[0]))
        case Function.SET_COLLISION_TOOL:
            *numbers, model = values
            return replace(settings, tool_model=model, tool_parameters=(*numbers, *(0.0,) * (6 - len(numbers))))
        case Function.SET_APPROXIMATE:
            return replace(settings, approximate=bool(values[0]))
        case Function.SET_CARTESIAN_CONTINUOUS:
            return replace(settings, continuous=bool(values[0]))
        case Function.SET_REPORT_CURRENT:
            return replace(settings, reports_currents=bool(values[0]))
        case Function.SET_SIMULATION:
            return replace(settings, is_simulation=bool(values[0]))
        case Function.SET_IO_RESET:
            which, on = _within("kind of outputs", values[0], 0, 1), bool(values[1])
            before = settings.io_reset
            return replace(settings, io_reset=(before[0], on) if which else (on, before[1]))
        case _:
            return None


def _with_thresholds(settings: Settings) -> Settings:
    """Returns the settings with the thresholds of their collision sensitivity."""
    steps = settings.collision_sensitivity - 1
    share = inf if steps < 0 else 1.0 - SENSITIVITY_STEP * steps
    return replace(settings, collision_thresholds=tuple(share * value for value in settings.largest_thresholds))


def _with_ranges(settings: Settings, values: tuple[float, ...]) -> Settings:
    n = len(settings.joint_lower)
    given = values[: 2 * n]
    lower = tuple(map(max, given[::2], settings.joint_lower))
    upper = tuple(map(min, given[1::2], settings.joint_upper))
    if not (all(map(isfinite, given)) and all(low < high for low, high in zip(lower, upper, strict=True))):
        problem = "rad: need a least and a larger angle for each joint, with a part of its range between them"
        raise InvalidValueError("reduced ranges", list(given), problem)
    return replace(settings, reduced_lower=lower, reduced_upper=upper)


def _require_near(name: str, values: Sequence[float], most: float) -> Pose:
    """Returns the pose of an offset in mm and rad, whose length is bounded in m."""
    pose = pose_from_mm_rpy(values)
    if not hypot(*pose.parts[1]) <= most:
        raise InvalidValueError(name, list(values[:3]), f"must be at most {most / MILLIMETRE:g} mm long")
    return pose


def _within(name: str, value: int, least: int, most: int) -> int:
    if not least <= value <= most:
        raise InvalidValueError(name, value, f"must be {least} to {most}")
    return value


def _positive(name: str, value: float, most: float, unit: str) -> float:
    if not 0.0 < value <= most * (1.0 + 1e-6):  # Of single precision.
        raise InvalidValueError(name, value, f"must be above 0, up to {most:g} [{unit}]")
    return min(value, most)
