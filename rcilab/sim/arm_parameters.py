"""The configuration of a virtual arm, independent of the maker; the settings of a maker extend it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Self

from rcilab.core.arrays import readonly_copy
from rcilab.core.limits import JointLimits
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.dynamics.payload import NO_LOAD, Payload
from rcilab.robots import RobotDescription
from rcilab.sim.filters import SAMPLING_RATE

Floats = tuple[float, ...]

UPRIGHT = (0.0, 0.0, -1.0)
"""Direction of gravity in base of an arm that stands upright."""


class ForceAxesKind(Enum):
    """Directions of the axes of the force-control frame."""

    WORLD = "world"
    """The axes of the base."""
    TOOL = "tool"
    """The axes of the frame itself."""
    PATH = "path"
    """x along the commanded velocity of the tool."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmParameters:
    """The configuration from a client; vectors have n plain floats."""

    joint_lower: Floats
    """Soft limits, [rad]."""
    joint_upper: Floats
    """[rad]."""
    collision_thresholds: Floats
    """[N m]."""
    joint_stiffness: Floats
    """[N m/rad]."""
    cartesian_stiffness: Floats
    """Three translations [N/m], three rotations [N m/rad]."""
    desired_wrench: Floats = (0.0,) * 6
    """Desired wrench of Cartesian impedance, [N, N m]."""
    T_flange_tool: Pose = IDENTITY
    load: Payload = NO_LOAD
    joint_filter: float = SAMPLING_RATE
    """Cut-off frequency of the low-pass filter of commanded joint angles, [Hz]. Off after power-up, so that commands
    are not filtered twice."""
    cartesian_filter: float = SAMPLING_RATE
    """The same for commanded poses, [Hz]."""
    torque_filter: float = SAMPLING_RATE
    """The same for commanded torques, [Hz]."""
    velocity_filter: float = SAMPLING_RATE
    """The same for commanded joint velocities, [Hz]."""
    twist_filter: float = SAMPLING_RATE
    """The same for commanded velocities of the tool, [Hz]."""
    safety_box: SafetyBox | None = None
    T_flange_force: Pose = IDENTITY
    """Force-control frame."""
    force_axes: ForceAxesKind = ForceAxesKind.WORLD
    virtual_guide: bool = False
    """Whether walls push the tool back into the active safety box while the arm is compliant."""
    guide_damping: float = 1.0
    """Factor on the damping of a guided arm."""
    gravity: Floats = UPRIGHT
    """Direction of gravity in base for which a guided arm is compensated; the arm itself stands upright."""
    auto_limit: bool = False
    """Whether commanded joint angles are stopped inside the soft limits instead of violating them."""

    @classmethod
    def of(cls, arm: RobotDescription) -> Self:
        """Returns the configuration after power-up: the widest limits, the highest thresholds and stiffness."""
        joint, cartesian = arm.limits.joint, arm.limits.cartesian
        return cls(
            joint_lower=tuple(joint.lower.tolist()),
            joint_upper=tuple(joint.upper.tolist()),
            collision_thresholds=tuple(joint.collision_threshold.tolist()),
            joint_stiffness=tuple(joint.stiffness.tolist()),
            cartesian_stiffness=(cartesian.translation_stiffness,) * 3 + (cartesian.rotation_stiffness,) * 3,
        )

    def soft_limits(self, joint: JointLimits) -> JointLimits:
        """Returns the limits of an arm's joints with the soft limits as position bounds."""
        return replace(joint, lower=readonly_copy(self.joint_lower), upper=readonly_copy(self.joint_upper))

    @property
    def guiding_box(self) -> SafetyBox | None:
        """The box whose walls push the tool back; None without such walls."""
        return active_box(self.safety_box) if self.virtual_guide else None

    def describe(self) -> dict[str, Any]:
        """Returns the settings that the maker's controller has, as JSON data in SI units, without tool and load."""
        box = self.safety_box
        return {
            "joint_lower": self.joint_lower,
            "joint_upper": self.joint_upper,
            "collision_thresholds": self.collision_thresholds,
            "joint_stiffness": self.joint_stiffness,
            "cartesian_stiffness": self.cartesian_stiffness,
            "desired_wrench": self.desired_wrench,
            **self.describe_filters(),
            "force_frame": self.T_flange_force.as_row_major(),
            "force_axes": self.force_axes.value,
            "virtual_guide": self.virtual_guide,
            "auto_limit": self.auto_limit,
            "safety_box": None
            if box is None
            else {"size": box.size, "pose": box.T_base_box.as_row_major(), "active": box.active},
        }

    def describe_filters(self) -> dict[str, float]:
        """Returns the cut-off frequencies by name, [Hz]."""
        return {
            "joint_filter": self.joint_filter,
            "cartesian_filter": self.cartesian_filter,
            "torque_filter": self.torque_filter,
            "velocity_filter": self.velocity_filter,
            "twist_filter": self.twist_filter,
        }
