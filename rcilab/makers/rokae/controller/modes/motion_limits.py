"""What a motion that begins now is judged by."""

from __future__ import annotations

from dataclasses import replace

from rcilab.core.arrays import JointVector
from rcilab.core.safety_box import active_box
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.controller.actuator import ControlLaw, guiding_box
from rcilab.makers.rokae.controller.modes.generator import MotionLimits
from rcilab.makers.rokae.controller.modes.mode import Mode
from rcilab.makers.rokae.controller.modes.start import StartTolerance
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.makers.rokae.limit_tables import LimitTable, cartesian_limits
from rcilab.model.robot_model import RobotModel
from rcilab.motion.range import range_from


def build_terms(
    mode: Mode,
    model: RobotModel,
    settings: Settings,
    table: LimitTable,
    stands: tuple[JointVector, ...],
    tools: tuple[Pose, ...],
    tolerance: StartTolerance,
) -> MotionLimits:
    """Returns filters and bounds of a motion.

    Stops end beyond a soft limit or the safety box when that was what they were for. A motion that begins out there may
    lead back, and not farther out: the bound of a joint is where the arm stands, that of the tool moves in with it (see
    `EntryBox`). Where walls push the tool back into its box, the
    box is not judged.

    Args:
        mode: What the motion is.
        model: The arm with its tool and load.
        settings: What the client has set.
        table: Whose bounds of the tool's motion count.
        stands: Where the arm is, as measured and as commanded: the farther one opens a range.
        tools: Where its tool is, in base, likewise.
        tolerance: How far the first command may be off the reference.
    """
    joint = settings.soft_limits(model.limits.joint)
    for q in stands:
        joint = range_from(joint, q)
    limits = replace(cartesian_limits(model.limits, table), joint=joint)
    yields_to_walls = (
        mode.law in (ControlLaw.JOINT_IMPEDANCE, ControlLaw.CARTESIAN_IMPEDANCE) and guiding_box(settings) is not None
    )
    box = None if yields_to_walls else settings.safety_box
    return MotionLimits(
        model=model, settings=settings, limits=limits, box=active_box(box), tolerance=tolerance, starts=tools
    )
