"""Filters and bounds of a motion, fixed when it begins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from rcilab.core.arrays import JointVector
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box, box_for_start
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import range_from
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.generators.start import StartTolerance

_SPRINGS = (ControlLaw.JOINT_IMPEDANCE, ControlLaw.CARTESIAN_IMPEDANCE)


class Mode(NamedTuple):
    """What a client commands, and what the drives make of it."""

    law: ControlLaw
    is_cartesian: bool
    """Whether tool poses are commanded: the tool's motion is checked and a singular start is refused."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionLimits:
    """What a motion is filtered with and checked against."""

    model: RobotModel
    """The arm with its tool and load."""
    parameters: ArmParameters
    limits: Limits
    """With the soft limits as position bounds."""
    box: SafetyBox | None
    """Where the tool must stay; None when nothing bounds it."""
    tolerance: StartTolerance
    """How far the first command may be off the reference."""
    starts: tuple[Pose, ...]
    """Poses of the tool in base where the motion begins: measured and commanded."""

    def entry_box(self) -> SafetyBox | EntryBox | None:
        """Returns what bounds the tool; where it starts outside the box, it may only move in."""
        return box_for_start(self.box, *(pose.parts[1] for pose in self.starts))


def build_motion_limits(
    mode: Mode,
    model: RobotModel,
    parameters: ArmParameters,
    limits: Limits,
    starts: tuple[JointVector, ...],
    tools: tuple[Pose, ...],
    tolerance: StartTolerance,
) -> MotionLimits:
    """Returns filters and bounds of a motion.

    A stop ends beyond a soft limit or outside the safety box when that is what it was for. A motion that begins there
    may lead back, and not farther out: the bound of a joint is its present angle, that of the tool moves in with it
    (see `EntryBox`). Where walls push the tool back into its box, the box is not checked.

    Args:
        mode: What the motion is.
        model: The arm with its tool and load.
        parameters: What the client has configured.
        limits: Of the arm, as they apply to this motion; infinite where the maker checks nothing.
        starts: Measured and commanded joint angles at the start: the farther one opens a range.
        tools: Measured and commanded pose of the tool in base.
        tolerance: How far the first command may be off the reference.
    """
    joint = parameters.soft_limits(limits.joint)
    for q in starts:
        joint = range_from(joint, q)
    has_walls = mode.law in _SPRINGS and parameters.guiding_box is not None
    return MotionLimits(
        model=model,
        parameters=parameters,
        limits=replace(limits, joint=joint),
        box=active_box(None if has_walls else parameters.safety_box),
        tolerance=tolerance,
        starts=tools,
    )
