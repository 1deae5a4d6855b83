"""One sentence for a motion that the controller stopped: which fault, which joint, which number, what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from rcilab.arrays import Array
from rcilab.client.rotation import nine
from rcilab.clock import CYCLE_TIME
from rcilab.conformance import Breach, CartesianMonitor, JointMonitor, TorqueMonitor
from rcilab.faults import RANGE_FAULTS, Fault, name_faults
from rcilab.limits import Limits
from rcilab.safety_box import SafetyBox
from rcilab.spatial import Pose

_BOX_FAULTS = {
    Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION, Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION
}  # fmt: skip
_CLOSE = math.radians(1.0)  # A joint farther inside than this has not come near the limits that we know of.
_HISTORY = 3  # Commands that a third difference looks back to.


def describe_faults(
    faults: Iterable[Fault],
    record: NDArray[np.void],
    t: float,
    limits: Limits,
    *,
    late: str = "",
    pressed: str = "",
    box: SafetyBox | None = None,
) -> str:
    """Returns the message of the error that a motion ends with.

    Args:
        faults: What the controller reported, in wire order.
        record: The last cycles, see `cycle_dtype`.
        t: Motion time of the state that carried the faults, [s]; NaN before the first command.
        limits: Bounds of the arm.
        late: What `CallTimes.describe` returned, for a motion that a slow callback may have ended.
        pressed: Which safety stop ended the motion, in a sentence with what to do; "" for none. The RCI has no error
            bit for it, so that the bits which a controller sets meanwhile say something else.
        box: The safety box that the controller has, as far as it is known.
    """
    faults = tuple(faults)
    when = "before the first command" if math.isnan(t) else f"at t = {t:.3f} s"
    if pressed:
        bits = name_faults(faults)
        return (
            f"the controller stopped the motion {when}: {pressed} (reported as {bits}); .record holds the last cycles"
        )
    names = ", ".join(f"{fault.manual_name} ({fault.cause})" for fault in faults)
    parts = [f"the controller stopped the motion {when}: {names}"]
    parts += [
        said
        for said in (
            _numbers(faults, record, limits),
            *_measured(faults, record, limits),
            _outside(faults, record, box),
        )
        if said
    ]
    if faults:
        is_torque = bool(np.isfinite(record["command_tau"]).any())
        parts.append(late or (faults[0].torque_remedy if is_torque else faults[0].remedy))
    clears = "" if RANGE_FAULTS & set(faults) else "recover() clears the fault; "
    parts.append(f"{clears}.record holds the last cycles")
    return "; ".join(parts)


def _numbers(faults: tuple[Fault, ...], record: NDArray[np.void], limits: Limits) -> str:
    """Returns the first command in the record that breaks a condition of one of the faults, or what the last one was.

    What the controller measured, and the torques it computed, are not judged again here.
    """
    sent = record[record["sent_ns"] != 0]
    if len(sent) == 0:
        return ""
    for field, judge, describe in (
        ("command", _judge_joints, _describe_joints),
        ("command_pose", _judge_poses, _describe_pose),
        ("command_tau", _judge_torques, _describe_torques),
    ):
        rows = sent[np.isfinite(sent[field].reshape(len(sent), -1)).all(axis=1)]
        if len(rows) < _HISTORY + 1:
            continue
        for place, breaches in judge(rows, limits):
            for breach in breaches:
                if breach.condition.fault in faults:
                    return f"{breach.text} in the command at t = {rows['t'][place]:.3f} s"
        return f"last command at t = {rows['t'][-1]:.3f} s, {describe(rows)}"
    return ""


def _measured(faults: tuple[Fault, ...], record: NDArray[np.void], limits: Limits) -> Iterator[str]:
    """Yields what was measured in the last cycles of what the faults name: a joint, its value and its bound."""
    if not len(record):
        return
    joint, q, dq = limits.joint, record["q"], record["dq"]
    if Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION in faults:
        place = np.unravel_index((np.abs(dq) / joint.velocity).argmax(), dq.shape)
        bound = joint.velocity[place[1]]
        yield f"joint {place[1] + 1} was measured at {dq[place]:.3g} rad/s ({bound:g} rad/s are allowed)"
    if RANGE_FAULTS & set(faults):
        is_measured = Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION in faults
        q = q if is_measured else record["q_c"]
        beyond = np.maximum(joint.lower - q, q - joint.upper)
        place = np.unravel_index(beyond.argmax(), q.shape)
        low, high = math.degrees(joint.lower[place[1]]), math.degrees(joint.upper[place[1]])
        angle = math.degrees(q[place])
        was = "measured" if is_measured else "commanded"
        said = f"joint {place[1] + 1} was {was} at {angle:.2f} deg (from {low:.2f} to {high:.2f} deg)"
        inside = "every joint was inside the limits of this model: the controller has narrower ones (set_joint_limit)"
        yield inside if beyond[place] < -_CLOSE else said
    if Fault.COLLISION in faults:
        force = np.linalg.norm(record["tau_ext_in_base"][:, :3], axis=1)
        if np.isfinite(force).any():
            yield f"the force from outside at the tool was estimated at {np.nanmax(force):.3g} N"


def _outside(faults: tuple[Fault, ...], record: NDArray[np.void], box: SafetyBox | None) -> str:
    """Returns which face of the safety box the tool passed, and how far; "" where that is not known."""
    if box is None or not _BOX_FAULTS & set(faults) or not len(record):
        return ""
    measured = record["T_base_tool"][:, :3, 3]
    sent = record["command_pose"][:, :3, 3]
    places = [place for place in (*sent, *measured) if np.isfinite(place).all()]
    if not places:
        return ""
    face, beyond = max((box.passed_face(place) for place in places), key=lambda passed: passed[1])
    return f"the tool came {1e3 * max(beyond, 0.0):.1f} mm past the {face} face of the safety box"


def _judge_joints(rows: NDArray[np.void], limits: Limits) -> Iterator[tuple[int, list[Breach]]]:
    q = rows["command"]
    dq = np.diff(q[:_HISTORY], axis=0) / CYCLE_TIME
    monitor = JointMonitor(limits.joint)
    monitor.reset(q[2].tolist(), dq[1].tolist(), ((dq[1] - dq[0]) / CYCLE_TIME).tolist())
    for place in range(_HISTORY, len(q)):
        monitor.step(q[place].tolist())
        yield place, monitor.broken()


def _judge_poses(rows: NDArray[np.void], limits: Limits) -> Iterator[tuple[int, list[Breach]]]:
    monitor = CartesianMonitor(limits)
    poses = [_pose(T) for T in rows["command_pose"]]
    psi = [angle if math.isfinite(angle) else None for angle in rows["command_psi"].tolist()]
    monitor.reset(poses[0], psi[0])
    for place in range(1, len(poses)):
        monitor.step(poses[place], psi[place])
        if place >= _HISTORY:  # The first differences only fill the monitor's memory.
            yield place, monitor.broken()


def _judge_torques(rows: NDArray[np.void], limits: Limits) -> Iterator[tuple[int, list[Breach]]]:
    monitor = TorqueMonitor(limits.joint)
    monitor.reset(rows["command_tau"][0].tolist())
    for place in range(1, len(rows)):
        monitor.step(rows["command_tau"][place].tolist())
        yield place, monitor.broken()


def _describe_joints(rows: NDArray[np.void]) -> str:
    q = rows["command"]
    velocity = np.abs(q[-1] - q[-2]) / CYCLE_TIME
    joint = int(velocity.argmax())
    return f"joint {joint + 1} the fastest with {velocity[joint]:.3g} rad/s at {math.degrees(q[-1][joint]):.2f} deg"


def _describe_pose(rows: NDArray[np.void]) -> str:
    position = rows["command_pose"][:, :3, 3]
    speed = float(np.linalg.norm(position[-1] - position[-2])) / CYCLE_TIME
    x, y, z = position[-1].tolist()
    return f"tool at {x:.3f}, {y:.3f}, {z:.3f} m with {speed:.3g} m/s"


def _describe_torques(rows: NDArray[np.void]) -> str:
    tau = rows["command_tau"][-1]
    joint = int(np.abs(tau).argmax())
    return f"largest torque {tau[joint]:.3g} N m at joint {joint + 1}"


def _pose(T: Array) -> Pose:
    x, y, z = T[:3, 3].tolist()
    return Pose.from_parts(nine(T[:3, :3]), (x, y, z))
