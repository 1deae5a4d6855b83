"""Everything a client can set over TCP, judged again on our side.

The vendor's client checks some values before it sends them and lets NaN through nearly every check, so here every
value is judged: finite, inside its range, a proper pose where one is due. What fails is answered with "invalid
argument" and changes nothing. On 6-axis arms the seventh elements are not even looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, repeat
from math import hypot, isfinite

import numpy as np

from rcilab.arrays import frozen
from rcilab.dynamics.payload import NO_LOAD, Payload
from rcilab.errors import InvalidValueError
from rcilab.limits import JointLimits
from rcilab.protocols import rci
from rcilab.protocols.rci.bounds import (
    FARTHEST_BOX,
    FILTER_OFF,
    LARGEST_BOX,
    LIMIT_TOLERANCE,
    LONGEST_TOOL,
    LOWEST_FREQUENCY,
)
from rcilab.robots import RobotDescription
from rcilab.safety_box import SafetyBox
from rcilab.spatial import IDENTITY, Pose

SIGNAL_COUNT = 6  # Digital inputs, and outputs: DI0_0 to DI0_3, DI1_0, DI1_1 (manual 3.1.13 and 3.1.14).

Floats = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """All values that commands set; vectors have n plain floats."""

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
    """What Cartesian impedance presses with, [N, N m]."""
    T_flange_tool: Pose = IDENTITY
    load: Payload = NO_LOAD
    joint_filter: float = FILTER_OFF
    """Cut-off frequency of the low pass on commanded joint angles, [Hz]. It wakes up switched off, a choice: the
    vendor's client filters before it sends, and whoever does not is followed exactly."""
    cartesian_filter: float = FILTER_OFF
    """The same for commanded poses, [Hz]."""
    torque_filter: float = FILTER_OFF
    """The same for commanded torques, [Hz]."""
    torque_report_filter: float = 100.0
    """Cut-off frequency of the filtered torques in the state, [Hz]."""
    safety_box: SafetyBox | None = None
    T_flange_force: Pose = IDENTITY
    """Force-control frame."""
    force_frame: rci.ForceFrame = rci.ForceFrame.WORLD
    virtual_guide: bool = False
    outputs: tuple[bool, ...] = (False,) * SIGNAL_COUNT
    inputs: tuple[bool, ...] = (False,) * SIGNAL_COUNT
    """Levels of the digital inputs; nothing is wired to a virtual controller, they are set from outside."""
    loop_back: bool = False
    """Whether every digital output is wired to the input of the same number."""
    auto_limit: bool = False
    """Whether commanded joint angles are led to rest inside the soft limits instead of raising a fault beyond them.
    `auto_limit` of setJointLimit is not on the wire: it is set from outside."""

    def soft_limits(self, joint: JointLimits) -> JointLimits:
        """Returns the limits of an arm's joints with the soft limits as position bounds."""
        return replace(joint, lower=frozen(self.joint_lower), upper=frozen(self.joint_upper))

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

    def rebooted(self, arm: RobotDescription) -> Settings:
        """Returns what is left after a reboot: the defaults, and what is wired or chosen outside of the controller."""
        kept = replace(default_settings(arm), inputs=self.inputs, auto_limit=self.auto_limit)
        return kept.with_loop_back(self.loop_back)


def default_settings(arm: RobotDescription) -> Settings:
    """Returns the settings a controller wakes up with: the widest limits, the highest thresholds and stiffness."""
    joint, cartesian = arm.limits.joint, arm.limits.cartesian
    return Settings(
        joint_lower=tuple(joint.lower.tolist()),
        joint_upper=tuple(joint.upper.tolist()),
        collision_thresholds=tuple(joint.collision_threshold.tolist()),
        joint_stiffness=tuple(joint.stiffness.tolist()),
        cartesian_stiffness=(cartesian.translation_stiffness,) * 3 + (cartesian.rotation_stiffness,) * 3,
    )


def apply_request(settings: Settings, request: rci.Request, arm: RobotDescription) -> Settings | None:
    """Returns the settings with a request's values in them, or None when the request has an invalid argument.

    Args:
        settings: The settings so far.
        request: A setter; anything else leaves them as they are.
        arm: Whose ranges count.
    """
    changes = _judge(request, arm, settings)
    return None if changes is None else replace(settings, **changes)


def _judge(request: rci.Request, arm: RobotDescription, settings: Settings) -> dict[str, object] | None:
    """Returns the fields to change, or None when a value is invalid."""
    n, joint, cartesian = arm.n, arm.limits.joint, arm.limits.cartesian
    match request:
        case rci.SetCollisionBehavior(thresholds=values):
            return _ranged("collision_thresholds", values[:n], joint.collision_threshold.tolist())
        case rci.SetJointImpedance(stiffness=values):
            return _ranged("joint_stiffness", values[:n], joint.stiffness.tolist())
        case rci.SetCartesianImpedance(stiffness=values):
            largest = [cartesian.translation_stiffness] * 3 + [cartesian.rotation_stiffness] * 3
            return _ranged("cartesian_stiffness", values, largest)
        case rci.SetCartImpDesiredTau(wrench=values):
            largest = [cartesian.force] * 3 + [cartesian.moment] * 3
            return _ranged("desired_wrench", values, largest, symmetric=True)
        case rci.SetTorqueFilterCutOffFrequency(frequency=value):
            return {"torque_report_filter": value} if LOWEST_FREQUENCY <= value <= FILTER_OFF else None
        case rci.SetFilters():
            frequencies = (request.joint_frequency, request.cartesian_frequency, request.torque_frequency)
            if not all(LOWEST_FREQUENCY <= value <= FILTER_OFF for value in frequencies):
                return None
            return dict(zip(("joint_filter", "cartesian_filter", "torque_filter"), frequencies, strict=True))
        case rci.SetJointLimit():
            return _soft_limits(request, arm)
        case rci.SetCartesianLimit():
            pose = _pose(request.frame)
            if pose is None or not all(abs(x) <= FARTHEST_BOX for x in pose.parts[1]):
                return None
            if not all(0.0 < edge <= LARGEST_BOX for edge in request.size):
                return None
            return {"safety_box": SafetyBox(size=request.size, T_base_box=pose, active=request.active)}
        case rci.SetCoor(T_flange_tool=numbers):
            pose = _pose_at_flange(numbers)
            return None if pose is None else {"T_flange_tool": pose}
        case rci.SetFcCoor(frame=numbers, type=kind):
            pose = _pose_at_flange(numbers)
            if pose is None or kind not in tuple(rci.ForceFrame):
                return None
            return {"T_flange_force": pose, "force_frame": rci.ForceFrame(kind)}
        case rci.SetLoad():
            return _load(request, arm)
        case rci.EnableVirtualGuide(enable=enable):
            return {"virtual_guide": enable}
        case rci.SetDO(signal=signal, level=level):
            if signal >= SIGNAL_COUNT:
                return None
            outputs = (*settings.outputs[:signal], level, *settings.outputs[signal + 1 :])
            return {"outputs": outputs, "inputs": outputs if settings.loop_back else settings.inputs}
        case _:
            return {}


def _ranged(
    name: str, values: Floats, largest: Sequence[float], *, symmetric: bool = False
) -> dict[str, object] | None:
    lowest = (-bound for bound in largest) if symmetric else repeat(0.0)
    if all(low <= value <= high for value, low, high in zip(values, lowest, largest, strict=False)):
        return {name: values}
    return None  # Also for NaN, which is in no range.


def _soft_limits(request: rci.SetJointLimit, arm: RobotDescription) -> dict[str, object] | None:
    upper, lower = request.upper[: arm.n], request.lower[: arm.n]
    bounds = zip(lower, upper, arm.limits.joint.lower.tolist(), arm.limits.joint.upper.tolist(), strict=True)
    for low, high, lowest, highest in bounds:
        if not lowest - LIMIT_TOLERANCE <= low < high <= highest + LIMIT_TOLERANCE:
            return None
    return {"joint_lower": lower, "joint_upper": upper}


def _load(request: rci.SetLoad, arm: RobotDescription) -> dict[str, object] | None:
    numbers = chain(request.center_of_mass, request.inertia)
    if not 0.0 <= request.mass <= arm.rated_payload or not all(map(isfinite, numbers)):
        return None
    if not hypot(*request.center_of_mass) <= LONGEST_TOOL:
        return None
    try:
        load = Payload(
            mass=request.mass,
            center_of_mass=np.array(request.center_of_mass),
            inertia=np.array(request.inertia).reshape(3, 3),
        )
    except InvalidValueError:
        return None
    return {"load": load}


def _pose(numbers: Floats) -> Pose | None:
    try:
        return Pose.from_row_major(numbers)
    except InvalidValueError:
        return None


def _pose_at_flange(numbers: Floats) -> Pose | None:
    pose = _pose(numbers)
    return pose if pose is not None and hypot(*pose.parts[1]) <= LONGEST_TOOL else None
