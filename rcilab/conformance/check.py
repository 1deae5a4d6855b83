"""Check of a whole motion, with the controller's arithmetic in vectorised form."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.cell.cell import Cell, has_obstacles, require_cell, required_distance
from rcilab.conformance.advice import advise
from rcilab.conformance.catalogue import Phrase
from rcilab.conformance.certificate import issue_certificate
from rcilab.conformance.clearance_conditions import FAR, clearance_conditions
from rcilab.conformance.common_conditions import condition_table
from rcilab.conformance.free_elbow import leaves_elbow_free, resulting_motion
from rcilab.conformance.limit_utilisation import Usage, near_bound, worst_of
from rcilab.conformance.report import ConditionResult, Report, Violation
from rcilab.conformance.signals import HOLD_SAMPLES as HOLD_SAMPLES
from rcilab.conformance.signals import MotionSignals, Record
from rcilab.conformance.standstill import resolution
from rcilab.conformance.start import StartState, as_start
from rcilab.core.arrays import Array, Unquoted, as_rows, described
from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Bounds, Condition
from rcilab.core.errors import InvalidValueError, ModelError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.state import Mode, require_mode
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.bounds import RECOVERY_RANGE, range_from
from rcilab.motion.motion import Motion, require_motion

_NEAR = 0.2  # Of the worst value: a smooth signal comes so near in the cycle before it or after; a tuning value.
_STANDS = 1e-6  # [rad] Of joints that only keep a pose which does not change; far below what moves a tool.


def check(
    motion: Motion,
    model: RobotModel,
    *,
    start: ArrayLike | StartState | None = None,
    box: SafetyBox | None = None,
    distance: ClearanceLimit | None = STANDARD_DISTANCE,
    cell: Cell | None = None,
    mode: Mode = "joint_position",
) -> Report:
    """Checks a motion against the conditions of its robot's controller, and the distances between its links.

    Every row of the 1 ms grid is checked by backward differences, as by the controller: before the first row the arm is
    in the start state, and after the last row the controller holds it. For a moving arm row 0 is the last command, and
    row 1 the first new one. Torques, for which the manual recommends bounds, are those of the model with its tool and
    load and without gravity, as the manual defines commanded torques (4.4).

    No controller checks for collisions, so the rows on distances are rcilab's own: contact of links with each other or
    the floor violates a necessary condition, less than 20 mm a recommended one. Distances are those between capsules,
    computed so often that no point of a link moves more than 5 mm in between, and in every cycle near a bound. They
    take most of the time.

    By default joint angles are commanded. In Cartesian modes the corresponding poses of the tool and arm angles are:
    tool, arm angle, singularity and joint angles are checked. Where no arm angle is sent (FR3), the joint angles are
    those that the poses lead to with the least motion of the joints, and the title has their distance from the plan;
    the maker does not publish its own inverse. In torque mode the torques of the motion are commanded: torques and
    joint ranges are checked.

    A motion that ends inside the joint ranges may start up to `RECOVERY_RANGE` outside, and must then move back and not
    farther out, like those of `plan_recovery`. A tool that starts outside the box may only move inwards.

    Args:
        motion: The motion.
        model: The arm.
        start: Commanded joint angles of a stationary arm, shape (n,), [rad]; a StartState for a moving one; None for a
            stationary arm at the start of the motion.
        box: The safety box, as set with `set_safety_box`; None, or an inactive box, is not checked.
        distance: Required distances of the links from each other and from the floor, and its height. None does not
            check them, for fast planning while a target is dragged; `execute` does not accept such a certificate.
        cell: What the arm carries and what stands around it; its tool, load and floor count instead of the model's.
        mode: Mode in which the motion will run, as in `control`; the certificate is for this mode.

    Raises:
        InvalidValueError: The motion has another number of joints, or the start, the mode or another argument is not
            valid for this arm.
        ModelError: The arm's controller has no such mode.
    """
    return _check(motion, model, start, box, distance, cell, mode)


def check_speed_change(motion: Motion, model: RobotModel, *, start: StartState | None, mode: Mode) -> Report:
    """Checks the rows of a motion from a change of its speed on; their path has been checked.

    Args:
        motion: The rows, as the joints follow them.
        model: The arm.
        start: State of the arm at the first row; None for a stationary arm.
        mode: Mode of the motion.
    """
    is_free = leaves_elbow_free(model, mode)
    return _check(
        motion,
        model,
        start,
        None,
        None,
        None,
        mode,
        record=Record(has_free_elbow=True, is_to_come=True) if is_free else None,
    )


def check_torques(
    motion: Motion,
    torques: ArrayLike,
    model: RobotModel,
    *,
    start: ArrayLike | StartState | None = None,
    box: SafetyBox | None = None,
    distance: ClearanceLimit | None = STANDARD_DISTANCE,
    cell: Cell | None = None,
) -> Report:
    """Checks a recorded motion with the torques that were commanded, in torque mode.

    `check` computes the torques of a motion from the model; here they are given. The report has no certificate, and
    no motion can be slowed by it: the arm moves as the torques let it.

    Args:
        motion: The motion of the arm.
        torques: Commanded torques, without gravity, one row for each of the motion, shape (N, n), [N m].
        model: The arm.
        start: As for `check`, also for the other two.
        box: The safety box.
        distance: Required distances of the links.
        cell: As for `check`.

    Raises:
        InvalidValueError: An argument is not valid for this arm, or the numbers of rows differ.
    """
    rows = as_rows(torques, model.n, "torques", "N m", require_motion(motion).q)
    return _check(motion, model, start, box, distance, cell, "torque", rows)


def check_commands(
    motion: Motion,
    model: RobotModel,
    record: Record,
    *,
    start: ArrayLike | StartState | None = None,
    box: SafetyBox | None = None,
    distance: ClearanceLimit | None = STANDARD_DISTANCE,
    cell: Cell | None = None,
    mode: Mode = "joint_position",
) -> Report:
    """Checks the commands of a recorded motion, up to the last one.

    `check` holds the arm at the last row; here the controller has stopped it. A first command within one cycle's jerk
    of the arm is the first step of the motion. An end that is not the client's need not be a standstill. The report has
    no certificate.

    Args:
        motion: The commands.
        model: The arm.
        record: What else is known of them.
        start: As for `check`; a StartState where the beginning of the motion is not known.
        box: The safety box.
        distance: Required distances of the links.
        cell: As for `check`.
        mode: Mode of the motion.

    Raises:
        InvalidValueError: As for `check`.
    """
    return _check(motion, model, start, box, distance, cell, mode, record=record)


def _check(
    motion: Motion,
    model: RobotModel,
    start: ArrayLike | StartState | None,
    box: SafetyBox | None,
    distance: ClearanceLimit | None,
    cell: Cell | None,
    mode: Mode,
    torques: Array | None = None,
    record: Record | None = None,
) -> Report:
    require_motion(motion)
    require_model(model)
    if motion.n != model.n:
        raise InvalidValueError("motion", Unquoted("it"), f"is for {motion.n} joints, {model.name} has {model.n}")
    box = active_box(box)
    if distance is not None and not isinstance(distance, ClearanceLimit):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InvalidValueError(
            "distance", described(distance), "is not a ClearanceLimit; use ClearanceLimit(links=...)"
        )
    if cell is not None:
        model = require_cell(cell).applied_to(model)
        distance = required_distance(distance, cell)
    state = as_start(motion.start if start is None else start, model.n)
    mode = require_mode(mode)
    table = condition_table(model.description)
    if mode not in table.modes:
        modes = ", ".join(one.replace("_", " ") for one in table.modes)
        raise ModelError(
            f"the controller of {model.name} has no {mode.replace('_', ' ')} mode; its modes: {modes}"
        ).coded("no_feature", model=model.name, feature=mode)
    rows = table.rows(mode, has_elbow=bool(model.redundancy), has_box=box is not None)
    if distance is not None:
        rows = (*rows, *clearance_conditions(distance, has_obstacles=has_obstacles(cell)))
    if record is not None:
        rows = _rows_of_record(rows, record, state, mode)
    return _report(
        motion,
        rows,
        model=model,
        start=state,
        box=box,
        distance=distance,
        cell=cell,
        mode=mode,
        torques=torques,
        record=record,
    )


def _rows_of_record(
    rows: tuple[Condition, ...], record: Record, start: StartState, mode: Mode
) -> tuple[Condition, ...]:
    """Returns the conditions for which there is something to check."""
    is_missing = {
        "start": start.moving and not record.is_to_come,
        "throughout": False,
        "end": record.was_stopped,
    }
    is_free = record.has_free_elbow and mode.startswith("cartesian")
    return tuple(row for row in rows if not (is_missing[row.stage] or (is_free and row.signal == "arm_angle")))


def _report(
    motion: Motion,
    rows: tuple[Condition, ...],
    *,
    model: RobotModel,
    start: StartState,
    box: SafetyBox | None,
    distance: ClearanceLimit | None,
    cell: Cell | None,
    mode: Mode,
    torques: Array | None = None,
    record: Record | None = None,
) -> Report:
    """Returns the report on a motion by some of the conditions."""
    followed, known = motion, record
    if record is None and leaves_elbow_free(model, mode):
        followed = resulting_motion(motion, model, mode)
        is_cut = len(followed) < len(motion)
        known = Record(was_stopped=is_cut, refused_pose=is_cut, has_free_elbow=True, is_to_come=not is_cut)
        rows = _rows_of_record(rows, known, start, mode)
    checker = _MotionChecker(followed, model, start, box, distance, cell, mode, torques, known)
    results = [checker.evaluate(row) for row in rows]
    found = sorted((v for _, violations in results for v in violations), key=lambda v: -v.ratio)
    facts = {"model": model.name, "law": motion.law, "duration": f"{motion.duration:.3f}", "speed": f"{motion.speed:g}"}
    return Report(
        title=_title(model, mode, facts, followed, motion),
        rows=tuple(result for result, _ in results),
        violations=tuple(v for v in found if v.condition.necessity == "necessary"),
        warnings=tuple(v for v in found if v.condition.necessity == "recommended"),
        motion=motion,
        start=start,
        measure=partial(checker.usage, rows, len(motion)),
        issue=_issue_none
        if torques is not None or record is not None
        else partial(issue_certificate, motion, model, start, box, distance, mode, cell),
        check_again=_refuse_other_motion
        if torques is not None
        else partial(
            _report, model=model, start=start, box=box, distance=distance, cell=cell, mode=mode, record=record
        ),
    )


def _distance_between(followed: Motion, motion: Motion) -> float:
    """Returns the largest distance of the joints from their plan, [rad]; of a motion that is followed as planned, 0."""
    return 0.0 if followed is motion else float(np.abs(followed.q - motion.q[: len(followed)]).max())


def _title(model: RobotModel, mode: Mode, facts: dict[str, str], followed: Motion, motion: Motion) -> Phrase:
    away = _distance_between(followed, motion)
    if away:
        stands = len(followed) == len(motion) and np.abs(followed.q - followed.start).max() < _STANDS
        return Phrase("title.elbow_only" if stands else "title.free_elbow", **facts, mode=mode, away=away)
    if mode != "joint_position":
        return Phrase("title.in_mode", **facts, mode=mode)
    table = model.description.conditions
    cycles = 1 if table is None else table().command_cycles
    return Phrase("title.sampled", **facts, period=str(cycles)) if cycles > 1 else Phrase("title", **facts)


def _issue_none() -> None:
    """Recorded commands have no certificate: `execute` would stop after them, or compute other torques."""


def _refuse_other_motion(motion: Motion, rows: tuple[Condition, ...]) -> Report:
    raise UsageError("commanded torques cannot be slowed down: the arm moves as they let it")


class _MotionChecker:
    """Compares the signals of one motion with the bounds."""

    def __init__(
        self,
        motion: Motion,
        model: RobotModel,
        start: StartState,
        box: SafetyBox | None,
        distance: ClearanceLimit | None,
        cell: Cell | None,
        mode: Mode,
        torques: Array | None = None,
        record: Record | None = None,
    ) -> None:
        self._motion = motion
        self._limits = _limits_of(motion, model.limits, start)
        self._is_record = record is not None and not record.is_to_come
        self._signals = MotionSignals(motion, model, start, box, distance, mode, torques, record, cell)
        self._depth = min(box.size) / 2.0 if box is not None else 1.0

    def evaluate(self, condition: Condition) -> tuple[ConditionResult, list[Violation]]:
        values, first_time = self._signals.table(condition)
        lower, upper = self._bounds(condition)
        if lower.ndim == 2:
            reach = self._ratio(values, lower, upper).max(axis=0)
            ok = bool(((lower < values) & (values < upper)).all())
        else:
            smallest, largest = values.min(axis=0), values.max(axis=0)
            reach = np.maximum(self._ratio(smallest, lower, upper), self._ratio(largest, lower, upper))
            ok = bool(((lower < smallest) & (largest < upper)).all())
        column = int(reach.argmax())
        one = slice(column, column + 1)
        row = int(self._ratio(values[:, one], lower[..., one], upper[..., one]).argmax())
        value = float(values[row, column])
        is_violated = None if ok else ~((lower < values) & (values < upper))
        bound = _nearest_bound(value, lower, upper, row, column)
        result = ConditionResult(
            condition=self._with_source(condition, column, bound),
            value=value,
            bound=bound,
            ratio=float(reach[column]),
            joint=_axis(condition, column),
            time=self._time(condition, first_time, row),
            broken=0 if is_violated is None else int(np.count_nonzero(is_violated)),
            links=self._signals.links(condition, row),
            start_excess=self._signals.start_excess if condition.signal == "position" else 0.0,
            limits=_uneven_limits(lower, upper, column),
        )
        if is_violated is None:
            return result, []
        runs = _runs(is_violated)
        if condition.necessity == "recommended" and condition.stage == "throughout":
            runs = [run for run in runs if run[0] == column and run[1] <= row < run[2]]  # Only the worst.
        ratio = self._ratio(values, lower, upper)
        return result, [self._violation(condition, values, (lower, upper), ratio, first_time, run) for run in runs]

    def _bounds(self, condition: Condition) -> Bounds:
        """Returns the bounds of a condition, shape (n,) or (1,); (rows, n) if they depend on the joint angles.

        A recorded first command may be the first step of the motion.
        """
        if condition.bounds_at is not None and condition.depends_on_angles(self._limits.joint):
            return condition.bounds_at(self._limits.joint, self._signals.angles_before())
        lower, upper = condition.bounds(self._limits)
        if not self._is_record or condition.stage != "start" or condition.order or condition.necessity == "necessary":
            return lower, upper
        step = resolution(condition.signal, 0, self._limits)
        return lower - step, upper + step

    def _with_source(self, condition: Condition, column: int, bound: float) -> Condition:
        """Returns the condition, with the source of its bound if that is not the arm's own."""
        if condition.signal != "joint" or condition.order or self._limits.joint.is_own(column + 1, bound):
            return condition
        return replace(condition, source=self._limits.source("joint.upper"))

    def usage(self, conditions: tuple[Condition, ...], count: int) -> Usage:
        """Returns the worst of the necessary conditions by row, for a number of rows; out of reach stays so."""
        necessary = [row for row in conditions if row.necessity == "necessary" and row.stage == "throughout"]
        return worst_of((row, _lengthened(self._used(row), count)) for row in necessary)

    def _used(self, condition: Condition) -> Array:
        values, _ = self._signals.table(condition)
        ratio = self._ratio(values, *self._bounds(condition)).max(axis=1)[: len(self._motion.times)]
        return near_bound(ratio) if condition.order == 0 and condition.signal in ("joint", "position") else ratio

    def _ratio(self, values: Array, lower: Array, upper: Array) -> Array:
        """Returns the distance from the middle of the allowed range, as a share of that of the bound.

        Bounds that depend on the joint angles are not symmetric; there the value is a share of the bound on its side.
        """
        if lower.ndim == 2:
            return values / np.where(values < 0.0, lower, upper)
        if not np.isfinite(lower).all():  # The box: 0 at its centre, 1 on its faces.
            return np.maximum(1.0 + (values - upper) / self._depth, 0.0)
        if not np.isfinite(upper).all():  # A clearance: 0 at `FAR` or more beyond the bound, 1 at the bound.
            return np.maximum(1.0 + (lower - values) / FAR, 0.0)
        middle = (lower + upper) / 2.0
        ratio = np.abs(values - middle if middle.any() else values)
        ratio /= (upper - lower) / 2.0
        return ratio

    def _violation(
        self,
        condition: Condition,
        values: Array,
        bounds: Bounds,
        ratio: Array,
        first_time: float,
        run: tuple[int, int, int],
    ) -> Violation:
        column, begin, end = run
        row = begin + int(ratio[begin:end, column].argmax())
        value, worst = float(values[row, column]), float(ratio[row, column])
        is_off_start = self._signals.is_off_start
        joint = _axis(condition, column)
        is_angle = condition.signal == "joint" and condition.order == 0
        soft_limit = self._limits.joint.exceeded_soft_limit(joint, value) if is_angle else None
        bound = _nearest_bound(value, *bounds, row, column)
        is_near_end = bounds[0].ndim == 2 and abs(bound) < self._limits.joint.velocity[column]
        advice = advise(
            condition,
            self._motion,
            row=begin,
            count=end - begin,
            ratio=worst,
            is_off_start=is_off_start,
            is_isolated=_is_isolated(values[:, column], begin, end, value),
            soft_limit=soft_limit,
            is_near_end=bool(is_near_end),
            is_record=self._is_record,
        )
        return Violation(
            condition=condition,
            joint=joint,
            time=self._time(condition, first_time, begin),
            count=end - begin,
            value=value,
            worst_time=self._time(condition, first_time, row),
            bound=bound,
            ratio=worst,
            advice=advice,
            links=self._signals.links(condition, row),
        )

    def _time(self, condition: Condition, first_time: float, row: int) -> float:
        """Returns the time of a row, [s]; in those after the end the arm is still where the motion ends.

        Differences and torques change there, and a pose that was refused follows the motion.
        """
        time = first_time + row * CYCLE_TIME
        is_place = not condition.order and condition.signal not in ("torque", "frame")
        return min(time, self._motion.duration) if is_place else time


def _limits_of(motion: Motion, limits: Limits, start: StartState) -> Limits:
    """Returns the limits for a motion; if it ends inside, or starts moving, a joint may start outside its range."""
    joint = limits.joint
    ends_inside = bool(((joint.lower < motion.goal) & (motion.goal < joint.upper)).all())
    if not ends_inside and not start.moving:
        return limits
    return replace(limits, joint=range_from(joint, start.q, RECOVERY_RANGE))


def _nearest_bound(value: float, lower: Array, upper: Array, row: int, column: int) -> float:
    """Returns the bound on the value's side of the middle of the range; of zero, if it depends on the joint angles."""
    if lower.ndim == 2:
        return float((upper if value >= 0.0 else lower)[row, column])
    low, high = float(lower[column]), float(upper[column])
    return high if value >= (low + high) / 2.0 else low


def _uneven_limits(lower: Array, upper: Array, column: int) -> tuple[float, float] | None:
    """Returns both bounds, if their middle is not 0 and they do not depend on the joint angles."""
    if lower.ndim == 2:
        return None
    low, high = float(lower[column]), float(upper[column])
    is_uneven = math.isfinite(low) and math.isfinite(high) and not math.isclose(high, -low)
    return (low, high) if is_uneven else None


def _lengthened(ratio: Array, count: int) -> Array:
    """Returns the values of at least a number of rows, the last one repeated."""
    return np.concatenate((ratio, np.repeat(ratio[-1:], max(count - len(ratio), 0))))


def _is_isolated(values: Array, begin: int, end: int, worst: float) -> bool:
    """Returns whether the values next to some rows are far from the worst of these: a sample there is displaced."""
    return not any(abs(values[row] - worst) < _NEAR * abs(worst) for row in (begin - 1, end) if 0 <= row < len(values))


def _axis(condition: Condition, column: int) -> int:
    return column + 1 if condition.is_per_joint else 0


def _runs(is_violated: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Returns column, first row and row after the last of every run of violating rows."""
    edges = np.diff(np.pad(is_violated, ((1, 1), (0, 0))).astype(np.int8), axis=0)
    runs: list[tuple[int, int, int]] = []
    for column in np.flatnonzero(is_violated.any(axis=0)).tolist():
        begins = np.flatnonzero(edges[:, column] == 1).tolist()
        ends = np.flatnonzero(edges[:, column] == -1).tolist()
        runs += [(column, begin, end) for begin, end in zip(begins, ends, strict=True)]
    return runs
