"""A configuration as JSON, for the restart of a workbench after a crash."""

from __future__ import annotations

from typing import Any

from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import ForceControlFrame, ForceFrame, RobotConfiguration, SoftJointLimits
from rcilab.model.dynamics.payload import Payload


def setup_facts(setup: RobotConfiguration) -> dict[str, Any]:
    """Returns the parts of a configuration that are not None, for JSON; lengths in m, poses as x y z w x y z."""
    facts: dict[str, Any] = {}
    if setup.box is not None:
        box = setup.box
        facts["box"] = {"size": list(box.size), "pose": _seven(box.T_base_box), "active": box.active}
    if setup.tool is not None:
        facts["tool"] = _seven(setup.tool)
    if setup.load is not None:
        load = setup.load
        facts["load"] = [load.mass, load.center_of_mass.tolist(), load.inertia.tolist()]
    if setup.force is not None:
        facts["force"] = {"pose": _seven(setup.force.T_flange_force), "axes": setup.force.type.name}
    if setup.joints is not None:
        facts["joints"] = [list(setup.joints.lower), list(setup.joints.upper)]
    return facts


def build_setup(facts: dict[str, Any]) -> RobotConfiguration:
    """Returns the configuration of the result of `setup_facts`.

    Raises:
        LookupError, TypeError, ValueError: The facts are not valid; numbers out of range raise an InvalidValueError.
    """
    box, load, force, joints = (facts.get(part) for part in ("box", "load", "force", "joints"))
    return RobotConfiguration(
        box=None
        if box is None
        else SafetyBox(size=tuple(box["size"]), T_base_box=_pose(box["pose"]), active=bool(box["active"])),
        tool=None if facts.get("tool") is None else _pose(facts["tool"]),
        load=None if load is None else Payload(mass=load[0], center_of_mass=load[1], inertia=load[2]),
        force=None
        if force is None
        else ForceControlFrame(T_flange_force=_pose(force["pose"]), type=ForceFrame[force["axes"]]),
        joints=None if joints is None else SoftJointLimits(lower=tuple(joints[0]), upper=tuple(joints[1])),
    )


def _seven(pose: Pose) -> list[float]:
    return [*pose.position.tolist(), *pose.wxyz.tolist()]


def _pose(seven: list[float]) -> Pose:
    return Pose(seven[:3], seven[3:])
