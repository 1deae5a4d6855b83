"""All settings of a client over TCP, checked by the controller.

An invalid value is answered with "invalid argument" and changes nothing. Frames are given column-major.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import hypot, inf, isfinite
from typing import Any

import numpy as np

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.makers.franka.bounds import (
    CARTESIAN_STIFFNESS,
    DEFAULT_CARTESIAN_STIFFNESS,
    DEFAULT_THRESHOLD,
    JOINT_STIFFNESS,
    LARGEST_JOINT_STIFFNESS,
    LONGEST_TOOL,
    require_payload,
)
from rcilab.makers.franka.wire.requests import (
    Request,
    SetCartesianImpedance,
    SetCollisionBehavior,
    SetEEToK,
    SetFilters,
    SetGuidingMode,
    SetJointImpedance,
    SetLoad,
    SetNEToEE,
)
from rcilab.model.dynamics.payload import Payload, combine_payloads
from rcilab.robots import RobotDescription
from rcilab.sim.arm_parameters import ArmParameters, ForceAxesKind
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.contact_detector import ContactThresholds
from rcilab.sim.filters import SAMPLING_RATE

LOWEST_FREQUENCY = 1.0  # [Hz]

DEFAULT_THRESHOLDS = ContactThresholds(
    contact_torque=(DEFAULT_THRESHOLD,) * 7,
    collision_torque=(DEFAULT_THRESHOLD,) * 7,
    contact_torque_accelerating=(DEFAULT_THRESHOLD,) * 7,
    collision_torque_accelerating=(DEFAULT_THRESHOLD,) * 7,
    contact_force=(DEFAULT_THRESHOLD,) * 6,
    collision_force=(DEFAULT_THRESHOLD,) * 6,
    contact_force_accelerating=(DEFAULT_THRESHOLD,) * 6,
    collision_force_accelerating=(DEFAULT_THRESHOLD,) * 6,
)
"""After power-up; rcilab's own choice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ArmParameters):
    """All settable values: those of the arm, and those of the controller alone."""

    F_T_NE: Pose = IDENTITY
    """The nominal end-effector frame in the flange frame: that of the hand, if there is one."""
    NE_T_EE: Pose = IDENTITY
    EE_T_K: Pose = IDENTITY
    """The stiffness frame K: along its axes act the springs of Cartesian impedance, at the end effector's origin."""
    end_effector: Payload
    """The hand, in the flange frame."""
    client_load: Payload
    """What setLoad sets; `load` is this and the hand."""
    thresholds: ContactThresholds = DEFAULT_THRESHOLDS
    """Of setCollisionBehavior."""
    free_axes: tuple[bool, ...] = (True,) * 6
    free_elbow: bool = True

    @classmethod
    def of_arm(cls, arm: RobotDescription) -> Settings:
        """Returns the settings after power-up."""
        limits = arm.limits.joint
        return cls(
            joint_lower=tuple(limits.lower.tolist()),
            joint_upper=tuple(limits.upper.tolist()),
            collision_thresholds=(inf,) * arm.n,
            joint_stiffness=JOINT_STIFFNESS,
            cartesian_stiffness=DEFAULT_CARTESIAN_STIFFNESS,
            force_axes=ForceAxesKind.TOOL,
            end_effector=Payload(),
            client_load=Payload(),
        )

    def describe(self) -> dict[str, Any]:
        """Returns the settings that a client sets, by the names of the maker's library, as JSON data in SI units."""
        return {
            "F_T_NE": self.F_T_NE.as_row_major(),
            "NE_T_EE": self.NE_T_EE.as_row_major(),
            "EE_T_K": self.EE_T_K.as_row_major(),
            "joint_stiffness": self.joint_stiffness,
            "cartesian_stiffness": self.cartesian_stiffness,
            **{f"{item.name}_thresholds": getattr(self.thresholds, item.name) for item in fields(self.thresholds)},
            **self.describe_filters(),
        }


def apply_setup(settings: Settings, setup: ArmSetup, arm: RobotDescription) -> Settings:
    """Returns the settings with a tool or a load of a configuration, as on Franka's Desk: those of the end effector.

    What a client sets with setNEToEE and setLoad comes on top of them.

    Raises:
        InvalidValueError: The controller has no such setting (no safety box, no soft limits), or the load is too heavy.
    """
    if setup.safety_box is not None:
        raise InvalidValueError("safety box", setup.safety_box, "cannot be set: this controller has none")
    if setup.soft_limits is not None:
        raise InvalidValueError("soft limits", setup.soft_limits, "cannot be set: this controller has none")
    if setup.T_flange_tool is not None:
        settings = _with_frames(replace(settings, F_T_NE=setup.T_flange_tool, NE_T_EE=IDENTITY))
    if setup.load is not None:
        if setup.load.mass > arm.rated_payload:
            requirement = f"kg is above {arm.rated_payload:g} kg, the rated payload"
            raise InvalidValueError("load: mass", setup.load.mass, requirement)
        settings = _with_bodies(replace(settings, end_effector=setup.load), arm)
    return settings


def apply_request(settings: Settings, request: Request, arm: RobotDescription) -> Settings:
    """Returns the settings with the values of a request.

    Args:
        settings: The settings before.
        request: A setter; other requests have no effect.
        arm: The arm, for the load that it bears.

    Raises:
        InvalidValueError: A value is out of its bounds; it names the first.
    """
    match request:
        case SetCollisionBehavior():
            return replace(settings, thresholds=_thresholds(request))
        case SetJointImpedance(stiffness=values):
            for number, value in enumerate(values, 1):
                _require(f"stiffness of joint {number}", value, 0.0, LARGEST_JOINT_STIFFNESS, "N m/rad")
            return replace(settings, joint_stiffness=values)
        case SetCartesianImpedance(stiffness=values):
            for number, value in enumerate(values):
                lowest, largest = CARTESIAN_STIFFNESS[number // 3]
                _require(f"stiffness {number + 1}", value, lowest, largest, ("N/m", "N m/rad")[number // 3])
            return replace(settings, cartesian_stiffness=values)
        case SetGuidingMode(axes=axes, elbow=elbow):
            return replace(settings, free_axes=tuple(map(bool, axes)), free_elbow=bool(elbow))
        case SetEEToK(EE_T_K=numbers):
            K = pose_from_columns("EE_T_K", numbers)
            return replace(settings, EE_T_K=K, T_flange_force=settings.T_flange_tool @ K)
        case SetNEToEE(NE_T_EE=numbers):
            return _with_frames(replace(settings, NE_T_EE=pose_from_columns("NE_T_EE", numbers)))
        case SetLoad():
            return _with_bodies(replace(settings, client_load=_load(request)), arm)
        case SetFilters(frequencies=values):
            for value in values:
                _require("filter frequency", value, LOWEST_FREQUENCY, SAMPLING_RATE, "Hz")
            joint, velocity, pose, twist, torque = values
            return replace(
                settings,
                joint_filter=joint,
                velocity_filter=velocity,
                cartesian_filter=pose,
                twist_filter=twist,
                torque_filter=torque,
            )
        case _:
            return settings


def pose_from_columns(name: str, numbers: Sequence[float]) -> Pose:
    """Returns the pose of a column-major matrix.

    Raises:
        InvalidValueError: It is not a proper transform, or is farther than `LONGEST_TOOL` away.
    """
    pose = Pose.from_row_major(tuple(numbers[column + 4 * row] for column in range(4) for row in range(4)))
    _require(f"distance of {name}", hypot(*pose.parts[1]), 0.0, LONGEST_TOOL, "m")
    return pose


def _with_frames(settings: Settings) -> Settings:
    tool = settings.F_T_NE @ settings.NE_T_EE
    return replace(settings, T_flange_tool=tool, T_flange_force=tool @ settings.EE_T_K)


def _with_bodies(settings: Settings, arm: RobotDescription) -> Settings:
    require_payload(settings.client_load.mass, settings.end_effector.mass, arm)
    return replace(settings, load=combine_payloads(settings.end_effector, settings.client_load))


def _load(request: SetLoad) -> Payload:
    _require("distance of the centre of mass", hypot(*request.center), 0.0, LONGEST_TOOL, "m")
    return Payload(
        mass=request.mass,
        center_of_mass=np.array(request.center),
        inertia=np.array(request.inertia).reshape(3, 3) if request.mass else np.zeros((3, 3)),
    )


def _thresholds(request: SetCollisionBehavior) -> ContactThresholds:
    pairs = (
        (request.lower_torque_acceleration, request.upper_torque_acceleration, "torque", "N m"),
        (request.lower_torque_nominal, request.upper_torque_nominal, "torque", "N m"),
        (request.lower_force_acceleration, request.upper_force_acceleration, "force", "N or N m"),
        (request.lower_force_nominal, request.upper_force_nominal, "force", "N or N m"),
    )
    for lower, upper, name, unit in pairs:
        for low, high in zip(lower, upper, strict=True):
            if not (isfinite(low) and isfinite(high)) or low < 0.0 or high < low:
                raise InvalidValueError(
                    f"{name} thresholds",
                    (low, high),
                    f"{unit}: the upper one must not be below the lower, nor either below 0",
                )
    return ContactThresholds(
        contact_torque=request.lower_torque_nominal,
        collision_torque=request.upper_torque_nominal,
        contact_torque_accelerating=request.lower_torque_acceleration,
        collision_torque_accelerating=request.upper_torque_acceleration,
        contact_force=request.lower_force_nominal,
        collision_force=request.upper_force_nominal,
        contact_force_accelerating=request.lower_force_acceleration,
        collision_force_accelerating=request.upper_force_acceleration,
    )


def _require(name: str, value: float, lowest: float, largest: float, unit: str) -> None:
    if not lowest <= value <= largest:  # Also True for NaN.
        raise InvalidValueError(name, float(f"{value:.9g}"), f"{unit} is outside {lowest:g} to {largest:g} {unit}")
