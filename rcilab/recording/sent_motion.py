"""What a client commanded in a recorded run, as a motion, and its check."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.cell.cell import Cell
from rcilab.conformance.advice import with_degrees
from rcilab.conformance.check import check_commands, check_torques
from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE, condition_table
from rcilab.conformance.pose_validation import find_frame_error
from rcilab.conformance.refusal import with_refusal
from rcilab.conformance.signals import Record
from rcilab.conformance.standstill import resolution
from rcilab.conformance.start import StartState
from rcilab.core.arrays import Array, JointPath, JointVector, as_vector
from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import RATE_FIELDS, state_cycles
from rcilab.core.errors import PlanningError, UsageError
from rcilab.core.state import COMPLIANT_MODES, MODES, Mode, require_mode
from rcilab.model.robot_model import require_model
from rcilab.motion.differences import derivatives_from_differences
from rcilab.motion.inverse_path import free_inverse_path, inverse_path
from rcilab.motion.motion import Motion
from rcilab.motion.stop import plan_stop
from rcilab.recording.playout import played_commands, played_span
from rcilab.recording.refused_command import angles_of_refused, explain_stop

if TYPE_CHECKING:
    from rcilab.conformance.report import Report
    from rcilab.core.condition import Signal
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel
    from rcilab.recording.run import Run

_STILL, _STEADY = 1e-4, 1e-2  # [rad/s], [rad/s^2] As the tolerance of a check at the end of a motion.
_FADE_TIME = 0.5  # [s] From full speed to standstill within the limits of every arm and its tool.
_FADE_SHARE = 0.2  # Of the limits of the joints, for a shorter one.
_LARGEST = 1e100  # [rad], [N m] Of commands: their differences remain finite.
_LONGEST_GAP = 256  # Between two numbers of a client that counts on; no controller bridges more.
_TOOL_FIELDS, _JOINT_FIELDS = ("command_pose", "command_twist"), ("command", "command_dq", "command_goal")
_FARTHEST = 1e6  # [m] Of commanded positions; out of any arm's reach.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SentCommands:
    """The commands of a client, in its order."""

    motion: Motion
    """Joint angles as sent, or of the poses that were sent; a command that did not arrive is interpolated."""
    was_refused: bool = False
    """Whether a pose follows that has no joint angles: it is not one, out of reach or singular."""
    not_finite: int = 0
    """The joint, from 1, for which a number follows that is not finite; 0: none."""


def sent_motion(run: Run) -> Motion:
    """Returns the motion that a client commanded: its commands in its own order, one a cycle.

    It has the joint angles as they were sent, or those of the poses that were sent, on the branch on which the arm
    stood; where the controller leaves the arm angle free and none was sent, with the least motion of the joints.
    Velocities and goals are not angles: for them it has the joint angles to which the controller integrated or
    planned them. What the arm did in a pause of the client is not the client's: a command that came late counts at its
    place, and one that did not arrive is interpolated; `.notes` counts these. Where a virtual controller recorded which
    commands it played, it begins with the first one played and ends with the last, or with one that was refused.

    Raises:
        UsageError: Nothing was commanded, or torques were: see `sent_torques`.
    """
    return read_sent(run).motion


def read_sent(run: Run) -> SentCommands:
    """Returns what a client commanded, see `sent_motion`, and whether its last command was a pose without angles."""
    cycles = run.cycles
    is_played = run.has_playout
    if is_played and _has_rates(cycles):
        return _followed(run)
    of_poses = recorded_mode(run).startswith("cartesian") or not np.isnan(cycles["command_pose"]).all()
    numbers = cycles["command_pose"].reshape(-1, 16) if of_poses else cycles["command"]
    sent = np.asarray(~np.isnan(numbers).all(axis=1), dtype=np.bool_)
    if is_played and run.setup.mode != "torque":
        _, sources = played_commands(cycles)
        sent[sources[cycles["sent_ns"][sources] != 0]] = True  # Also of those that are not numbers.
    period = 1 if is_played else state_cycles(cycles)
    index, rows = _played_order(cycles, sent) if is_played else _answered_order(cycles, sent, period)
    if not len(rows):
        has_torques = np.isfinite(cycles["command_tau"]).any()
        what = "torques were sent, which have no path" if has_torques else "nothing was sent"
        raise _empty(run, f"in this run {what}: only joint angles and poses of the tool can be checked")
    q, not_finite = (_angles_of_poses(run, rows), 0) if of_poses else _up_to_finite(cycles["command"][rows])
    was_refused = not not_finite and len(q) < len(rows)
    if not len(q):
        motion = Motion.from_cycles(cycles["q_c"][:1])
        return SentCommands(motion=motion, was_refused=was_refused, not_finite=not_finite)
    index = _without_pauses(index[: len(q)], q) if is_played else index[: len(q)]
    motion = Motion.from_cycles(_fill_gaps(index, q), period)
    lost = int(index[-1]) + 1 - len(index)
    motion = replace(motion, notes=_note_missing(lost))
    return SentCommands(motion=motion, was_refused=was_refused, not_finite=not_finite)


def check_sent(
    run: Run,
    model: RobotModel | None = None,
    *,
    box: SafetyBox | None = None,
    distance: ClearanceLimit | None = STANDARD_DISTANCE,
    mode: Mode | None = None,
    cell: Cell | None = None,
) -> Report:
    """Returns the check of what a client commanded in a run, up to its last command, or one that was refused.

    Args:
        run: The run.
        model: The arm; None: that of the run, with the soft limits that were in force.
        box: The safety box; None: that of the run.
        distance: Required distances of the links; None does not check them.
        mode: The mode; None: that of the run.
        cell: The cell of the arm; None without one.

    Raises:
        InvalidValueError: The run does not name its arm, or an argument is not valid for it.
        UsageError: Nothing was commanded.
    """
    model = with_soft_limits(require_model(run.model), run) if model is None else require_model(model)
    box = run.setup.safety_box if box is None else box
    report = _check(run, model, box, distance, mode, cell)
    if not (run.has_playout and run.faults and report.ok):
        return report
    parallel = _check_parallel_motion(run, model, box, distance, cell)
    return explain_stop(report, run, model) if parallel is None or parallel.ok else parallel


def _check_parallel_motion(
    run: Run, model: RobotModel, box: SafetyBox | None, distance: ClearanceLimit | None, cell: Cell | None
) -> Report | None:
    """Returns the check of the motion that a client commanded along with torques; None without one."""
    fields = (*_TOOL_FIELDS, *_JOINT_FIELDS)
    if recorded_mode(run) != "torque" or not any(bool(np.isfinite(run.cycles[name]).any()) for name in fields):
        return None
    return _check(replace(run, setup=replace(run.setup, mode="joint_position")), model, box, distance, None, cell)


def _check(
    run: Run,
    model: RobotModel,
    box: SafetyBox | None,
    distance: ClearanceLimit | None,
    mode: Mode | None,
    cell: Cell | None,
) -> Report:
    recorded = recorded_mode(run)
    if recorded == "torque":
        motion, torques, not_finite = _read_torques(run)
        motion, start = _in_progress(motion) if run.truncated else (_with_duration(motion, run), None)
        report = check_torques(
            motion, torques[-len(motion) :], model, start=start, box=box, distance=distance, cell=cell
        )
        return _with_broken(report, model, "torque", not_finite)
    sent = read_sent(run)
    motion = sent.motion
    record = Record(
        was_stopped=bool(run.stopped or run.faults or not run.is_complete),
        refused_pose=sent.was_refused,
        has_free_elbow=_has_free_elbow(run, model),
    )

    def check_from(
        motion: Motion, record: Record, start: JointVector | StartState | None, note: tuple[str, ...] = ()
    ) -> Report:
        motion = replace(motion, notes=(*motion.notes, *note))
        given = mode or recorded
        report = check_commands(motion, model, record, start=start, box=box, distance=distance, cell=cell, mode=given)
        names = run.cycles.dtype.names or ()
        order = int("command_dq" in names and np.isfinite(run.cycles["command_dq"]).any())  # Velocities, or positions.
        return _with_broken(report, model, "joint", sent.not_finite, order)

    if run.truncated:
        motion, state = _in_progress(motion)
        return check_from(motion, record, state)
    motion = motion if sent.not_finite else _with_duration(motion, run)
    is_compliant = recorded in COMPLIANT_MODES
    if not run.has_playout:
        return check_from(motion, record, None if is_compliant else run.q_c[0])
    if _is_first_refused(run):
        return check_from(motion, record, run.q_c[0])
    is_step = _is_step(run, motion, model)
    as_step = check_from(motion, record, run.q_c[0]) if is_step and not is_compliant else None
    if as_step is not None and as_step.ok:
        return as_step
    absorbed = replace(record, reference=None if is_compliant else run.q_c[0])
    as_start = check_from(motion, absorbed, None, () if is_compliant and is_step else _note_offset(run, motion))
    return as_start if as_step is None or _count_violations(as_start) < _count_violations(as_step) else as_step


def with_soft_limits(model: RobotModel, run: Run) -> RobotModel:
    """Returns an arm with the soft limits that were in force in a run; as it is where the run does not name any."""
    limits = run.setup.joint_limits
    own = (model if run.model is None else run.model).limits.joint
    if limits is None or limits.shape[1] != model.n or np.array_equal(limits, (own.lower, own.upper)):
        return model
    return model.with_joint_limits(*limits)


def recorded_mode(run: Run) -> Mode:
    """Returns the mode of a run; joint_position where it does not name one.

    It is Cartesian where the tool was commanded: a maker may combine such commands with each of its control laws.
    """
    mode = require_mode(run.setup.mode) if run.setup.mode in MODES else "joint_position"
    if mode == "torque" or not run.has_playout:
        return mode
    of_tool, of_joints = (
        any(bool(np.isfinite(run.cycles[name]).any()) for name in names) for names in (_TOOL_FIELDS, _JOINT_FIELDS)
    )
    if of_tool == of_joints:
        return mode
    if mode in COMPLIANT_MODES:
        return "cartesian_impedance" if of_tool else "joint_impedance"
    return "cartesian_position" if of_tool else "joint_position"


def sent_torques(run: Run) -> tuple[Motion, Array]:
    """Returns the motion of the arm under the torques that a client commanded, and these torques, shape (N, n), [N m].

    It ends with the last torque, a refused one included, or with the state for which the controller stopped it, until
    which that is held; torques that came after it are not played. It has the measured joint angles. A command that did
    not arrive is interpolated, so that its change counts over the cycles in which it was held; `.notes` counts these.

    Raises:
        UsageError: No torques were commanded.
    """
    motion, torques, _ = _read_torques(run)
    return motion, torques


def _read_torques(run: Run) -> tuple[Motion, Array, int]:
    """Returns what `sent_torques` does, up to the first torque that is not finite, and the joint of that, or 0."""
    rows = run.cycles
    is_sent = np.isfinite(rows["command_tau"]).all(axis=1)
    faulty = np.flatnonzero(rows["faults"])[:1]
    if run.has_playout:
        is_sent |= (rows["sent_ns"] != 0) & (run.setup.mode == "torque")  # Also of those that are not numbers.
        played, sources = played_commands(rows)
        if sources.size:
            last = max(faulty[0], played[0]) if faulty.size else played[-1]
            is_sent[sources[played <= last].max() + 1 :] = False
    sent = rows[is_sent]
    if not len(sent):
        raise _empty(run, "in this run no torques were sent")
    tau, not_finite = _up_to_finite(sent["command_tau"])
    if not len(tau):
        return Motion.from_cycles(sent["q"][:1]), np.zeros((1, sent["q"].shape[1])), not_finite
    sent = sent[: len(tau)]
    last = max(sent["t"][-1:].tolist() + ([] if not_finite else rows["t"][faulty].tolist()))
    grid = sent["t"][0] + CYCLE_TIME * np.arange(round((last - sent["t"][0]) / CYCLE_TIME) + 1)
    q = np.stack([np.interp(grid, rows["t"], column) for column in rows["q"].T], axis=1)
    lost = round((sent["t"][-1] - sent["t"][0]) / CYCLE_TIME) + 1 - len(sent) if run.has_playout else 0
    motion = replace(Motion.from_cycles(q), notes=_note_missing(lost))
    return motion, np.stack([np.interp(grid, sent["t"], column) for column in tau.T], axis=1), not_finite


def _empty(run: Run, otherwise: str) -> UsageError:
    """Returns the error for a run without commands."""
    is_lost = not (len(run.cycles) or run.is_complete)
    return UsageError(f"there are no cycles in this run: {run.missing_end}" if is_lost else otherwise)


def _with_broken(report: Report, model: RobotModel, signal: Signal, joint: int, order: int = 0) -> Report:
    """Returns a report with the violation of a command after the others that is not finite; as it is for joint 0.

    Args:
        report: The report on the commands before.
        model: The arm.
        signal: That was commanded,
        joint: for this joint, from 1; 0 for none,
        order: as this derivative.
    """
    if not joint:
        return report
    rows = [row.condition for row in report.rows if row.condition.signal == signal and row.fault is not None]
    condition = min((row for row in rows if row.order >= order), key=lambda row: row.order)
    return with_refusal(report, condition, model.limits, report.motion.duration + CYCLE_TIME, joint=joint)


def _has_free_elbow(run: Run, model: RobotModel) -> bool:
    """Returns whether the arm angle was free in the whole run: not held by the controller, nor commanded."""
    return condition_table(model.description).has_free_elbow and not np.isfinite(run.cycles["command_psi"]).any()


def _is_first_refused(run: Run) -> bool:
    """Returns whether the controller refused the first command: otherwise it may have absorbed its offset."""
    first = np.flatnonzero(run.cycles["played"])[:1]
    return bool(run.cycles["faults"][first].any())


def _count_violations(report: Report) -> int:
    return sum(violation.count for violation in report.violations)


def _is_step(run: Run, motion: Motion, model: RobotModel) -> bool:
    """Returns whether the first command is within one cycle's jerk of the arm."""
    step = resolution("joint", 0, model.limits) + START_POSITION_TOLERANCE
    return bool((np.abs(motion.start - run.q_c[0]) <= step).all())


def _note_offset(run: Run, motion: Motion) -> tuple[str, ...]:
    """Returns a note on the distance of the start of a motion from the arm, if there is one."""
    off = np.abs(motion.start - run.q_c[0])
    joint = int(off.argmax())
    if not off[joint]:
        return ()
    note = (
        f"the first command is {with_degrees(float(off[joint]), f'{off[joint]:.3g}')} of joint {joint + 1} from the "
        "arm's commanded position; the virtual controller accepted and absorbed this, so it is not differentiated"
    )
    return (note,)


def _note_missing(count: int) -> tuple[str, ...]:
    """Returns a note on the number of interpolated commands."""
    if not count:
        return ()
    if count == 1:
        return ("1 command is missing in the record and interpolated: it never came, or came too late",)
    return (f"{count} commands are missing in the record and interpolated: they never came, or came too late",)


def _with_duration(motion: Motion, run: Run) -> Motion:
    """Returns a motion with a note where the controller took another time to play its commands, which have angles."""
    if run.has_playout and _has_rates(run.cycles):
        return motion
    span = played_span(run.cycles) if run.has_playout else motion.duration
    if abs(motion.duration - span) < CYCLE_TIME / 2.0:
        return motion
    note = f"the commands last {motion.duration:.3f} s, one a cycle; the controller played them in {span:.3f} s"
    return replace(motion, notes=(*motion.notes, note))


def _in_progress(motion: Motion) -> tuple[Motion, StartState | None]:
    """Returns a motion whose beginning is missing from its third row on, and the state of the arm there."""
    q = motion.q
    if len(q) < 4:
        return motion, None
    start = StartState(q=q[2], dq=(q[2] - q[1]) / CYCLE_TIME, ddq=(q[2] - 2.0 * q[1] + q[0]) / CYCLE_TIME**2)
    return replace(Motion.from_cycles(q[2:]), notes=motion.notes), start


def with_stop(motion: Motion, model: RobotModel, mode: str) -> Motion:
    """Returns a motion whose last row still moves, continued by a stop; one at standstill as it is.

    Joints stop as fast as their limits allow; where poses are commanded, smoothly, on a course that the limits of the
    tool allow, too. A motion that ends in a jump, from which no stop leads, is returned as it is.
    """
    q = motion.q
    if len(q) < 3:
        return motion
    dq, ddq = (q[-1] - q[-2]) / CYCLE_TIME, (q[-1] - 2.0 * q[-2] + q[-3]) / CYCLE_TIME**2
    if np.abs(dq).max() <= _STILL and np.abs(ddq).max() <= _STEADY:
        return motion
    if mode.startswith("cartesian"):
        stop = q[-1] + _fade_out(dq, ddq, _fade_time(dq, ddq, model))
    else:
        try:
            stop = plan_stop(model.limits.joint, q[-1], *derivatives_from_differences(dq, ddq)).q[1:]
        except PlanningError:
            return motion
    return replace(Motion.from_cycles(np.concatenate((q, stop))), notes=motion.notes)


def _has_rates(cycles: NDArray[np.void]) -> bool:
    """Returns whether velocities or goals were commanded."""
    return any(bool(np.isfinite(cycles[name]).any()) for name in RATE_FIELDS)


def _followed(run: Run) -> SentCommands:
    """Returns the joint angles that the controller commanded, up to the last played command, one it refused included.

    After the last goal, it has them up to the end of the motion.
    """
    cycles = run.cycles
    played, faulty = np.flatnonzero(cycles["played"]), np.flatnonzero(cycles["faults"])
    first, end = (int(played[0]), int(played[-1]) + 1) if played.size else (0, 1)
    if np.isfinite(cycles["command_goal"]).any():
        end = len(cycles)
    if faulty.size:
        end = min(end, max(int(faulty[0]), first + 1))
    q = cycles["q_c"][max(first - 1, 0) : end]
    refused = angles_of_refused(run, q[-1])
    q, not_finite = _up_to_finite(q if refused is None else np.concatenate((q, refused[np.newaxis])))
    return SentCommands(motion=Motion.from_cycles(q), not_finite=not_finite)


def _answered_order(
    cycles: NDArray[np.void], sent: NDArray[np.bool_], period: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Returns the numbers of sent commands on the grid of the states, from 0, and their rows."""
    rows = np.flatnonzero(sent)
    t = cycles["t"][rows]
    index, first = np.unique(np.rint((t - t[:1]) / (period * CYCLE_TIME)).astype(np.intp), return_index=True)
    return index, rows[first]


def _played_order(cycles: NDArray[np.void], sent: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Returns the numbers of the commands up to a refused one, from 0, one a cycle, and their rows.

    They are in the order in which they were played; those that came too late for it are at their place. Between two of
    them, a number is missing for each cycle in which the controller had none to play and which none answers, and for
    each command that is not in the record; where the client counts on its own, as many as its numbers leave out.
    """
    played, sources = played_commands(cycles)
    faulty = np.flatnonzero(cycles["faults"])
    is_counted = sent[sources] & (played <= (faulty[0] if faulty.size else len(cycles)))
    played, sources = played[is_counted], sources[is_counted]
    if not sources.size:
        return sources, sources
    newest = np.maximum.accumulate(sources)
    is_late = sent.copy()
    is_late[sources], is_late[: sources[0]], is_late[newest[-1] :] = False, False, False
    late = np.flatnonzero(is_late)
    numbers = cycles["command_number"].astype(np.int64)
    # Of a client that counts on its own: its rows are only near those of the states that it answers.
    is_own = (numbers > 0) & (np.abs(numbers - cycles["message_id"].astype(np.int64)) > _LONGEST_GAP)
    place = np.searchsorted(newest, late) - 1  # Behind which of the played ones.
    for k in np.flatnonzero(is_own[late]):
        place[k] = _place_of(int(numbers[late[k]]), numbers[sources], int(place[k]))
    is_between = (place >= 0) & (place < len(played) - 1)
    late, place = late[is_between], place[is_between]
    turn = np.concatenate((np.arange(len(played)), place))
    rows = np.concatenate((sources, late))
    rank = np.where(is_own, numbers, np.arange(len(cycles)))[late]
    order = np.lexsort((np.concatenate((np.full(len(played), -1), rank)), turn))
    rows, turn = rows[order], turn[order]
    count = np.bincount(place, minlength=len(played))[:-1]
    missed = (np.diff(np.cumsum(cycles["missed"] != 0)[played]) - count)[turn[:-1]]
    unknown = np.diff(np.cumsum(cycles["played"] != 0)[played]) - 1
    absent = np.where(count > 0, np.maximum(np.diff(cycles["late"][played].astype(np.int64)) - count, 0), 0)
    unknown, absent = (np.where(np.diff(turn) > 0, values[turn[:-1]], 0) for values in (unknown, absent))
    unanswered = np.maximum(np.diff(np.cumsum(~sent)[rows]), 0)
    ahead = np.diff(numbers[rows])
    steps = 1 + np.where(
        is_own[rows[:-1]] & is_own[rows[1:]] & (ahead > 0) & (ahead <= _LONGEST_GAP),
        np.clip(missed + unknown, 0, ahead - 1),
        np.clip(missed, 0, unanswered) + unknown + absent,
    )
    return np.concatenate(([0], np.cumsum(steps))).astype(np.intp), rows


def _place_of(number: int, played: NDArray[np.int64], place: int) -> int:
    """Returns behind which of the played numbers another one belongs, at or near a place."""
    while place >= 0 and 0 < played[place] - number <= _LONGEST_GAP:
        place -= 1
    while place + 1 < len(played) and 0 < number - played[place + 1] <= _LONGEST_GAP:
        place += 1
    return place


def _without_pauses(index: NDArray[np.intp], q: JointPath) -> NDArray[np.intp]:
    """Returns the numbers of commands without the gaps after which a client goes on from where it paused.

    Only the values show it: its velocities before and after a gap lead over one cycle or over all. Gaps that follow
    each other at once are one, over as many commands.
    """
    steps = np.diff(index)
    edges = np.diff(np.pad((steps > 1).astype(np.int8), 1))
    for first, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        if first == 0 or end == len(steps):
            continue
        distance, velocity = q[end] - q[first], (q[first] - q[first - 1] + q[end + 1] - q[end]) / 2.0
        lengths = (end - first, steps[first:end].sum())  # [cycles] Without and with the pauses.
        kept, whole = (np.abs(distance - cycles * velocity).sum() for cycles in lengths)
        if kept < whole:
            steps[first:end] = 1
    return np.concatenate((index[:1], index[0] + np.cumsum(steps)))


def _up_to_finite(rows: Array) -> tuple[Array, int]:
    """Returns the rows before the first one that is not finite, and the joint with the first such number, or 0."""
    is_bad = ~np.isfinite(rows)
    broken = np.flatnonzero(is_bad.any(axis=1))[:1]
    good = np.clip(rows[: broken[0]] if broken.size else rows, -_LARGEST, _LARGEST)
    return good, int(is_bad[broken[0]].argmax()) + 1 if broken.size else 0


def _angles_of_poses(run: Run, rows: NDArray[np.intp]) -> JointPath:
    """Returns the joint angles of the poses in some rows, up to the first one that has none, shape (M, n), [rad]."""
    model, cycles = require_model(run.model), run.cycles
    start = as_vector(cycles["q_c"][0], model.n, "q_c of the run", "rad")
    T = np.clip(cycles["command_pose"][rows], -_FARTHEST, _FARTHEST)
    for row, pose in enumerate(T.reshape(-1, 16)):
        if find_frame_error(pose.tolist()) is not None:
            T = T[:row]
            break
    if not len(T):
        return T.reshape(0, model.n)
    sent = cycles["command_psi"][rows[: len(T)]]
    if model.redundancy and condition_table(model.description).has_free_elbow and not np.isfinite(sent).all():
        return free_inverse_path(model, T, sent, start)
    psi = _arm_angles(model, start, sent.tolist()) if model.redundancy else None
    q, end = inverse_path(model, T, psi, start)
    return q if end is None else q[: end.row]


def _arm_angles(model: RobotModel, start: JointVector, sent: list[float]) -> Array:
    """Returns the arm angle of every pose, [rad], as a controller reads them: without one, the last is held.

    The vendor's client cannot send exactly zero: without an arm angle it counts as zero while it passes zero.
    """
    limits = model.limits.arm_angle
    smallest = 0.0 if limits is None else 2.0 * CYCLE_TIME * limits.velocity
    found: list[float] = []
    last, had_one = 0.0 if not sent or math.isfinite(sent[0]) else model.solver.redundancy_angle(start.tolist()), False
    for psi in sent:
        if math.isfinite(psi):
            last, had_one = psi, True
        elif had_one and abs(last) <= smallest:
            last = 0.0
        found.append(last)
    return np.array(found)


def _fade_time(dq: Array, ddq: Array, model: RobotModel) -> float:
    """Returns how long the stop of `_fade_out` takes, [s]: whole cycles."""
    limits = model.limits.joint
    acceleration, jerk = _FADE_SHARE * limits.acceleration, _FADE_SHARE * limits.jerk
    # Its largest acceleration is 1.5 dq / T, its jerk 6 dq / T^2 and 4 ddq / T.
    times = (1.5 * np.abs(dq) / acceleration, np.sqrt(6.0 * np.abs(dq) / jerk), 4.0 * np.abs(ddq) / jerk)
    return CYCLE_TIME * math.ceil(min(float(np.max(times)), _FADE_TIME) / CYCLE_TIME)


def _fade_out(dq: Array, ddq: Array, duration: float) -> JointPath:
    """Returns the displacement in every cycle until standstill; velocity and acceleration vanish smoothly."""
    s = CYCLE_TIME * np.arange(1, round(duration / CYCLE_TIME) + 1)[:, np.newaxis]
    u = s / duration
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
