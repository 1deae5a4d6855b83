"""The diagnosis of a motion that the controller stopped: fault, joint, numbers, remedy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.arrays import Array, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import name_faults
from rcilab.core.limits import Limits
from rcilab.core.rotation import as_rotation9
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode
from rcilab.i18n.translator import Remark
from rcilab.makers.driver import FaultReport
from rcilab.makers.rokae.conditions import RCI_JOINT_CONDITIONS, RCI_TOOL_CONDITIONS, RCI_TORQUE_CONDITIONS
from rcilab.makers.rokae.driver.measured_report import YIELDING_MODES, describe_measured, describe_passed_face
from rcilab.makers.rokae.faults import BOX_FAULTS, RANGE_FAULTS, Fault

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_HELD = "error.run holds the motion"
_OF_JOINTS = (
    "poses inside the tool's limits are not enough: the joints that they lead to have limits of their own "
    "(check(motion, model, mode='cartesian_position') computes them); move the tool more slowly or with less "
    "acceleration there, and stay away from singular poses"
)
_INVERTED = 100  # Number of last poses whose joint angles are computed: more than there are on the wire.
_FOLLOWED = 10  # Cycles before the fault in which the joint nearest to a bound is searched.
_HISTORY = 3  # Commands before a command that its third difference uses.


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
    commanded, is_violated = _describe_commanded(faults, record, limits)
    measured = describe_measured(faults, record, model, limits, mode, collision_thresholds)
    followed = _describe_followed(faults, record, model, limits)
    passed = describe_passed_face(faults, record, box)
    found = [part for part in (commanded, followed, *measured, passed) if part]
    parts += found
    if faults:
        parts.append(late or (_OF_JOINTS if followed else _remedy(faults[0], mode, is_violated=is_violated)))
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


def _describe_followed(faults: tuple[Fault, ...], record: NDArray[np.void], model: RobotModel, limits: Limits) -> str:
    """Returns the joint that violates a condition of the faults, if joints follow from poses; "" for other faults.

    The angles that violate it are in no state: they are computed from the sent poses, as the controller does. If its
    own filter or play-out made other angles of them, the joint nearest to the bound in the states is returned.
    """
    rows = record[(record["sent_ns"] != 0) & np.isfinite(record["command_pose"]).all(axis=(1, 2))][-_INVERTED:]
    if not len(rows):
        return ""
    q = _follow_poses(rows, model)
    begins = rows["t"][0] <= 0.0
    if begins:  # Before the first command the arm stood still.
        q = np.concatenate((np.repeat(rows["q_c"][:1], _HISTORY, axis=0), q))
    for row, violations in _judge_joints(q, rows["command_psi"], limits):
        for violation in violations:
            if violation.condition.fault in faults:
                remark = violation.remark
                t = float(rows["t"][row - _HISTORY * begins])
                sentence = f"{remark} in the joint angles that follow from the pose at t = {t:.3f} s"
                return Remark(sentence, remark.code, **remark.facts)
    return _describe_nearest(faults, record["q_c"][-_FOLLOWED:], limits)


def _follow_poses(rows: NDArray[np.void], model: RobotModel) -> Array:
    """Returns the joint angles of consecutive poses in base, [rad], shape (N, n).

    Ends before the first pose without a solution.
    """
    T_tool_flange = model.T_flange_tool.inverse()
    near: list[float] = rows["q_c"][0].tolist()
    psi = model.arm_angle(near) if model.redundancy else 0.0
    found: list[list[float]] = []
    for T, angle in zip(rows["command_pose"], rows["command_psi"].tolist(), strict=True):
        psi = angle if math.isfinite(angle) else psi
        q = model.solver.solve_near(_pose(T) @ T_tool_flange, psi, near)
        if q is None:
            break
        found.append(q)
        near = q
    return np.array(found).reshape(-1, model.n)


def _describe_nearest(faults: tuple[Fault, ...], q: Array, limits: Limits) -> str:
    """Returns the joint nearest to a bound of the faults in the states before the fault; "" for other faults."""
    joint = limits.joint
    for order, (fault, bounds, name, unit) in enumerate(
        (
            (Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, joint.velocity, "velocity", "rad/s"),
            (Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION, joint.acceleration, "acceleration", "rad/s^2"),
            (Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY, joint.jerk, "jerk", "rad/s^3"),
        ),
        1,
    ):
        if fault in faults and len(q) > order:
            values = np.diff(q, order, axis=0) / CYCLE_TIME**order
            index = np.unravel_index((np.abs(values) / bounds).argmax(), values.shape)
            joint, value, bound = int(index[1]) + 1, float(values[index]), float(bounds[index[1]])
            return Remark(
                f"of the joints that follow from the poses joint {joint} came nearest, with a commanded {name} of "
                f"{value:.4g} {unit} before the pose that broke its bound ({bound:g} {unit})",
                "nearest",
                condition=f"joint.{name}",
                joint=joint,
                value=value,
                bound=bound,
                unit=unit,
            )
    return ""


def _describe_commanded(faults: tuple[Fault, ...], record: NDArray[np.void], limits: Limits) -> tuple[str, bool]:
    """Returns the first command in the record that violates a condition, and whether one does; else the last command.

    The controller's measurements and computed torques are not checked here. A condition of one of the faults is
    searched; a violation of another one only counts for the second result.
    """
    sent = record[record["sent_ns"] != 0]
    is_violated = False
    if not len(sent):
        return "", is_violated
    for field, find, describe in (
        ("command", _judge_joints, _describe_joints),
        ("command_pose", _judge_poses, _describe_pose),
        ("command_tau", _judge_torques, _describe_torques),
    ):
        rows = sent[np.isfinite(sent[field].reshape(len(sent), -1)).all(axis=1)]
        if not len(rows):
            continue
        values = rows[field]
        if rows["t"][0] <= 0.0:  # The first command of the motion: before it the arm stood still.
            stood = {"command": rows["q_c"][0], "command_pose": values[0], "command_tau": np.zeros_like(values[0])}
            values = np.concatenate((np.repeat(stood[field][np.newaxis], _HISTORY, axis=0), values))
        first = len(values) - len(rows)
        for row, violations in find(values, np.pad(rows["command_psi"], (first, 0), "edge"), limits):
            is_violated = is_violated or bool(violations)
            for violation in violations:
                if violation.condition.fault in faults:
                    remark = violation.remark
                    sentence = f"{remark} in the command at t = {rows['t'][row - first]:.3f} s"
                    return Remark(sentence, remark.code, **remark.facts), True
        return f"last command at t = {rows['t'][-1]:.3f} s, {describe(values)}", is_violated
    return "", is_violated


def _judge_joints(q: Array, psi: Array, limits: Limits) -> Iterator[tuple[int, list[LimitViolation]]]:
    if len(q) <= _HISTORY:
        return
    dq = np.diff(q[:_HISTORY], axis=0) / CYCLE_TIME
    monitor = JointMonitor(limits.joint, RCI_JOINT_CONDITIONS)
    monitor.reset(q[2].tolist(), dq[1].tolist(), ((dq[1] - dq[0]) / CYCLE_TIME).tolist())
    for row in range(_HISTORY, len(q)):
        monitor.step(q[row].tolist())
        yield row, monitor.violations()


def _judge_poses(T: Array, psi: Array, limits: Limits) -> Iterator[tuple[int, list[LimitViolation]]]:
    monitor = CartesianMonitor(limits, rows=RCI_TOOL_CONDITIONS)
    poses = [_pose(matrix) for matrix in T]
    angles = [angle if math.isfinite(angle) else None for angle in psi.tolist()]
    monitor.reset(poses[0], angles[0])
    for row in range(1, len(poses)):
        monitor.step(poses[row], angles[row])
        if row >= _HISTORY:  # The first differences only fill the monitor's memory.
            yield row, monitor.violations()


def _judge_torques(tau: Array, psi: Array, limits: Limits) -> Iterator[tuple[int, list[LimitViolation]]]:
    monitor = TorqueMonitor(limits.joint, RCI_TORQUE_CONDITIONS)
    monitor.reset(tau[0].tolist())
    for row in range(1, len(tau)):
        monitor.step(tau[row].tolist())
        yield row, monitor.violations()


def _describe_joints(q: Array) -> str:
    velocity = np.abs(np.diff(q[-2:], axis=0)).sum(axis=0) / CYCLE_TIME
    joint = int(velocity.argmax())
    return f"joint {joint + 1} the fastest with {velocity[joint]:.3g} rad/s at {math.degrees(q[-1][joint]):.2f} deg"


def _describe_pose(T: Array) -> str:
    speed = float(np.linalg.norm(np.diff(T[-2:, :3, 3], axis=0))) / CYCLE_TIME
    x, y, z = T[-1, :3, 3].tolist()
    return f"tool at {x:.3f}, {y:.3f}, {z:.3f} m with {speed:.3g} m/s"


def _describe_torques(tau: Array) -> str:
    joint = int(np.abs(tau[-1]).argmax())
    return f"largest torque {tau[-1][joint]:.3g} N m at joint {joint + 1}"


def _pose(T: Array) -> Pose:
    x, y, z = T[:3, 3].tolist()
    return Pose.from_parts(as_rotation9(T[:3, :3]), (x, y, z))
