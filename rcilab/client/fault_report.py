"""One sentence for a motion that the controller stopped: which fault, which joint, which number, what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rcilab.clock import CYCLE_TIME
from rcilab.conformance import JointMonitor
from rcilab.faults import Fault
from rcilab.limits import JointLimits


def describe_faults(faults: Iterable[Fault], record: NDArray[np.void], t: float, limits: JointLimits) -> str:
    """Returns what to tell a person.

    Args:
        faults: What the controller reported, in wire order.
        record: The last cycles, see `cycle_dtype`.
        t: Motion time of the state that carried the faults, [s]; NaN before the first command.
        limits: Bounds of the joints.
    """
    faults = tuple(faults)
    when = "before the first command" if math.isnan(t) else f"at t = {t:.3f} s"
    names = ", ".join(f"{fault.name} ({fault.cause})" for fault in faults)
    parts = [f"the controller stopped the motion {when}: {names}"]
    numbers = _numbers(faults, record, limits)
    if numbers:
        parts.append(numbers)
    if faults:
        parts.append(faults[0].remedy)
    parts.append("recover() clears the fault; .record holds the last cycles")
    return "; ".join(parts)


def _numbers(faults: tuple[Fault, ...], record: NDArray[np.void], limits: JointLimits) -> str:
    """Returns the first command in the record that breaks a condition of one of the faults, or the fastest joint."""
    sent = record[record["sent_ns"] != 0]
    sent = sent[np.isfinite(sent["command"]).all(axis=1)]
    if len(sent) < 4:
        return ""
    q, t = sent["command"], sent["t"]
    monitor = JointMonitor(limits)
    dq = (q[1:3] - q[:2]) / CYCLE_TIME
    monitor.reset(q[2].tolist(), dq[1].tolist(), ((dq[1] - dq[0]) / CYCLE_TIME).tolist())
    for row in range(3, len(q)):
        if set(monitor.step(q[row].tolist())) & set(faults):
            for condition, joint, value, bound in monitor.broken():
                if condition.fault in faults:
                    return (
                        f"joint {joint}: {condition.quantity} {value:.4g} {condition.unit} passes {bound:.4g} "
                        f"{condition.unit} in the command at t = {t[row]:.3f} s"
                    )
    velocity = np.abs(q[-1] - q[-2]) / CYCLE_TIME
    joint = int(velocity.argmax())
    return (
        f"last command at t = {t[-1]:.3f} s, joint {joint + 1} the fastest with {velocity[joint]:.3g} rad/s "
        f"at {math.degrees(q[-1][joint]):.2f} deg"
    )
