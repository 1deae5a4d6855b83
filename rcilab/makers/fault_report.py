"""The diagnosis of a motion that a controller stopped, by its errors alone: what they are and what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import JointVector
from rcilab.core.fault import FaultCode
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import ControllerMode
from rcilab.i18n.translator import Remark
from rcilab.makers.command_findings import find_pause
from rcilab.makers.driver import FaultReport

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_HELD = "error.run holds the motion"


def describe_faults(
    faults: Iterable[FaultCode],
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
    """Returns the diagnosis of a motion's end; see `StreamingDriver.describe_faults`."""
    when = "before the first command" if math.isnan(t) else f"at t = {t:.3f} s"
    if pressed:
        return FaultReport(f"the controller stopped the motion {when}: {pressed}", _HELD, Remark(""))
    found = ", ".join(f"{fault.manual_name} ({fault.cause}). {fault.remedy}" for fault in faults)
    pause = find_pause(record)
    parts = filter(None, (f"the controller stopped the motion {when}: {found}", pause))
    return FaultReport("; ".join(parts), f"recover() clears the error; {_HELD}", Remark.all(filter(None, (pause,))))
