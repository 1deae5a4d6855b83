"""The judgement of a whole motion at once: the controller's arithmetic, vectorised."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.arrays import Array
from rcilab.clock import CYCLE_TIME
from rcilab.conformance.certificate import issue_certificate
from rcilab.conformance.conditions import CONDITIONS, START_POSITION_TOLERANCE, Condition
from rcilab.conformance.report import ConditionResult, Report, Violation
from rcilab.conformance.start import StartState, as_start
from rcilab.conformance.wording import advise
from rcilab.errors import InvalidValueError
from rcilab.model import RobotModel, require_model
from rcilab.motion.motion import Motion, MotionSample, require_motion

HOLD_SAMPLES = 3
"""Cycles judged after the last row, in which the controller repeats it: a third difference looks back that far."""


def check(motion: Motion, model: RobotModel, *, start: ArrayLike | StartState | None = None) -> Report:
    """Returns what the robot would say to this motion.

    Every row of the 1 ms grid is judged by backward differences, as the controller does it: the arm comes from the
    start state, and after the last row the controller holds it. To an arm that moves, row 0 is the command it has
    already had, and row 1 the first new one.

    Args:
        motion: The motion.
        model: The arm.
        start: Commanded joint angles of the standing arm, shape (n,), [rad]; a StartState for a moving one; None for
            an arm that stands where the motion starts.

    Raises:
        InvalidValueError: The motion is for another number of joints, the start is no state of this arm,
            or one of them is something else altogether.
    """
    require_motion(motion)
    require_model(model)
    if motion.n != model.n:
        raise InvalidValueError("motion", motion, f"is for {motion.n} joints, {model.name} has {model.n}")
    state = as_start(motion.start if start is None else start, model.n)
    judge = _Judge(motion, model, state)
    results = [judge.judge(row) for row in CONDITIONS]
    found = sorted((v for _, violations in results for v in violations), key=lambda v: -v.ratio)
    return Report(
        title=f"{model.name}, motion {motion.law} of {motion.duration:.3f} s at speed {motion.speed:g}",
        rows=tuple(result for result, _ in results),
        violations=tuple(v for v in found if v.condition.necessity == "necessary"),
        warnings=tuple(v for v in found if v.condition.necessity == "recommended"),
        issue=partial(issue_certificate, motion, model, state),
    )


class _Judge:
    """One motion's signals, each a table with a row a cycle."""

    def __init__(self, motion: Motion, model: RobotModel, start: StartState) -> None:
        self._motion = motion
        self._limits = model.limits.joint
        self._start = start
        self._differences = _backward_differences(motion.q, start)
        self._off_start = bool(np.abs(motion.start - start.q).max() > START_POSITION_TOLERANCE)

    def judge(self, condition: Condition) -> tuple[ConditionResult, list[Violation]]:
        values, first_time = self._signal(condition)
        lower, upper = condition.bounds(self._limits)
        middle = (lower + upper) / 2.0
        ratio = np.abs(values - middle if middle.any() else values)
        ratio /= (upper - lower) / 2.0
        row, joint = divmod(int(ratio.argmax()), values.shape[1])
        value = float(values[row, joint])
        bad = ~((lower < values) & (values < upper))
        result = ConditionResult(
            condition=condition,
            value=value,
            bound=float(upper[joint] if value >= middle[joint] else lower[joint]),
            ratio=float(ratio[row, joint]),
            joint=joint + 1,
            time=first_time + row * CYCLE_TIME,
            broken=int(np.count_nonzero(bad)),
        )
        if result.ok:
            return result, []
        runs = _runs(bad)
        return result, [self._violation(condition, values, ratio, first_time, run) for run in runs]

    def _signal(self, condition: Condition) -> tuple[Array, float]:
        """Returns the values to judge, shape (rows, n), and the time of the first row, [s]."""
        if condition.stage == "throughout":
            return self._differences[condition.order], 0.0
        if condition.stage == "end":
            return self._rest(condition, self._motion.end()), self._motion.duration
        if condition.order == 0:
            return (self._motion.start - self._start.q)[np.newaxis], 0.0
        return self._rest(condition, self._motion.at(0.0)), 0.0

    def _rest(self, condition: Condition, sample: MotionSample) -> Array:
        """Returns velocity or acceleration at an end of the motion, shape (1, n).

        Rows that somebody else made tell rest from motion only as far as one cycle at the jerk limit goes.
        """
        value = sample.dq if condition.order == 1 else sample.ddq
        if self._motion.law == "samples":
            unresolved = self._limits.jerk * CYCLE_TIME ** (3 - condition.order)
            value = np.sign(value) * np.maximum(np.abs(value) - unresolved, 0.0)
        return value[np.newaxis]

    def _violation(
        self, condition: Condition, values: Array, ratio: Array, first_time: float, run: tuple[int, int, int]
    ) -> Violation:
        joint, begin, end = run
        row = begin + int(ratio[begin:end, joint].argmax())
        value, worst = float(values[row, joint]), float(ratio[row, joint])
        lower, upper = condition.bounds(self._limits)
        low, high = float(lower[joint]), float(upper[joint])
        advice = advise(condition, self._motion, row=begin, count=end - begin, ratio=worst, off_start=self._off_start)
        return Violation(
            condition=condition,
            joint=joint + 1,
            time=first_time + begin * CYCLE_TIME,
            count=end - begin,
            value=value,
            worst_time=first_time + row * CYCLE_TIME,
            bound=high if value >= (low + high) / 2.0 else low,
            ratio=worst,
            advice=advice,
        )


def _backward_differences(q: Array, start: StartState) -> tuple[Array, Array, Array, Array]:
    """Returns angles, velocity, acceleration and jerk in every cycle, hold included, each of shape (N + 3, n).

    Divisions by the cycle time one after the other, as the monitor does it: equal to the last bit.
    """
    moving = start.moving
    commands = q[1:] if moving else q
    path = np.concatenate((start.q[np.newaxis], commands, np.repeat(q[-1:], HOLD_SAMPLES, axis=0)))
    dq = np.concatenate((start.dq[np.newaxis], np.diff(path, axis=0) / CYCLE_TIME))
    ddq = np.concatenate((start.ddq[np.newaxis], np.diff(dq, axis=0) / CYCLE_TIME))
    jerk = np.diff(ddq, axis=0) / CYCLE_TIME
    if moving:
        return path, dq, ddq, np.concatenate((np.zeros_like(jerk[:1]), jerk))
    return path[1:], dq[1:], ddq[1:], jerk


def _runs(bad: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Returns joint, first row and row after the last of every run of consecutive rows that are bad."""
    edges = np.diff(np.pad(bad, ((1, 1), (0, 0))).astype(np.int8), axis=0)
    runs: list[tuple[int, int, int]] = []
    for joint in np.flatnonzero(bad.any(axis=0)).tolist():
        begins = np.flatnonzero(edges[:, joint] == 1).tolist()
        ends = np.flatnonzero(edges[:, joint] == -1).tolist()
        runs += [(joint, begin, end) for begin, end in zip(begins, ends, strict=True)]
    return runs
