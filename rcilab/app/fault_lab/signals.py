"""The signal that violated a condition, cycle by cycle, computed from the recorded cycles as in the controller.

A value is in the row of the state that shows it: the command that answers one state is checked in the next cycle. Where
a client missed states, the controller has continued the motion by itself: what follows from the commands before and
after such a gap is not known (NaN).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.common_conditions import ACCELERATION_CUTOFF, condition_table
from rcilab.conformance.tool_signals import rotation_steps
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Bounds, Condition
from rcilab.core.cycle_log import state_cycles
from rcilab.core.errors import UnreachableError
from rcilab.core.fault import FaultCode
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.i18n.translator import Remark
from rcilab.model.kinematics.collision import ClearanceQuery
from rcilab.model.robot_model import RobotModel
from rcilab.sim.momentum_observer import MomentumObserver
from rcilab.sim.plant import Measurement

_BEFORE = 3  # Rows before the first that a third difference uses.
_UNREACHABLE = 2.0  # Value of a pose without joint angles in the plot, where 1 is the bound.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FaultSignal:
    """The quantity that a condition bounds, over the recorded cycles."""

    condition: Condition
    axis: int
    """The joint, from 1; 0 for other quantities."""
    values: Array
    """Shape (N,), in the condition's unit."""
    lower: Array
    """Lower bound in each cycle, shape (N,); -inf without one."""
    upper: Array
    """The same for the upper bound."""

    @property
    def value(self) -> float:
        """The last value: that of the cycle with the fault."""
        return float(self.values[-1])

    @property
    def bound(self) -> float:
        """The bound on the side of the value."""
        lower, upper = float(self.lower[-1]), float(self.upper[-1])
        if not math.isfinite(lower):
            return upper
        return upper if self.value >= 0.5 * (lower + upper) else lower

    @property
    def has_curve(self) -> bool:
        """Whether more than the last value is known."""
        return int(np.isfinite(self.values).sum()) > 1

    @property
    def is_sensed(self) -> bool:
        """Whether it is measured, or estimated from measurements."""
        return self.condition.is_measured or self.condition.signal == "external_torque"

    @property
    def is_broken(self) -> bool:
        """Whether the last value is outside its bounds; False if it is not known."""
        return bool(self.value <= self.lower[-1] or self.value >= self.upper[-1])

    @property
    def excess(self) -> float:
        """Distance of the last value beyond its bound, as a share of the bound."""
        lower, upper = float(self.lower[-1]), float(self.upper[-1])
        width = upper - max(lower, -upper)
        return (abs(self.value - self.bound) if self.is_broken else -math.inf) / max(width, 1e-9)


class Signals:
    """Computes signals of one stream of cycles.

    Args:
        rows: Recorded cycles, see `cycle_dtype`; the last one carries the fault.
        model: The arm.
        limits: The limits of the check.
        box: The safety box.
        lost: Number of consecutive commands that the controller counted as lost.
    """

    def __init__(
        self, rows: NDArray[np.void], model: RobotModel, limits: Limits, box: SafetyBox | None, lost: int
    ) -> None:
        self._rows, self._model, self._limits, self._box, self._lost = rows, model, limits, box, lost
        self._closed_form = model.solver
        self._table = condition_table(model.description)
        self._period = CYCLE_TIME * state_cycles(rows)

    def find(self, fault: FaultCode, reason: str) -> FaultSignal | None:
        """Returns the signal that raised a fault: the one farthest beyond its bound in the last row.

        Args:
            fault: The fault.
            reason: The controller's sentence. Of a measured signal it has the value: the last row may be of a later
                cycle.
        """
        rows = self._table.raising(fault)
        found = [signal for row in rows for signal in self._signals(row) if signal.is_broken]
        signal = max(found, key=lambda signal: signal.excess, default=None)
        facts: Mapping[str, object] = reason.facts if isinstance(reason, Remark) else {}
        if signal is None or not signal.is_sensed or "value" not in facts or facts.get("joint", 0) != signal.axis:
            return signal
        seen = math.copysign(float(facts["value"]), signal.value)  # type: ignore[arg-type]
        return replace(signal, values=np.append(signal.values[:-1], seen))

    def reported(self, fault: FaultCode, reason: str) -> FaultSignal | None:
        """Returns the signal of a fault for which the record has no values: the last one is that of the controller.

        Args:
            fault: The fault.
            reason: The controller's sentence; without numbers there is no signal.
        """
        rows = self._table.raising(fault)
        if not (rows and isinstance(reason, Remark) and {"value", "bound"} <= reason.facts.keys()):
            return None
        facts = reason.facts
        value, bound = float(facts["value"]), float(facts["bound"])  # type: ignore[arg-type]
        count = len(self._rows)
        return FaultSignal(
            condition=rows[0],
            axis=int(facts.get("joint", 0)),  # type: ignore[call-overload]
            values=np.append(np.full(count - 1, np.nan), value),
            lower=np.full(count, -bound if value < 0.0 else -np.inf),
            upper=np.full(count, bound),
        )

    def _signals(self, condition: Condition) -> list[FaultSignal]:
        values = self._values(condition)
        if values is None:
            return []
        lower, upper = self._bounds(condition)
        return [
            FaultSignal(
                condition=condition,
                axis=column + 1 if condition.is_per_joint else 0,
                values=values[:, column],
                lower=lower[:, column],
                upper=upper[:, column],
            )
            for column in range(values.shape[1])
        ]

    def _bounds(self, condition: Condition) -> Bounds:
        """Returns the bounds of a condition in each row, each of shape (N, k)."""
        joint, count = self._limits.joint, len(self._rows)
        if condition.signal == "position" and not condition.is_measured:  # Without the rounding of a check.
            return np.full((count, 1), -math.inf), np.zeros((count, 1))
        if condition.bounds_at is None or not condition.depends_on_angles(joint):
            lower, upper = condition.bounds(self._limits)
            return np.tile(lower, (count, 1)), np.tile(upper, (count, 1))
        q = self._rows["q_c"]
        return condition.bounds_at(joint, np.concatenate((q[:1], q[:-1])))

    def _values(self, condition: Condition) -> Array | None:
        """Returns one column per axis, shape (N, k); None if nothing of the kind was commanded."""
        if condition.is_measured:
            return self._measured(condition)
        if condition.stage == "start":
            return self._distance_from_start(condition)
        match condition.signal:
            case "external_torque":
                return self._external() if np.isfinite(self._rows["tau"]).all() else None
            case "lost_commands":
                last = len(self._rows) - 1
                return np.maximum(self._lost - last + np.arange(last + 1), 0.0)[:, None]
            case "link_distance":
                links = ClearanceQuery(self._model.collision_geometry()).links
                return np.array([[links(q)[0]] for q in self._rows["q"]])
            case "joint":
                commands = self._joint_commands()
                return None if commands is None else self._differences(commands, condition.order)
            case "joint_step":
                commands = self._joint_commands()
                return None if commands is None else np.diff(commands, axis=0)[_BEFORE - 1 :]
            case "torque":
                torques = self._sent("command_tau", np.zeros(self._model.n))
                return None if torques is None else self._differences(torques, condition.order)
            case _:
                return self._commanded_tool(condition)

    def _commanded_tool(self, condition: Condition) -> Array | None:
        joints = self._sent("command", self._rows["q_c"][0])
        poses = self._sent("command_pose", self._model.forward(self._rows["q_c"][0]).matrix)
        if condition.signal == "position" and self._box is not None:
            path = self._model.forward_path(joints) if joints is not None else poses
            return None if path is None else self._box.excess_path(path[_BEFORE:, :3, 3])[:, None]
        if joints is not None and condition.signal == "translation" and condition in self._table.motion:
            return self._speed_of_joints(joints)
        if poses is None:
            return None
        if condition.signal == "frame":
            return self._singularity(poses)
        if condition.signal == "arm_angle":
            psi = self._sent("command_psi", self._psi(self._rows["q_c"][:1])[0])
            return None if psi is None else self._differences(np.unwrap(psi)[:, None], condition.order)
        if condition.signal not in ("translation", "rotation") or condition.order == 0:
            return None
        is_turn = condition.signal == "rotation"
        steps = rotation_steps(poses[:, :3, :3]) if is_turn else np.diff(poses[:, :3, 3], axis=0)
        rates = np.diff(steps, condition.order - 1, axis=0) / self._period**condition.order
        speeds = np.linalg.norm(rates, axis=1)[_BEFORE - condition.order :, None]
        return self._without_gaps(speeds, condition.order)

    def _speed_of_joints(self, joints: Array) -> Array:
        """Returns the speed of the tool from one commanded row of angles to the next, (N, 1), [m/s].

        A client that misses a state sends its next target later.
        """
        steps = np.linalg.norm(np.diff(self._model.position_path(joints), axis=0), axis=1)[_BEFORE - 1 :]
        passed = np.diff(self._rows["message_id"].astype(np.int64))[:-1] * CYCLE_TIME
        return (steps / np.concatenate((np.full(2, self._period), passed)))[:, None]

    def _joint_commands(self) -> Array | None:
        """Returns the joint angles of commands, also those that follow from poses; with rows as `_sent`."""
        sent = self._sent("command", self._rows["q_c"][0])
        poses = self._sent("command_pose", self._model.forward(self._rows["q_c"][0]).matrix)
        if sent is not None or poses is None or self._model.redundancy.kind != "joint":
            return sent
        q = self._rows["q_c"][0]
        psi, found = self._psi(q[np.newaxis])[0], [q] * (_BEFORE + 1)
        for pose in poses[_BEFORE + 1 :]:
            try:
                q = self._model.inverse(pose, psi, q).nearest(q)
            except UnreachableError:  # The last one may be beyond the range of a joint.
                q = 2.0 * found[-1] - found[-2]
            found.append(q)
        return np.array(found)

    def _distance_from_start(self, condition: Condition) -> Array | None:
        """Returns the difference of each command from the arm at the start."""
        if condition.order:
            return None
        match condition.signal:
            case "joint":
                name, start = "command", self._rows["q_c"][0]
            case "translation":
                name, start = "command_pose", self._model.forward(self._rows["q_c"][0]).matrix
            case "arm_angle":
                name, start = "command_psi", self._psi(self._rows["q_c"][:1])[0]
            case _:
                return None
        sent = self._sent(name, start)
        if sent is None:
            return None
        away = sent[_BEFORE:] - start
        return (
            np.linalg.norm(away[:, :3, 3], axis=1)[:, None] if name == "command_pose" else away.reshape(len(away), -1)
        )

    def _measured(self, condition: Condition) -> Array | None:
        q, dq = self._rows["q"], self._rows["dq"]
        match condition.signal, condition.order:
            case "joint", 0:
                return q
            case "joint", 1:
                return dq
            case "joint", _:
                return _low_passed(dq, self._period)
            case "position", _:
                place = self._model.forward_path(q)[:, :3, 3]
                return None if self._box is None else self._box.excess_path(place)[:, None]
            case "arm_angle", _:
                return np.diff(np.unwrap(self._psi(q)), prepend=self._psi(q[:1])[0])[:, None] / self._period
            case signal, order:
                half = slice(0, 3) if signal == "translation" else slice(3, 6)
                twist = np.array([self._model.jacobian(a) @ b for a, b in zip(q, dq, strict=True)])
                rates = twist if order == 1 else _low_passed(twist, self._period)
                return np.linalg.norm(rates[:, half], axis=1)[:, None]

    def _external(self) -> Array:
        """Returns external joint torques, as the controller estimates them."""
        observer = MomentumObserver(self._model)
        before = self._rows[0]
        estimate = observer.step(Measurement(before["q"], before["dq"], before["tau"]))[0]
        found: list[Array] = [estimate]
        for row in self._rows[1:]:
            cycles = max(1, int(row["message_id"]) - int(before["message_id"]))
            for cycle in range(1, cycles + 1):  # Those between two states are interpolated.
                share = cycle / cycles
                measured = (before[name] + share * (row[name] - before[name]) for name in ("q", "dq", "tau"))
                estimate = observer.step(Measurement(*measured))[0]
            found.append(estimate)
            before = row
        return np.array(found)

    def _singularity(self, poses: Array) -> Array:
        """Returns the distance from a singularity; a pose that has no solution is beyond the bound."""
        near = self._closed_form.singularity_path(self._rows["q_c"])
        near[-1] = max(2.0 * near[-2] - near[-3], _UNREACHABLE)
        return near[:, None]

    def _psi(self, q: Array) -> Array:
        return self._closed_form.redundancy_angle_path(q)

    def _differences(self, values: Array, order: int) -> Array:
        rates = np.diff(values, order, axis=0)[_BEFORE - order :] / self._period**order
        return self._without_gaps(rates, order)

    def _without_gaps(self, rates: Array, order: int) -> Array:
        """Returns differences of commands, with NaN in the rows of those between which states were missed."""
        numbers = self._rows["message_id"].astype(np.int64)
        is_gap = np.diff(numbers) * CYCLE_TIME > 1.5 * self._period  # Before the command of each row but the first.
        unknown = np.zeros(len(rates), dtype=bool)
        for age in range(1, order + 1):
            unknown[1 + age :] |= is_gap[: len(rates) - 1 - age]
        return np.where(unknown[:, None], np.nan, rates)

    def _sent(self, name: str, before: Array | float) -> Array | None:
        """Returns the checked values of each row, with `_BEFORE` rows of standstill in front; None: none were sent."""
        sent = self._rows[name][:-1]
        if not len(sent) or not np.isfinite(sent.reshape(len(sent), -1)).all():
            return None
        return np.concatenate((np.repeat(np.asarray(before)[None], _BEFORE + 1, axis=0), sent))


def _low_passed(rates: Array, period: float) -> Array:
    steps, found = np.diff(rates, axis=0, prepend=rates[:1]) / period, np.zeros_like(rates)
    share = period / (period + 1.0 / (2.0 * math.pi * ACCELERATION_CUTOFF))
    for row in range(1, len(rates)):
        found[row] = found[row - 1] + share * (steps[row] - found[row - 1])
    return found
