"""What a client commanded in a recorded run, as a motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import state_cycles
from rcilab.core.errors import UsageError
from rcilab.core.state import COMPLIANT_MODES
from rcilab.motion.differences import derivatives_from_differences
from rcilab.motion.motion import Motion
from rcilab.motion.stop import plan_stop
from rcilab.recording.playout import checked_joints, played_commands

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel
    from rcilab.recording.run import Run

_FADE_TIME = 0.5  # [s] From full speed to standstill within the limits of every arm and its tool.
_STILL, _STEADY = 1e-4, 1e-2  # [rad/s], [rad/s^2] As the tolerance of a check at the end of a motion.


def sent_motion(run: Run) -> Motion:
    """Returns the motion that a client commanded, on the grid of the controller's cycles.

    It has the joint angles as they were sent; if poses of the tool were sent, the joint angles that the controller
    reports as commanded. A command that did not arrive is interpolated; `.notes` counts them: what the arm did in a
    pause of the client is not the client's. Where a virtual controller recorded which commands it played, it has these
    at the times when they were played, up to one that was refused.

    Raises:
        UsageError: Nothing was commanded, or torques were: see `sent_torques`.
    """
    rows = run.cycles
    is_played = run.has_playout
    if np.isfinite(rows["command_pose"]).any():
        return Motion.from_cycles(checked_joints(rows)) if is_played else run.commanded()
    period = 1 if is_played else state_cycles(rows)
    index, q = _played_angles(rows) if is_played else _sent_angles(rows, period)
    if not len(q):
        what = "torques were sent, which have no path" if np.isfinite(rows["command_tau"]).any() else "nothing was sent"
        raise UsageError(f"in this run {what}: only joint angles and poses of the tool can be checked")
    motion = Motion.from_cycles(_fill_gaps(index, q), period)
    lost = int(index[-1]) + 1 - len(index)
    return replace(motion, notes=(f"{lost} commands did not arrive and are interpolated",)) if lost else motion


def _sent_angles(cycles: NDArray[np.void], period: int) -> tuple[NDArray[np.intp], JointPath]:
    """Returns the sent joint angles, with their numbers on the grid of the states, from 0."""
    sent = cycles[np.isfinite(cycles["command"]).all(axis=1)]
    if not len(sent):
        return np.zeros(0, np.intp), sent["command"]
    index = np.rint((sent["t"] - sent["t"][0]) / (period * CYCLE_TIME)).astype(np.intp)
    index, first = np.unique(index, return_index=True)
    return index, sent["command"][first]


def _played_angles(cycles: NDArray[np.void]) -> tuple[NDArray[np.intp], JointPath]:
    """Returns the played joint angles, up to refused ones, with the numbers of their cycles, from 0."""
    rows, sources = played_commands(cycles)
    q = cycles["command"][sources]
    is_checked = np.isfinite(q).all(axis=1)
    faulty = np.flatnonzero(cycles["faults"])
    if faulty.size:
        is_checked &= rows <= faulty[0]
    rows, q = rows[is_checked], q[is_checked]
    return rows - rows[0] if rows.size else rows, q


def sent_torques(run: Run) -> tuple[Motion, Array]:
    """Returns the motion of the arm under the torques that a client commanded, and these torques, shape (N, n), [N m].

    It has the joint angles that the controller reports as commanded, which are the measured ones under torques. A
    command that did not arrive is interpolated, so that its change counts over the cycles in which it was held.

    Raises:
        UsageError: No torques were commanded.
    """
    rows = run.cycles
    sent = rows[np.isfinite(rows["command_tau"]).all(axis=1)]
    if not len(sent):
        raise UsageError("in this run no torques were sent")
    grid = sent["t"][0] + CYCLE_TIME * np.arange(round((sent["t"][-1] - sent["t"][0]) / CYCLE_TIME) + 1)
    q = np.stack([np.interp(grid, rows["t"], column) for column in rows["q_c"].T], axis=1)
    return Motion.from_cycles(q), np.stack(
        [np.interp(grid, sent["t"], column) for column in sent["command_tau"].T], axis=1
    )


def start_of(run: Run) -> JointVector | None:
    """Returns the commanded joint angles before the first command, shape (n,), [rad]; None where they do not bind it.

    A compliant arm stands off its last command, and a controller absorbs the offset of the next first one.
    """
    return None if run.truncated or run.setup.mode in COMPLIANT_MODES else run.q_c[0]


def with_stop(motion: Motion, model: RobotModel, mode: str) -> Motion:
    """Returns a motion whose last row still moves, continued by a stop; one that ends at standstill as it is.

    A check holds the arm at the last row. A client whose motion ended early did not command the jump of such an end,
    and a controller stops the arm smoothly after the last command of a program that ends moving a little. Joints stop
    as fast as their limits allow; where poses are commanded, on a course that the limits of the tool allow, too.

    Raises:
        PlanningError: The last rows are farther apart than any robot's.
    """
    q = motion.q
    if len(q) < 3:
        return motion
    dq, ddq = (q[-1] - q[-2]) / CYCLE_TIME, (q[-1] - 2.0 * q[-2] + q[-3]) / CYCLE_TIME**2
    if np.abs(dq).max() <= _STILL and np.abs(ddq).max() <= _STEADY:
        return motion
    if mode.startswith("cartesian"):
        stop = q[-1] + _fade_out(dq, ddq)
    else:
        stop = plan_stop(model.limits.joint, q[-1], *derivatives_from_differences(dq, ddq)).q[1:]
    return replace(Motion.from_cycles(np.concatenate((q, stop))), notes=motion.notes)


def _fade_out(dq: Array, ddq: Array) -> JointPath:
    """Returns the displacement in every cycle until standstill; velocity and acceleration vanish smoothly."""
    s = CYCLE_TIME * np.arange(1, round(_FADE_TIME / CYCLE_TIME) + 1)[:, np.newaxis]
    u = s / _FADE_TIME
    velocity = dq * (1.0 - 3.0 * u**2 + 2.0 * u**3) + ddq * s * (1.0 - u) ** 3
    return CYCLE_TIME * np.cumsum(velocity, axis=0)


def _fill_gaps(index: NDArray[np.intp], q: JointPath) -> JointPath:
    """Returns one row for every cycle; in a gap, those of the cubic through the two rows before and after it.

    Args:
        index: Number of the cycle of each row, ascending, shape (N,).
        q: The rows, shape (N, n), [rad].
    """
    full = np.empty((int(index[-1]) + 1, q.shape[1]))
    full[index] = q
    for last in np.flatnonzero(np.diff(index) > 1).tolist():
        around = slice(max(last - 1, 0), last + 3)
        missing = np.arange(index[last] + 1, index[last + 1])
        full[missing] = _lagrange_weights(missing, index[around]) @ q[around]
    return full


def _lagrange_weights(x: Array | NDArray[np.intp], nodes: NDArray[np.intp]) -> Array:
    """Returns the weight of each node in the polynomial through all of them at x, shape (len(x), len(nodes))."""
    weights = np.ones((len(x), len(nodes)))
    for column, node in enumerate(nodes):
        for other in np.delete(nodes, column):
            weights[:, column] *= (x - other) / (node - other)
    return weights
