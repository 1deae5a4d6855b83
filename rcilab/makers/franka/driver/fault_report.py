"""The diagnosis of a motion that the controller stopped: error, joint, numbers, what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.core.limits import Limits
from rcilab.core.state import ControllerMode
from rcilab.i18n.translator import Remark
from rcilab.makers.command_findings import (
    CommandConditions,
    find_commanded,
    find_followed,
    find_lost_commands,
    find_pause,
)
from rcilab.makers.driver import FaultReport
from rcilab.makers.franka.errors import FrankaError

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_LONG_GAP = 0.02  # [s] Between states; the libraries keep the newest one only. A tuning value.
_HELD = "error.run holds the motion"
_REFLEXES = frozenset({FrankaError.JOINT_REFLEX, FrankaError.CARTESIAN_REFLEX})
_OF_JOINTS = (
    "poses inside the tool's limits are not enough: the joints that they lead to have limits of their own "
    "(check(motion, model, mode='cartesian_position') computes them); move the tool more slowly or with less "
    "acceleration there, and stay away from singular poses"
)
_ADVICE = {
    **dict.fromkeys(
        _REFLEXES,
        "check for contact; if the error is raised without contact, set the load (set_load) or raise the thresholds "
        "(robot.fci.set_collision_behavior)",
    ),
    FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION: (
        "check the network and the real-time configuration (rcilab doctor); the controller bridges up to 20 lost "
        "commands in a row"
    ),
    FrankaError.CONTROLLER_TORQUE_DISCONTINUITY: (
        "let torques change gradually; if your own control law oscillates, lower its damping first"
    ),
    FrankaError.JOINT_POSITION_LIMITS_VIOLATION: "move the joint back inside its range, by hand if recover() fails",
}
_SMOOTHNESS = (
    "check that the commands are continuous up to their acceleration and inside the limits; otherwise lower the speed, "
    "or filter them: control(callback, rate_limit='manual', cut_off=100)"
)


def describe_faults(
    faults: Iterable[FrankaError],
    record: NDArray[np.void],
    t: float,
    model: RobotModel,
    limits: Limits,
    mode: ControllerMode,
    *,
    collisions: Iterable[Remark],
    late: str,
    pressed: str,
) -> FaultReport:
    """Returns the diagnosis of a motion's end; see `StreamingDriver.describe_faults`.

    `collisions` are the external torques and forces above their thresholds, for a reflex.
    """
    faults = tuple(faults)
    when = "before the first command" if math.isnan(t) else _describe_time(t, record)
    if pressed:
        return FaultReport(f"the controller stopped the motion {when}: {pressed}", _HELD, Remark(""))
    names = ", ".join(f"{fault.manual_name} ({fault.cause})" for fault in faults)
    table = model.description.conditions
    assert table is not None  # Every Franka arm has one.
    conditions = CommandConditions.of(table())
    commanded, is_violated = find_commanded(faults, record, limits, conditions)
    followed = find_followed(faults, record, model, limits, conditions)
    lost = find_lost_commands(record) if FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION in faults else ""
    found = [part for part in (commanded, followed, lost, find_pause(record)) if part]
    found += _describe_reflex(faults, record, collisions)
    advice = late or next((_ADVICE[fault] for fault in faults if fault in _ADVICE), "")
    advice = advice or (_OF_JOINTS if followed and not is_violated else _SMOOTHNESS)
    parts = [f"the controller stopped the motion {when}: {names}", *found, advice]
    finding = Remark.all(part for part in found if isinstance(part, Remark))
    return FaultReport("; ".join(parts), f"recover() clears the fault; {_HELD}", finding)


def _describe_time(t: float, record: NDArray[np.void]) -> str:
    """Returns when a motion was stopped that a state at a time t, [s], shows as stopped."""
    before = float(record["t"][-2]) if len(record) > 1 else t
    if t - before < _LONG_GAP:  # Also if it is nan.
        return f"at t = {t:.3f} s"
    return f"between t = {before:.3f} s and {t:.3f} s (no state was read meanwhile)"


def _describe_reflex(
    faults: tuple[FrankaError, ...], record: NDArray[np.void], collisions: Iterable[Remark]
) -> list[str]:
    """Returns what caused a reflex, else the external force at the end; nothing for other errors."""
    if not _REFLEXES & set(faults):
        return []
    found: list[str] = list(collisions)
    wrench = record["tau_ext_in_base"][-1:]
    if not found and len(wrench) and np.isfinite(wrench).all():
        found.append(f"an external force of {np.linalg.norm(wrench[0, :3]):.3g} N acts at the tool")
    return found
