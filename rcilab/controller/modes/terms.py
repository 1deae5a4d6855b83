"""What a motion that begins now is judged by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rcilab.arrays import frozen
from rcilab.conformance import LimitTable, cartesian_limits
from rcilab.controller.actuator import Law, guiding_box
from rcilab.controller.modes.generator import Terms
from rcilab.controller.modes.mode import Mode
from rcilab.controller.modes.start import StartTolerance
from rcilab.controller.plant import Measurement
from rcilab.controller.settings import Settings
from rcilab.limits import JointLimits
from rcilab.model import RobotModel
from rcilab.safety_box import active_box
from rcilab.spatial import Pose

_ROUNDING = 1e-6  # [rad], [m] Where an arm stands beyond a bound, it may be that much farther.


def build_terms(
    mode: Mode,
    model: RobotModel,
    settings: Settings,
    table: LimitTable,
    measured: Measurement,
    T_base_tool: Pose,
    tolerance: StartTolerance,
) -> Terms:
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
        measured: Where the arm rests.
        T_base_tool: Where its tool is, in base.
        tolerance: How far the first command may be off the reference.
    """
    joint = _up_to(settings.soft_limits(model.limits.joint), measured)
    limits = replace(cartesian_limits(model.limits, table), joint=joint)
    yields_to_walls = mode.law in (Law.JOINT_IMPEDANCE, Law.CARTESIAN_IMPEDANCE) and guiding_box(settings) is not None
    box = None if yields_to_walls else settings.safety_box
    return Terms(
        model=model, settings=settings, limits=limits, box=active_box(box), tolerance=tolerance, start=T_base_tool
    )


def _up_to(joint: JointLimits, measured: Measurement) -> JointLimits:
    q = measured.q
    if (joint.lower < q).all() and (q < joint.upper).all():
        return joint
    lower, upper = np.minimum(joint.lower, q - _ROUNDING), np.maximum(joint.upper, q + _ROUNDING)
    return replace(joint, lower=frozen(lower), upper=frozen(upper))
