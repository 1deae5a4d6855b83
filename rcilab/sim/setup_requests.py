"""The configuration of an arm at the simulation port: requests to set it, and the same as the status reports it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees
from typing import NamedTuple, Self, TypeAlias

import numpy as np

from rcilab.core.errors import UsageError
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


def as_setup(request: SetupRequest, box: SafetyBox | None = None) -> ArmSetup:
    """Returns what a request sets.

    Args:
        request: The request.
        box: The safety box in force.

    Raises:
        InvalidValueError: A value is not valid.
        UsageError: It switches a box on or off, and no box is set.
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
            if size is None or position is None:
                if box is None:
                    raise UsageError("there is no safety box; set_box with size and position sets one")
                return ArmSetup(safety_box=replace(box, active=active))
            return ArmSetup(safety_box=SafetyBox(size=size, T_base_box=Pose(position, wxyz), active=active))
        case SetSoftLimits(lower, upper):
            return ArmSetup(soft_limits=(lower, upper))


def describe_setup(request: SetupRequest) -> str:
    """Returns what a request has set, as a sentence for the log."""
    match request:
        case PlaceArm(q):
            what = f"arm placed at {_angles(q)}"
        case SetTool(position, wxyz):
            what = f"tool set at {_lengths(position)} from the flange{_turned(wxyz)}"
        case SetLoad(mass, center_of_mass):
            what = f"load set to {mass:g} kg with its centre of mass at {_lengths(center_of_mass)} from the flange"
        case SetBox(size, position, wxyz, active):
            where = "" if size is None or position is None else f" to {_lengths(size)} at {_lengths(position)}"
            what = f"safety box set{where}{_turned(wxyz)}, {'active' if active else 'not active'}"
        case SetSoftLimits(lower, upper):
            what = f"soft limits of the joints set from {_angles(lower)} to {_angles(upper)}"
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


def _angles(angles: Sequence[float]) -> str:
    return f"{_listed([degrees(angle) for angle in angles])} deg"


def _lengths(lengths: Sequence[float]) -> str:
    return f"{_listed([1e3 * length for length in lengths])} mm"


def _turned(wxyz: Sequence[float]) -> str:
    return "" if tuple(wxyz[1:]) == (0.0, 0.0, 0.0) else f", wxyz {_listed([*wxyz])}"


def _listed(numbers: list[float]) -> str:
    return ", ".join(f"{number:.4g}" for number in numbers)
