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
from rcilab.makers.driver import FaultReport

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_HELD = "error.run holds the motion"
_LATE = 0.02  # [s] Without a command: a few periods of any interface.
_LAST = 20  # Commands before the fault that are looked at.


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
    return FaultReport(
        f"the controller stopped the motion {when}: {found}{_describe_gap(record)}",
        f"recover() clears the error; {_HELD}",
        Remark(""),
    )


def _describe_gap(record: NDArray[np.void]) -> str:
    """Returns that a client was late, and by how much; "" if it was not."""
    sent = record["sent_ns"][record["sent_ns"] > 0][-_LAST:]
    gap = 1e-9 * float(np.diff(sent).max()) if len(sent) > 1 else 0.0
    if gap < _LATE:
        return ""
    return (
        f". Shortly before, no command was sent for {1e3 * gap:.0f} ms: a callback took long, or the machine was busy"
    )
