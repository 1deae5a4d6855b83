"""The command or the resulting joint motion that made a controller stop a motion, from its last cycles.

Neither is in the fault: a controller reports which condition was violated. The sent commands are checked again by the
maker's conditions, as the controller does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition, ConditionTable, Signal
from rcilab.core.fault import FaultCode
from rcilab.core.limits import Limits
from rcilab.core.rotation import as_rotation9
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Remark

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_INVERTED = 100  # Number of last poses whose joint angles are computed: more than there are on the wire.
_FOLLOWED = 10  # Cycles before the fault in which the joint nearest to a bound is searched.
_LATE = 0.02  # [s] Without a command: a few periods of any interface.
_LAST = 20  # Commands before the fault between which a pause is searched.
_HISTORY = 3  # Commands before a command that its third difference uses.
_RATES = {1: ("velocity", "rad/s"), 2: ("acceleration", "rad/s^2"), 3: ("jerk", "rad/s^3")}


class CommandConditions(NamedTuple):
    """A maker's conditions on commands in every cycle."""

    joint: tuple[Condition, ...]
    """On commanded joint angles."""
    inverse: tuple[Condition, ...]
    """On the joint angles that follow from commanded poses."""
    tool: tuple[Condition, ...]
    """On commanded poses."""
    torque: tuple[Condition, ...]
    """On commanded torques."""

    @classmethod
    def of(cls, table: ConditionTable) -> CommandConditions:
        """Returns those of a table."""
        return cls(
            joint=_throughout(table.motion, "joint"),
            inverse=_throughout(table.cartesian, "joint"),
            tool=(table.box, *_throughout(table.cartesian, "arm_angle", "translation", "rotation")),
            torque=tuple(sorted(_throughout(table.torque, "torque"), key=lambda row: -row.order)),
        )


def find_followed(
    faults: Sequence[FaultCode],
    record: NDArray[np.void],
    model: RobotModel,
    limits: Limits,
    conditions: CommandConditions,
) -> str:
    """Returns the joint that violates a condition of the faults, if joints follow from poses; "" for other faults.

    The angles that violate it are in no state: they are computed from the sent poses, as the controller does. If its
    own filter or play-out made other angles of them, the joint nearest to the bound in the states is returned.

    Args:
        faults: The reported faults.
        record: The last cycles, see `cycle_dtype`.
        model: The arm with its tool.
        limits: Its bounds.
        conditions: Those of the maker.
    """
    rows = record[(record["sent_ns"] != 0) & np.isfinite(record["command_pose"]).all(axis=(1, 2))][-_INVERTED:]
    if not len(rows):
        return ""
    q = _follow_poses(rows, model)
    begins = rows["t"][0] <= 0.0
    if begins:  # Before the first command the arm stood still.
        q = np.concatenate((np.repeat(rows["q_c"][:1], _HISTORY, axis=0), q))
    for row, violations in _check_joints(q, limits, conditions.inverse):
        for violation in violations:
            if violation.condition.fault in faults:
                remark = violation.remark
                t = float(rows["t"][row - _HISTORY * begins])
                sentence = f"{remark} in the joint angles that follow from the pose at t = {t:.3f} s"
                return Remark(sentence, remark.code, **remark.facts)
    return _describe_nearest(faults, record["q_c"][-_FOLLOWED:], limits, conditions.inverse)


def find_commanded(
    faults: Sequence[FaultCode], record: NDArray[np.void], limits: Limits, conditions: CommandConditions
) -> tuple[str, bool]:
    """Returns the first command in the record that violates a condition, and whether one does; else the last command.

    The controller's measurements and computed torques are not checked here. A condition of one of the faults is
    searched; a violation of another one only counts for the second result.

    Args:
        faults: The reported faults.
        record: The last cycles, see `cycle_dtype`.
        limits: The bounds of the arm.
        conditions: Those of the maker.
    """
    sent = record[record["sent_ns"] != 0]
    is_violated = False
    if not len(sent):
        return "", is_violated
    for field, describe in (
        ("command", _describe_joints),
        ("command_pose", _describe_pose),
        ("command_tau", _describe_torques),
    ):
        rows = sent[np.isfinite(sent[field].reshape(len(sent), -1)).all(axis=1)]
        if not len(rows):
            continue
        values = rows[field]
        if rows["t"][0] <= 0.0:  # The first command of the motion: before it the arm stood still.
            stood = {"command": rows["q_c"][0], "command_pose": values[0], "command_tau": np.zeros_like(values[0])}
            values = np.concatenate((np.repeat(stood[field][np.newaxis], _HISTORY, axis=0), values))
        first = len(values) - len(rows)
        psi = np.pad(rows["command_psi"], (first, 0), "edge")
        for row, violations in _check(field, values, psi, limits, conditions):
            is_violated = is_violated or bool(violations)
            for violation in violations:
                if violation.condition.fault in faults:
                    remark = violation.remark
                    sentence = f"{remark} in the command at t = {rows['t'][row - first]:.3f} s"
                    return Remark(sentence, remark.code, **remark.facts), True
        return f"last command at t = {rows['t'][-1]:.3f} s, {describe(values)}", is_violated
    return "", is_violated


def find_lost_commands(record: NDArray[np.void]) -> str:
    """Returns which share of the last commands did not arrive in time; "" if all did."""
    rate = float(record["success_rate"][-1]) if len(record) else 1.0
    if rate >= 1.0:
        return ""
    share = f"{100.0 * (1.0 - rate):.2g}"
    return Remark(f"{share} % of the last second's commands did not arrive in time", "late_commands", share=share)


def find_pause(record: NDArray[np.void]) -> str:
    """Returns that no command was sent for some time shortly before the end, and for how long; "" if there were all."""
    sent = record["sent_ns"][record["sent_ns"] > 0][-_LAST:]
    gap = 1e-9 * float(np.diff(sent).max()) if len(sent) > 1 else 0.0
    if gap < _LATE:
        return ""
    time = f"{1e3 * gap:.0f}"
    sentence = f"shortly before, no command was sent for {time} ms: a callback took long, or the machine was busy"
    return Remark(sentence, "client_paused", time=time)


def _throughout(rows: Sequence[Condition], *signals: Signal) -> tuple[Condition, ...]:
    return tuple(row for row in rows if row.signal in signals and row.stage == "throughout" and not row.is_measured)


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


def _describe_nearest(faults: Sequence[FaultCode], q: Array, limits: Limits, rows: Sequence[Condition]) -> str:
    """Returns the joint nearest to a bound of the faults in the states before the fault; "" for other faults."""
    for row in rows:
        if row.fault not in faults or row.order not in _RATES or len(q) <= row.order:
            continue
        name, unit = _RATES[row.order]
        bounds = row.bounds(limits)[1]
        values = np.diff(q, row.order, axis=0) / CYCLE_TIME**row.order
        index = np.unravel_index((np.abs(values) / bounds).argmax(), values.shape)
        joint, value, bound = int(index[1]) + 1, float(values[index]), float(bounds[index[1]])
        return Remark(
            f"of the joints that follow from the poses joint {joint} came nearest, with a commanded {name} of "
            f"{value:.4g} {unit} before the pose that broke its bound ({bound:g} {unit})",
            "nearest",
            condition=row.id,
            joint=joint,
            value=value,
            bound=bound,
            unit=unit,
        )
    return ""


def _check(
    field: str, values: Array, psi: Array, limits: Limits, conditions: CommandConditions
) -> Iterator[tuple[int, list[LimitViolation]]]:
    if field == "command":
        return _check_joints(values, limits, conditions.joint)
    if field == "command_pose":
        return _check_poses(values, psi, limits, conditions.tool)
    return _check_torques(values, limits, conditions.torque)


def _check_joints(q: Array, limits: Limits, rows: Sequence[Condition]) -> Iterator[tuple[int, list[LimitViolation]]]:
    if len(q) <= _HISTORY:
        return
    dq = np.diff(q[:_HISTORY], axis=0) / CYCLE_TIME
    monitor = JointMonitor(limits.joint, rows)
    monitor.reset(q[2].tolist(), dq[1].tolist(), ((dq[1] - dq[0]) / CYCLE_TIME).tolist())
    for row in range(_HISTORY, len(q)):
        monitor.step(q[row].tolist())
        yield row, monitor.violations()


def _check_poses(
    T: Array, psi: Array, limits: Limits, rows: Sequence[Condition]
) -> Iterator[tuple[int, list[LimitViolation]]]:
    monitor = CartesianMonitor(limits, rows=rows)
    poses = [_pose(matrix) for matrix in T]
    angles = [angle if math.isfinite(angle) else None for angle in psi.tolist()]
    monitor.reset(poses[0], angles[0])
    for row in range(1, len(poses)):
        monitor.step(poses[row], angles[row])
        if row >= _HISTORY:  # The first differences only fill the monitor's memory.
            yield row, monitor.violations()


def _check_torques(tau: Array, limits: Limits, rows: Sequence[Condition]) -> Iterator[tuple[int, list[LimitViolation]]]:
    monitor = TorqueMonitor(limits.joint, rows)
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
