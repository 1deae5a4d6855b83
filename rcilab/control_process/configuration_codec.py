"""A set-up on its way to the control process, as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.driver.configuration import ForceControlFrame, RobotConfiguration, SoftJointLimits
from rcilab.makers.rokae.driver.controller_parameters import ControllerParameters
from rcilab.makers.rokae.wire import ForceFrame
from rcilab.model.dynamics.payload import Payload


def pack_setup(setup: RobotConfiguration) -> dict[str, Any]:
    """Returns a set-up as a part of a letter."""
    letter: dict[str, Any] = {}
    if setup.tool is not None:
        letter["tool"] = setup.tool.as_row_major()
    if setup.load is not None:
        load = setup.load
        letter["load"] = [load.mass, load.center_of_mass.tolist(), load.inertia.tolist()]
    if setup.box is not None:
        letter["box"] = [setup.box.size, setup.box.T_base_box.as_row_major(), setup.box.active]
    if setup.force is not None:
        letter["force"] = [setup.force.T_flange_force.as_row_major(), int(setup.force.type)]
    if setup.joints is not None:
        letter["joints"] = [setup.joints.lower, setup.joints.upper]
    if setup.control is not None:
        letter["control"] = setup.control.as_letter()
    return letter


def parse_setup(letter: dict[str, Any]) -> RobotConfiguration:
    """Returns what `pack_setup` wrote."""
    tool = load = box = force = joints = control = None
    if "tool" in letter:
        tool = Pose.from_row_major(letter["tool"])
    if "load" in letter:
        mass, center, inertia = letter["load"]
        load = Payload(mass=mass, center_of_mass=np.array(center), inertia=np.array(inertia))
    if "box" in letter:
        size, pose, active = letter["box"]
        box = SafetyBox(size=tuple(size), T_base_box=Pose.from_row_major(pose), active=active)
    if "force" in letter:
        pose, kind = letter["force"]
        force = ForceControlFrame(T_flange_force=Pose.from_row_major(pose), type=ForceFrame(kind))
    if "joints" in letter:
        lower, upper = map(tuple, letter["joints"])
        joints = SoftJointLimits(lower=lower, upper=upper)
    if "control" in letter:
        control = ControllerParameters.from_letter(letter["control"])
    return RobotConfiguration(box=box, tool=tool, load=load, force=force, joints=joints, control=control)
