"""Filters and bounds of a motion, fixed when it begins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

from rcilab.conformance.common_conditions import TOOL_CONDITIONS, condition_table
from rcilab.core.arrays import JointVector
from rcilab.core.condition import Condition
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box, box_for_start
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import range_from
from rcilab.robots.description import ServoFigures
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.generators.start import StartTolerance

_SPRINGS = (ControlLaw.JOINT_IMPEDANCE, ControlLaw.CARTESIAN_IMPEDANCE)


class CommandKind(Enum):
    """What a client commands; a command has the field of its kind."""

    JOINT_ANGLES = "joint angles"
    JOINT_VELOCITIES = "joint velocities"
    POSES = "poses of the tool"
    TWISTS = "velocities of the tool"
    JOINT_GOALS = "joint angles to move to"
    """The controller plans the motion to the newest one; a command may come at any time."""
    TORQUES = "joint torques"


class MotionMode(NamedTuple):
    """Type of command and control law of a motion.

    Under the law TORQUE, torques move the arm. With a kind other than TORQUES the client commands a motion
    along with them, which is checked and is the arm's reference; its torques may use it.
    """

    law: ControlLaw
    kind: CommandKind
    goal_velocity: tuple[float, ...] = ()
    """For JOINT_GOALS: the largest joint velocities, n numbers, [rad/s]; the limits apply where they are smaller."""

    @property
    def is_cartesian(self) -> bool:
        """Whether the tool is commanded: its motion is checked, and a singular start is refused."""
        return self.kind in (CommandKind.POSES, CommandKind.TWISTS)

    @property
    def is_streamed(self) -> bool:
        """Whether a command is needed in every cycle."""
        return self.kind is not CommandKind.JOINT_GOALS

    @property
    def can_hold(self) -> bool:
        """Whether the last command can be held while commands are missing: it is a place."""
        return self.law is not ControlLaw.TORQUE and self.kind in (CommandKind.JOINT_ANGLES, CommandKind.POSES)

    @property
    def has_reference(self) -> bool:
        """Whether the client commands a motion, alone or along with torques."""
        return self.kind is not CommandKind.TORQUES


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionLimits:
    """Filters and bounds of a motion."""

    mode: MotionMode
    model: RobotModel
    """The arm with its tool and load."""
    parameters: ArmParameters
    limits: Limits
    """With the soft limits as position bounds."""
    box: SafetyBox | None
    """Safety box of the tool; None without one."""
    tolerance: StartTolerance
    """Largest difference of the first command from the reference."""
    is_strict_start: bool
    """Whether a start outside the tolerance is a violation by itself, and the only one of its cycle."""
    counts_replacements: bool
    """Whether the replacement of a lost command counts as the last command, in place of the cycles over the gap."""
    starts: tuple[Pose, ...]
    """Poses of the tool in base where the motion begins: measured and commanded."""
    servos: tuple[ServoFigures, ...] | None
    """The servos that respond to a held command, one per joint; None: lost commands are bridged instead."""

    @property
    def has_free_elbow(self) -> bool:
        """Whether poses without an arm angle leave it free: the joints then move least. Otherwise it is held."""
        return condition_table(self.model.description).has_free_elbow

    def tool_conditions(self) -> tuple[Condition, ...]:
        """Returns `TOOL_CONDITIONS` with the maker's range of the arm angle, which may be that of a joint."""
        table = condition_table(self.model.description)
        ranges = [row.bounds for row in table.conditions if _is_arm_angle_range(row)]
        if not ranges:
            return TOOL_CONDITIONS
        return tuple(replace(row, bounds=ranges[0]) if _is_arm_angle_range(row) else row for row in TOOL_CONDITIONS)

    def entry_box(self) -> SafetyBox | EntryBox | None:
        """Returns the bounds of the tool; if it starts outside the box, it may only move inwards."""
        return box_for_start(self.box, *(pose.parts[1] for pose in self.starts))


def _is_arm_angle_range(row: Condition) -> bool:
    return (row.signal, row.order, row.stage) == ("arm_angle", 0, "throughout")


def build_motion_limits(
    mode: MotionMode,
    model: RobotModel,
    parameters: ArmParameters,
    limits: Limits,
    starts: tuple[JointVector, ...],
    tools: tuple[Pose, ...],
    tolerance: StartTolerance,
    servos: tuple[ServoFigures, ...] | None,
    *,
    is_strict_start: bool = False,
    counts_replacements: bool = False,
) -> MotionLimits:
    """Returns filters and bounds of a motion.

    After a violation of a soft limit or of the safety box, the arm stops outside. A motion that begins there may only
    lead back: the bound of a joint is its present angle, that of the tool follows it inwards (see `EntryBox`). With
    walls that push the tool back into its box, the box is not checked.

    Args:
        mode: Type of command and control law.
        model: The arm with its tool and load.
        parameters: The configuration from the client.
        limits: Limits of the arm for this motion; infinite where the maker has no check.
        starts: Measured and commanded joint angles at the start: the farther one extends a range.
        tools: Measured and commanded pose of the tool in base.
        tolerance: Largest difference of the first command from the reference.
        servos: The servos that respond to a held command; None: lost commands are bridged.
        is_strict_start: Whether a start outside the tolerance is a violation by itself.
        counts_replacements: Whether the replacement of a lost command counts as the last command.
    """
    joint = parameters.soft_limits(limits.joint)
    for q in starts:
        joint = range_from(joint, q)
    has_walls = mode.law in _SPRINGS and parameters.guiding_box is not None
    return MotionLimits(
        mode=mode,
        model=model,
        parameters=parameters,
        limits=replace(limits, joint=joint),
        box=active_box(None if has_walls else parameters.safety_box),
        tolerance=tolerance,
        is_strict_start=is_strict_start,
        counts_replacements=counts_replacements,
        starts=tools,
        servos=servos,
    )
