"""The quantities of a motion that conditions bound, as tables with one row per controller cycle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rcilab.cell.cell import Cell, has_obstacles
from rcilab.cell.clearance_path import ClearancePath, clearance_path
from rcilab.cell.clearance_query import build_query
from rcilab.conformance.clearance_conditions import clearance_conditions
from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.conformance.start import StartState, as_start
from rcilab.conformance.tool_signals import ToolSignals
from rcilab.core.arrays import Array, JointVector
from rcilab.core.clearance import OBSTACLE, ClearanceLimit, LinkPair
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.safety_box import EntryBox, SafetyBox, box_for_start
from rcilab.core.state import Mode
from rcilab.model.robot_model import RobotModel
from rcilab.motion.motion import Motion

HOLD_SAMPLES = 3
"""Number of checked cycles after the last row, which the controller repeats: the reach of a third difference."""

_SMOOTH_RATE = 0.03
"""Part of the torque rate limits, as inertia times jerk, below which torques change smoothly, at speeds within the
limits. The jerk alone is no measure: with a load of 5 kg, 1 % of its limit takes up to a quarter of the torque rate."""
_TORQUE_TIME = 0.05  # [s]
"""In which the largest torque builds up at the largest rate, for an arm without a bound on the rate; 0.03 to 0.09 s for
the arms with one."""
_SMOOTH_STEP = 16
"""[cycles] Spacing of computed torques where they change smoothly; between them they are interpolated linearly,
accurate to 2 % of the bounds (tests/conformance/test_signals.py)."""


_INTERPOLATED_PART = 0.8
"""Part of a torque bound up to which interpolation is sufficient; rows beyond it are computed."""


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What is known of commands beyond their joint angles."""

    was_stopped: bool = False
    """Whether something other than the client ended the motion."""
    refused_pose: bool = False
    """Whether a pose followed the last row that has no joint angles on this branch."""
    reference: JointVector | None = None
    """Commanded joint angles before the first row, shape (n,), [rad], where the controller absorbed its distance from
    them: it is compared with them but not differentiated. None: the start of the check."""
    has_free_elbow: bool = False
    """Whether the controller left the arm angle free: it has no conditions then, nor poses singular for it alone."""
    is_to_come: bool = False
    """Whether they are not recorded but planned: the controller will hold the last one."""


class MotionSignals:
    """The signals of one motion, each a table with one row per cycle.

    Args:
        motion: The motion.
        model: The arm, with its tool and load.
        start: The state of the arm at the start.
        box: The safety box, or None.
        distance: Required distances of the links from each other and from the floor, or None.
        mode: Mode of the motion. Commanded torques are computed in every row, as the controller checks each.
        torques: Commanded torques, shape (N, n), [N m]; None: those of the motion.
        record: What else is known of the commands; None: a motion to come.
        cell: The cell of the arm, or None.
    """

    def __init__(
        self,
        motion: Motion,
        model: RobotModel,
        start: StartState,
        box: SafetyBox | None,
        distance: ClearanceLimit | None = None,
        mode: Mode = "joint_position",
        torques: Array | None = None,
        record: Record | None = None,
        cell: Cell | None = None,
    ) -> None:
        self._motion = motion
        self._record = record
        self._commanded_torques = torques
        self._model = model
        self._start = start
        self._box = box
        self._distance = distance
        self._cell = cell
        self._mode: Mode = mode
        hold = HOLD_SAMPLES if record is None or record.is_to_come else 0
        self._differences = _backward_differences(motion.q, start, hold)
        self.is_off_start = bool(np.abs(motion.start - start.q).max() > START_POSITION_TOLERANCE)

    def table(self, condition: Condition) -> tuple[Array, float]:
        """Returns the values for a condition, shape (rows, n) or (rows, 1), and the time of the first row, [s]."""
        if condition.stage == "throughout":
            return self._throughout(condition), 0.0
        if condition.stage == "end":
            return self._end_values(condition), self._motion.duration
        if condition.order:
            return self._end_values(condition), 0.0
        return self._at_start(condition)[np.newaxis], 0.0

    def angles_before(self) -> Array:
        """Returns the joint angles one cycle before each row that is checked throughout, shape (rows, n), [rad]."""
        first = self._start.q - CYCLE_TIME * self._start.dq if self._start.moving else self._start.q
        return np.concatenate((first[np.newaxis], self._differences[0][:-1]))

    def links(self, condition: Condition, row: int) -> LinkPair | None:
        """Returns the two links of the distance in a row of a table; None for other conditions."""
        if not condition.is_clearance:
            return None
        first, second = (int(number) for number in self._clearance[condition.signal].links[row])
        cell = self._cell
        name = "" if cell is None or second > OBSTACLE else cell.obstacles[OBSTACLE - second].name
        return LinkPair(first, second, name)

    def _throughout(self, condition: Condition) -> Array:
        if condition.is_clearance:
            return self._clearance[condition.signal].distance[:, np.newaxis]
        if condition.signal == "torque":
            return self._torques[condition.order]
        if condition.signal in ("translation", "rotation", "arm_angle"):
            return self._tool.differences(condition.signal)[condition.order]
        if condition.signal == "frame":
            record = self._record
            # With a free arm angle, a singular pose is one without joint angles: see `Record.refused_pose`.
            is_free = record is not None and record.has_free_elbow
            closeness = np.zeros((len(self._differences[0]), 1)) if is_free else self._tool.singularity
            is_refused = record is not None and record.refused_pose
            return np.concatenate((closeness[: len(self._motion.q)], [[np.inf]])) if is_refused else closeness
        if condition.signal == "elbow_sign":
            return self._tool.elbow_side
        if condition.signal == "position":
            assert self._box is not None
            return self._box_excess(self._box)[:, np.newaxis]
        return self._differences[condition.order]

    def _box_excess(self, box: SafetyBox) -> Array:
        positions = self._model.position_path(self._differences[0])
        entry = box_for_start(box, self._model.forward(self._start.q).parts[1])
        if isinstance(entry, EntryBox):
            return np.array([entry.excess(position) for position in positions.tolist()])
        return box.excess_path(positions)

    @property
    def start_excess(self) -> float:
        """Distance of the tool outside the safety box at the start, [m]; 0 inside, or without a box."""
        if self._box is None:
            return 0.0
        return max(0.0, self._box.excess(self._model.forward(self._start.q).parts[1]))

    def _at_start(self, condition: Condition) -> Array:
        """Returns the difference of the first command from the state of the arm, shape (n,) or (1,)."""
        reference = None if self._record is None else self._record.reference
        start = self._start if reference is None else as_start(reference, self._motion.n)
        if condition.signal in ("translation", "arm_angle"):
            tool = self._tool if start is self._start else ToolSignals(self._model, start, self._motion.q[:1])
            return np.array([tool.start_distance if condition.signal == "translation" else tool.start_turn])
        if condition.signal == "torque":
            return self._torques[0][0]
        return self._motion.start - start.q

    @cached_property
    def _tool(self) -> ToolSignals:
        return ToolSignals(self._model, self._start, self._differences[0])

    @cached_property
    def _clearance(self) -> dict[str, ClearancePath]:
        """The smallest distance between links, from the floor, and from obstacles, by signal."""
        assert self._distance is not None
        query, levers = build_query(self._model, self._distance, self._cell)
        path = self._differences[0]
        queries = {"link_distance": query.links, "floor_distance": query.floor, "cell_distance": query.cell}
        bounds: dict[str, list[float]] = {}
        for row in clearance_conditions(self._distance, has_obstacles=has_obstacles(self._cell)):
            bounds.setdefault(row.signal, []).append(float(row.bounds(self._model.limits)[0][0]))
        return {
            signal: clearance_path(queries[signal], path, self._start.q, levers, minima)
            for signal, minima in bounds.items()
        }

    @cached_property
    def _torques(self) -> tuple[Array, Array]:
        """Torques without gravity and their backward differences over one cycle, each of shape (N + 3, n)."""
        if self._commanded_torques is not None:
            tau = np.concatenate((self._commanded_torques, np.tile(self._commanded_torques[-1], (HOLD_SAMPLES, 1))))
            before = tau[:1] if self._start.moving else np.zeros_like(tau[:1])
            return tau, np.diff(tau, axis=0, prepend=before) / CYCLE_TIME
        q, dq, _, jerk = self._differences
        joint, smooth = self._model.limits.joint, 0.0 if self._mode == "torque" else _SMOOTH_RATE
        poses = q[:: max(len(q) // 2, 1)]  # Start, middle and end; the greatest inertia counts.
        inertia = np.max([np.abs(self._model.rigid_body.mass_matrix(pose)) for pose in poses], axis=0)
        rates = np.where(np.isfinite(joint.torque_rate), joint.torque_rate, joint.torque / _TORQUE_TIME)
        weights = (inertia / rates[:, None]).max(axis=0)  # Of a joint's jerk, in the rate of any joint.
        change = np.einsum("j,jn->n", weights, np.abs(jerk.T))  # Not by BLAS, whose threads take longer to start.
        chosen = _rows_to_compute((change > smooth) | (np.abs(dq) > joint.velocity).any(axis=1))
        tau, rate = self._torques_at(chosen)
        is_near = (np.abs(tau) > _INTERPOLATED_PART * joint.torque) | (
            np.abs(rate) > _INTERPOLATED_PART * joint.torque_rate
        )
        refined = chosen | _with_previous_rows(np.asarray(is_near.any(axis=1), dtype=np.bool_))
        return (tau, rate) if (refined == chosen).all() else self._torques_at(refined)

    def _torques_at(self, chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Returns torques, computed in some rows and interpolated in others, and their differences over one cycle."""
        q, dq, ddq, _ = self._differences
        rows = np.flatnonzero(chosen)
        computed = np.ascontiguousarray(self._model.rigid_body.motion_torques(q[rows], dq[rows], ddq[rows]).T)
        all_rows = np.arange(len(q))
        tau = np.empty(q.T.shape)
        for joint, values in enumerate(computed):
            tau[joint] = np.interp(all_rows, rows, values)
        before = tau[:, :1] if self._start.moving else np.zeros_like(tau[:, :1])
        return tau.T, (np.diff(np.concatenate((before, tau), axis=1)) / CYCLE_TIME).T

    def _end_values(self, condition: Condition) -> Array:
        """Returns velocity or acceleration at an end of the motion, shape (1, n) or (1, 1)."""
        values = self._throughout(condition)
        row = len(self._motion) - 1 if condition.stage == "end" else condition.order
        row = min(row, len(values) - 1)
        return values[row : row + 1]


def _rows_to_compute(is_rough: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Returns the rows to compute: all where torques do not change smoothly, and some in between."""
    chosen = _with_previous_rows(is_rough)
    chosen[::_SMOOTH_STEP] = True
    chosen[-1] = True
    return chosen


def _with_previous_rows(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    found = rows.copy()
    found[:-1] |= rows[1:]
    return found


def _backward_differences(q: Array, start: StartState, hold: int) -> tuple[Array, Array, Array, Array]:
    """Returns angles, velocity, acceleration and jerk in every cycle, with the hold, each of shape (N + hold, n).

    Successive divisions by the cycle time, as in the monitor, give results equal to the last bit. The values of a joint
    are contiguous in memory, which makes operations per joint several times faster.
    """
    commands = (q[1:] if start.moving else q).T
    held = np.repeat(q[-1:].T, hold, axis=1)
    path = np.concatenate((start.q[:, np.newaxis], commands, held), axis=1)
    dq = np.concatenate((start.dq[:, np.newaxis], np.diff(path) / CYCLE_TIME), axis=1)
    ddq = np.concatenate((start.ddq[:, np.newaxis], np.diff(dq) / CYCLE_TIME), axis=1)
    jerk = np.diff(ddq) / CYCLE_TIME
    if start.moving:
        return path.T, dq.T, ddq.T, np.concatenate((np.zeros_like(jerk[:, :1]), jerk), axis=1).T
    return path[:, 1:].T, dq[:, 1:].T, ddq[:, 1:].T, jerk.T
