"""The diagnosis of a motion that the controller stopped: fault, joint, numbers, remedy."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import JointVector
from rcilab.core.fault import name_faults
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import ControllerMode
from rcilab.i18n.translator import Remark
from rcilab.makers.command_findings import CommandConditions, find_commanded, find_followed
from rcilab.makers.driver import FaultReport
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.driver.measured_report import YIELDING_MODES, describe_measured, describe_passed_face
from rcilab.makers.rokae.faults import BOX_FAULTS, RANGE_FAULTS, Fault

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_CONDITIONS = CommandConditions.of(RCI_CONDITIONS)
_HELD = "error.run holds the motion"
_OF_JOINTS = (
    "poses inside the tool's limits are not enough: the joints that they lead to have limits of their own "
    "(check(motion, model, mode='cartesian_position') computes them); move the tool more slowly or with less "
    "acceleration there, and stay away from singular poses"
)


def describe_faults(
    faults: Iterable[Fault],
    record: NDArray[np.void],
    t: float,
    model: RobotModel,
    limits: Limits,
    mode: ControllerMode,
    *,
    late: str = "",
    pressed: str = "",
    box: SafetyBox | None = None,
    collision_thresholds: JointVector | None = None,
) -> FaultReport:
    """Returns the diagnosis of a motion's end.

    Args:
        faults: The reported faults, in wire order.
        record: The last cycles, see `cycle_dtype`.
        t: Motion time of the state with the faults, [s]; NaN before the first command.
        model: The arm with its tool and load.
        limits: Its bounds.
        mode: The command mode.
        late: What `CallTimes.describe` returned, for a motion that a slow callback may have ended.
        pressed: The safety stop that ended the motion, as a sentence with the remedy; "" for none. The RCI has no error
            bit for it, so the bits that a controller sets meanwhile have another meaning.
        box: The controller's safety box, if it is known.
        collision_thresholds: Its collision thresholds, shape (n,), [N m], if they are known.
    """
    faults = tuple(faults)
    when = "before the first command" if math.isnan(t) else f"at t = {t:.3f} s"
    if pressed:
        bits = name_faults(faults)
        sentence = f"the controller stopped the motion {when}: {pressed} (reported as {bits})"
        return FaultReport(sentence, _HELD, Remark(""))
    names = ", ".join(f"{fault.manual_name} ({fault.cause})" for fault in faults)
    parts = [f"the controller stopped the motion {when}: {names}"]
    commanded, is_violated = find_commanded(faults, record, limits, _CONDITIONS)
    measured = describe_measured(faults, record, model, limits, mode, collision_thresholds)
    followed = find_followed(faults, record, model, limits, _CONDITIONS)
    passed = describe_passed_face(faults, record, box)
    found = [part for part in (commanded, followed, *measured, passed) if part]
    parts += found
    if faults:
        is_of_joints = followed and not is_violated
        parts.append(late or (_OF_JOINTS if is_of_joints else _remedy(faults[0], mode, is_violated=is_violated)))
    advice = _HELD if (RANGE_FAULTS | BOX_FAULTS) & set(faults) else f"recover() clears the fault; {_HELD}"
    finding = Remark.all(part for part in found if isinstance(part, Remark))
    return FaultReport("; ".join(parts), advice, finding)


def _remedy(fault: Fault, mode: ControllerMode, *, is_violated: bool) -> str:
    """Returns the remedy for a fault; if the commands kept their limits, it is not about the plan."""
    if mode is ControllerMode.TORQUE:
        return fault.torque_remedy
    if mode in YIELDING_MODES:
        return fault.impedance_remedy
    return fault.remedy if is_violated else fault.outside_remedy
