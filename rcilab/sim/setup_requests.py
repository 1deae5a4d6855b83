"""The configuration of an arm at the simulation port: requests to set it, and the same as the status reports it."""

from __future__ import annotations

from math import degrees
from typing import NamedTuple, Self, TypeAlias

import numpy as np

from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.api import PlaceArm, SetBox, SetLoad, SetSoftLimits, SetTool
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.arm_setup import ArmSetup

SetupRequest: TypeAlias = PlaceArm | SetTool | SetLoad | SetBox | SetSoftLimits


class SetupInForce(NamedTuple):
    """The configuration of an arm, each part as the request that sets it."""

    tool: SetTool
    load: SetLoad
    box: SetBox | None
    """None: there is no safety box."""
    soft_limits: SetSoftLimits

    @classmethod
    def of(cls, parameters: ArmParameters) -> Self:
        """Returns what is in force."""
        return cls(
            tool_request(parameters.T_flange_tool),
            load_request(parameters.load),
            None if parameters.safety_box is None else box_request(parameters.safety_box),
            SetSoftLimits(parameters.joint_lower, parameters.joint_upper),
        )


def as_setup(request: SetupRequest) -> ArmSetup:
    """Returns what a request sets.

    Raises:
        InvalidValueError: A value is not valid.
    """
    match request:
        case PlaceArm(q):
            return ArmSetup(q=q)
        case SetTool(position, wxyz):
            return ArmSetup(T_flange_tool=Pose(position, wxyz))
        case SetLoad(mass, center_of_mass, inertia):
            moments = np.array(inertia).reshape(3, 3)
            return ArmSetup(load=Payload(mass=mass, center_of_mass=np.array(center_of_mass), inertia=moments))
        case SetBox(size, position, wxyz, active):
            return ArmSetup(safety_box=SafetyBox(size=size, T_base_box=Pose(position, wxyz), active=active))
        case SetSoftLimits(lower, upper):
            return ArmSetup(soft_limits=(lower, upper))


def describe_setup(request: SetupRequest) -> str:
    """Returns what a request has set, as a sentence for the log."""
    match request:
        case PlaceArm(q):
            what = f"arm placed at {_listed([degrees(angle) for angle in q])} deg"
        case SetTool(position):
            what = f"tool set at {_listed([1e3 * x for x in position])} mm from the flange"
        case SetLoad(mass):
            what = f"load set to {mass:g} kg"
        case SetBox(active=active):
            what = f"safety box set{'' if active else ', not active'}"
        case SetSoftLimits():
            what = "soft limits of the joints set"
    return f"{what}, by the simulation port"


def tool_request(tool: Pose) -> SetTool:
    """Returns the request that sets a tool."""
    return SetTool(tuple(tool.position.tolist()), tuple(tool.wxyz.tolist()))


def load_request(load: Payload) -> SetLoad:
    """Returns the request that sets a load."""
    return SetLoad(load.mass, tuple(load.center_of_mass.tolist()), tuple(load.inertia.ravel().tolist()))


def box_request(box: SafetyBox) -> SetBox:
    """Returns the request that sets a safety box."""
    pose = box.T_base_box
    return SetBox(box.size, tuple(pose.position.tolist()), tuple(pose.wxyz.tolist()), box.active)


def _listed(numbers: list[float]) -> str:
    return ", ".join(f"{number:.4g}" for number in numbers)
