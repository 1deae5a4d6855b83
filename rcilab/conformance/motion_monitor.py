"""Check of one cycle in any mode, for any arm: combines the per-cycle monitors by the arm's own table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell, required_distance
from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.clearance_monitor import ClearanceMonitor
from rcilab.conformance.common_conditions import (
    MOTION_TORQUE_CONDITIONS,
    TOOL_CONDITIONS,
    TORQUE_CONDITIONS,
    condition_table,
)
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.measured_monitor import MeasuredMonitor
from rcilab.conformance.pose_validation import find_frame_error
from rcilab.conformance.standstill_monitor import StandstillMonitor
from rcilab.conformance.start import StartState, as_start
from rcilab.conformance.tool_signals import commands_before
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.arrays import Array, JointVector, as_vector, described
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.core.safety_box import SafetyBox, active_box, box_for_start
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.core.state import Mode, require_mode
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.bounds import RECOVERY_RANGE, range_from
from rcilab.motion.ik_tracker import IkTracker


class Monitor:
    """Checks one command per cycle by the rows that `check` uses for a whole motion, in the same mode.

    Owned by the thread that runs the cycle. The rows are those of the table of the arm's maker. Standstill at both ends
    of a motion is checked with the first commands and with the last one, which has `finished` set.

    Args:
        model: The arm with its tool and load.
        mode: Mode of the commands, as in `control`.
        box: The safety box; None, or an inactive box, is not checked.
        distance: Required distances of the links from each other and from the floor; None is not checked.

    Raises:
        InvalidValueError: The model is not a RobotModel, or the mode is unknown.
    """

    def __init__(
        self,
        model: RobotModel,
        mode: Mode = "joint_position",
        *,
        box: SafetyBox | None = None,
        distance: ClearanceLimit | None = None,
        cell: Cell | None = None,
    ) -> None:
        self._model, self.mode = require_model(model), require_mode(mode)
        distance = required_distance(distance, cell)
        self._has_elbow = bool(model.redundancy)
        table, self._safety_box = condition_table(model.description), active_box(box)
        self._tracker = IkTracker(model) if self._has_elbow and table.has_free_elbow else None
        limits = model.limits
        self._own_rows = {row.id: row for row in table.conditions}
        rows = table.rows(self.mode, has_elbow=self._has_elbow)
        self._start_rows = [row for row in rows if row.stage == "start" and row.order == 0]
        self._clearance = None if distance is None else ClearanceMonitor(model, distance, cell)
        self._torques = None
        order = TORQUE_CONDITIONS if self.mode == "torque" else reversed(MOTION_TORQUE_CONDITIONS)
        torques = TorqueMonitor(limits.joint, _in_order(rows, order))
        if self.mode == "torque":
            self._torques = torques
        else:
            self._joint_rows, self._motion_torques = _throughout(rows, "joint"), torques
            self._standstill = StandstillMonitor(
                limits, [row for row in rows if row.stage != "throughout" and row.order > 0]
            )
        self._is_cartesian = self.mode.startswith("cartesian")
        if self._is_cartesian:
            self._tool_rows = _in_order((table.box, *table.cartesian), TOOL_CONDITIONS)
        else:
            self._speed_row = next((row for row in _throughout(rows, "translation") if row.order == 1), None)
        self._box_row = table.box
        self._pose_rows = {row.signal: row for row in rows if row.signal in ("frame", "elbow_sign")}
        self._inverse = model.solver
        self._T_tool_flange = model.T_flange_tool.inverse()
        self._has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)
        self.reset(model.home)

    def reset(self, start: ArrayLike | StartState) -> None:
        """Restarts the history at a state.

        Args:
            start: Commanded joint angles of a stationary arm, shape (n,), [rad]; a StartState for a moving one.

        Raises:
            InvalidValueError: It is not a valid state of this arm.
            SingularError: In a Cartesian mode, the arm angle has no meaning there.
        """
        model = self._model
        state = as_start(start, model.n)
        self._start, self._is_first = state, not state.moving
        self._q = state.q.tolist()
        self._position = model.forward(state.q).parts[1]
        self._build_monitors(state.q)
        self._measured.reset(state.q.tolist())
        tau = model.rigid_body.motion_torque(state.q, state.dq, state.ddq).tolist() if state.moving else [0.0] * model.n
        if self._joints is not None:
            self._joints.reset(state.q.tolist(), state.dq.tolist(), state.ddq.tolist())
            self._motion_torques.reset(tau)
            self._standstill.reset(state.moving)
        if self._torques is not None:
            self._torques.reset(tau)
        if self._clearance is not None:
            self._clearance.reset(state.q)
        if self._tool is not None:
            poses = [(model.forward(q), self._arm_angle(q)) for q in commands_before(state)]
            self._tool.reset(*poses[0])
            for pose, psi in poses[1:]:
                self._tool.step(pose, psi)
            self._start_pose, self._psi = poses[-1]
            self._start_psi = self._psi
        if "elbow_sign" in self._pose_rows:
            self._start_side = model.elbow(state.q)[1]

    def _build_monitors(self, q: JointVector) -> None:
        """Builds the monitors for a motion from `q`; from outside a range or the box, the motion inwards is allowed."""
        joint = range_from(self._model.limits.joint, q, RECOVERY_RANGE)
        limits = replace(self._model.limits, joint=joint)
        position = self._model.forward(q).parts[1]
        self._measured = MeasuredMonitor(limits, box_for_start(self._safety_box, position))
        box = box_for_start(self._safety_box, position)
        self._joints = None if self.mode == "torque" else JointMonitor(joint, self._joint_rows)
        self._tool = CartesianMonitor(limits, box, self._tool_rows) if self._is_cartesian else None
        self._box = BoxMonitor(None if self._is_cartesian or self.mode == "torque" else box, self._box_row)

    def step(self, command: Command, cycles: int = 1, side: int | None = None) -> tuple[LimitViolation, ...]:
        """Checks the command of this cycle and returns its violations, also of recommended rows.

        NaN violates every condition on it. After a violation of a necessary condition a controller stops; here the
        history advances, and the caller must `reset`. A pose without joint angles does not change the joints.

        Args:
            command: Command of the mode; without an arm angle the last one is used, or the joints move as little as
                possible, as the arm's controller does it.
            cycles: Cycles since the last command, 1 or more.
            side: Side of the elbow, +1 or -1 as by `model.elbow`, for interfaces that command it with every pose; None
                is the last one.

        Raises:
            InvalidValueError: The command does not belong to the mode, or is for another number of joints.
        """
        if self._torques is not None:
            found = self._step_torques(self._torques, command, cycles)
        elif self._tool is not None:
            found = self._step_pose(self._tool, command, cycles, side)
        else:
            found = self._step_joints(command, cycles)
        self._is_first = False
        return tuple(found)

    def observe(self, q: Sequence[float] | Array, dq: Sequence[float] | Array) -> tuple[LimitViolation, ...]:
        """Checks the measured values of this cycle and returns their violations.

        Args:
            q: Joint angles, shape (n,), [rad].
            dq: Joint velocities, shape (n,), [rad/s].

        Raises:
            InvalidValueError: Not n finite numbers each.
        """
        model = self._model
        angles, speeds = as_vector(q, model.n, "q", "rad"), as_vector(dq, model.n, "dq", "rad/s")
        twist = model.velocity(angles, speeds).tolist() if self._is_cartesian else None
        psi = self._arm_angle(angles) if self._is_cartesian else None
        self._measured.step(angles.tolist(), speeds.tolist(), model.forward(angles).parts[1], twist, psi)
        found = self._with_own_rows(self._measured.violations())
        if self._torques is not None:
            found += self._check_clearance(angles)
        return tuple(found)

    def _step_torques(self, monitor: TorqueMonitor, command: Command, cycles: int) -> list[LimitViolation]:
        tau = self._numbers(command.tau if isinstance(command, JointTorque) else None, "tau", command)
        monitor.step(tau, cycles)
        return self._check_start({"torque": tau}) + self._with_own_rows(monitor.violations())

    def _step_joints(self, command: Command, cycles: int) -> list[LimitViolation]:
        q = self._numbers(command.q if isinstance(command, JointPosition) else None, "q", command)
        offset = [new - old for new, old in zip(q, self._start.q.tolist(), strict=True)]
        found = self._check_start({"joint": offset}) + self._check_joints(q, cycles) + self._check_speed(q, cycles)
        return found + self._standstill.step(self._last_difference, cycles, is_last=command.finished)

    def _step_pose(
        self, monitor: CartesianMonitor, command: Command, cycles: int, side: int | None
    ) -> list[LimitViolation]:
        if not isinstance(command, CartesianPosition):
            raise self._kind_error(command)
        numbers = np.asarray(command.T_base_tool, dtype=np.float64).ravel().tolist()
        if len(numbers) != 16 or find_frame_error(numbers) is not None:
            return [self._pose_violation(math.inf)]
        pose = Pose.from_row_major(numbers)
        tracker = self._tracker if command.psi is None else None
        if self._has_elbow and command.psi is not None:
            self._psi = float(command.psi)
        monitor.step(pose, self._psi if tracker is None else None, cycles)
        distance = math.dist(pose.parts[1], self._start_pose.parts[1])
        turn = 0.0 if self._psi is None or tracker is not None else self._psi - (self._start_psi or 0.0)
        found = self._check_start({"translation": [distance], "arm_angle": [math.remainder(turn, math.tau)]})
        found += self._with_own_rows(monitor.violations())
        q = self._solve(pose, side) if tracker is None else _follow(tracker, pose, self._q)
        if q is None:
            return [*found, self._pose_violation(math.inf)]
        self._q = q
        if tracker is not None:
            self._psi = self._arm_angle(np.array(q))
        elif self._inverse.is_singular(q):
            found.append(self._pose_violation(float(self._inverse.singularity_path(np.array([q]))[0])))
        found += self._check_elbow(q) + self._check_joints(q, cycles)
        return found + self._standstill.step(self._last_difference, cycles, is_last=command.finished)

    def _solve(self, pose: Pose, side: int | None) -> list[float] | None:
        flange = pose @ self._T_tool_flange if self._has_tool else pose
        return self._inverse.solve_near(flange, self._psi or 0.0, self._joints_on_side(side))

    def _check_joints(self, q: list[float], cycles: int) -> list[LimitViolation]:
        assert self._joints is not None
        self._joints.step(q, cycles)
        found = self._joints.violations()
        if not math.isfinite(sum(q)):
            return found
        state = self._joints
        self._motion_torques.step(
            self._model.rigid_body.motion_torque(*map(np.array, (q, state.dq, state.ddq))).tolist(), cycles
        )
        found += self._with_own_rows(self._motion_torques.violations())
        if self._box.is_active:
            self._box.step(self._model.forward(q).parts[1])
            found += self._box.violations()
        return found + self._check_clearance(q)

    def _check_speed(self, q: list[float], cycles: int) -> list[LimitViolation]:
        """Returns the violation of the bound on the tool's velocity in joint motions, where there is one."""
        row = self._speed_row
        if row is None or not math.isfinite(sum(q)):
            return []
        before, self._position = self._position, self._model.forward(q).parts[1]
        speed, bound = (
            math.dist(before, self._position) / (cycles * CYCLE_TIME),
            float(row.bounds(self._model.limits)[1][0]),
        )
        return [] if speed < bound else [LimitViolation(row, 0, speed, bound)]

    def _last_difference(self, row: Condition) -> Sequence[float]:
        """Returns the last velocities or accelerations for a row, of the joints or as a norm of the tool."""
        if row.is_per_joint:
            assert self._joints is not None
            return self._joints.dq if row.order == 1 else self._joints.ddq
        assert self._tool is not None
        tool_difference = self._tool.twist if row.order == 1 else self._tool.acceleration
        return [math.hypot(*(tool_difference[:3] if row.signal == "translation" else tool_difference[3:]))]

    def _joints_on_side(self, side: int | None) -> list[float]:
        """Returns the last joint angles, mirrored at the elbow's flip if `side` is the other side."""
        flip = self._model.description.elbow_flip
        if flip is None or side is None or self._model.elbow(self._q)[1] == side:
            return self._q
        return [*self._q[:3], 2.0 * flip - self._q[3], *self._q[4:]]

    def _check_elbow(self, q: list[float]) -> list[LimitViolation]:
        row = self._pose_rows.get("elbow_sign")
        if row is None or self._model.elbow(q)[1] == self._start_side:
            return []
        return [LimitViolation(row, 0, -1.0, 0.0)]

    def _check_start(self, values: dict[str, list[float]]) -> list[LimitViolation]:
        """Returns the violations of the first command from standstill that is not at the arm's position."""
        if not self._is_first:
            return []
        found: list[LimitViolation] = []
        for row in self._start_rows:
            lower, upper = (bound.tolist() for bound in row.bounds(self._model.limits))
            for axis, (value, low, high) in enumerate(zip(values[row.signal], lower, upper, strict=True), 1):
                if not low < value < high:
                    found.append(
                        LimitViolation(row, axis if row.is_per_joint else 0, value, low if value <= low else high)
                    )
        return found

    def _check_clearance(self, q: Sequence[float] | Array) -> list[LimitViolation]:
        if self._clearance is None:
            return []
        self._clearance.step(q)
        return self._clearance.violations()

    def _with_own_rows(self, violations: list[LimitViolation]) -> list[LimitViolation]:
        """Returns violations of common rows with the rows of the arm's table, without those that it does not have."""
        own = self._own_rows
        return [
            violation._replace(condition=own[row.id])
            for violation in violations
            if (row := violation.condition).id in own
        ]

    def _pose_violation(self, closeness: float) -> LimitViolation:
        return LimitViolation(self._pose_rows["frame"], 0, closeness, 1.0)

    def _arm_angle(self, q: Array) -> float | None:
        return self._model.arm_angle(q) if self._has_elbow else None

    def _numbers(self, values: Array | None, name: str, command: Command) -> list[float]:
        if values is None:
            raise self._kind_error(command)
        numbers = np.asarray(values, dtype=np.float64).ravel().tolist()
        if len(numbers) != self._model.n:
            raise InvalidValueError(name, values, f"must be {self._model.n} numbers")
        return numbers

    def _kind_error(self, command: object) -> InvalidValueError:
        kind = "JointTorque" if self._torques is not None else "CartesianPosition" if self._tool else "JointPosition"
        return InvalidValueError("command", described(command), f"must be a {kind} in the mode {self.mode}")


def _follow(tracker: IkTracker, pose: Pose, near: list[float]) -> list[float] | None:
    """Returns the joint angles of a pose without an arm angle; None if it is out of reach or singular."""
    try:
        return tracker.follow(pose, near)
    except KinematicsError:
        return None


def _in_order(rows: Iterable[Condition], order: Iterable[Condition]) -> list[Condition]:
    """Returns common rows in their order, those of the arm's table on the same quantity in place of them.

    A table may have its own name for a row, such as a maker's for the elbow.
    """
    own = {(row.signal, row.order): row for row in rows if row.stage == "throughout" and not row.is_measured}
    return [own.get((row.signal, row.order), row) for row in order]


def _throughout(rows: Sequence[Condition], *signals: str) -> list[Condition]:
    return [row for row in rows if row.stage == "throughout" and row.signal in signals and not row.is_measured]
