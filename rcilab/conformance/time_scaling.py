"""The smallest slow-down with which a motion conforms, estimated from ratios and verified by checks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from rcilab.conformance.catalogue import Language
from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.conformance.explain import explain_slow_down
from rcilab.core.arrays import as_number
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError
from rcilab.motion.motion import Motion

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report

MAX_FACTOR = 20.0
"""Largest factor to try. Reason: a motion that needs more is not too fast but has jumps."""
MAX_DURATION = 600.0  # [s]
"""Longest duration of a slowed motion, 600 000 rows. The factor 2 is tried in any case."""
PRECISION = 1e-3
"""Relative tolerance of the factor."""

_TYPICAL_ATTEMPTS = 6  # Measured: 2 to 13. For the progress estimate.
_START_CYCLES = 3  # [cycles] Reach of a third difference from the start.
_JUMP_RATIO = 4.0
"""A motion jumps if its ratio at the largest factor exceeds that of a smooth motion by this factor. Tuning value."""

Obstacle: TypeAlias = Literal["position", "elsewhere", "moving_start", "jump", "too_fast"]
"""Why no slow-down conforms: the path leaves a range or the box; it does not start at the arm; the arm is moving at the
start, and the slowed motion does not match its velocity; the motion jumps; it is too fast for the largest factor."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SlowDown:
    """The smallest slow-down with which a motion conforms, or why none exists; `str` returns a sentence."""

    before: Motion
    """The original motion."""
    factor: float | None = None
    """Factor on the duration, 1 or more; None if no slow-down conforms."""
    motion: Motion | None = None
    """The slowed motion; the original one if the factor is 1, None if no slow-down conforms."""
    report: Report | None = None
    """Report of the slowed motion, with the certificate; None if no slow-down conforms."""
    decisive: ConditionResult | None = None
    """The result that determines the factor, for the slowed motion; or one that is violated at the largest factor. None
    if the original motion conforms."""
    obstacle: Obstacle | None = None
    """Why no slow-down conforms; None if one does."""
    unmet: tuple[Condition, ...] = ()
    """Requested recommended conditions that no slow-down satisfies."""
    at_most: float
    """The largest factor tried."""

    @property
    def ok(self) -> bool:
        """Whether a slow-down conforms."""
        return self.factor is not None

    def explain(self, language: Language = "en") -> str:
        """Returns the result in a sentence.

        Raises:
            InvalidValueError: The language is unknown.
        """
        return explain_slow_down(self, language)

    def __str__(self) -> str:
        return self.explain()

    def __repr__(self) -> str:
        return f"<SlowDown: {self}>"


def find_slow_down(
    report: Report,
    *,
    recommended: bool = False,
    at_most: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> SlowDown:
    """Returns the smallest slow-down with which a report's motion conforms, or why none exists.

    Args:
        report: Report on the original motion.
        recommended: Whether to satisfy the recommended conditions too, as far as a slow-down can.
        at_most: Largest factor to try, 1 or more; None is `MAX_FACTOR`, or what makes the motion last `MAX_DURATION`.
        progress: Called after every attempt with the estimated progress, 0 to 1; an exception raised by it cancels the
            search.

    Raises:
        InvalidValueError: `at_most` is not a number of at least 1.
    """
    return _Search(report, _max_factor(report.motion, at_most), progress or (lambda part: None)).run(recommended)


def can_slow_down_help(report: Report) -> bool:
    """Returns whether a violated condition depends on the speed, and no necessary one does not."""
    powers = [(row.necessity, _power(row.condition)) for row in _broken(report)]
    return ("necessary", 0) not in powers and any(power > 0 for _, power in powers)


def is_met_when_slower(report: Report) -> bool:
    """Returns whether every violated condition depends on the speed."""
    return all(_power(row.condition) > 0 for row in _broken(report))


class _Search:
    """One search, with the original report and the largest factor."""

    def __init__(self, report: Report, at_most: float, progress: Callable[[float], None]) -> None:
        self._report = report
        self._motion = report.motion
        self._at_most = at_most
        self._template = SlowDown(before=report.motion, at_most=at_most)
        self._progress, self._attempts = progress, 0

    def run(self, recommended: bool) -> SlowDown:
        broken = _broken(self._report)
        for row in broken:
            if row.necessity == "necessary" and _power(row.condition) == 0:
                obstacle = "elsewhere" if row.condition.stage == "start" else "position"
                return replace(self._template, decisive=row, obstacle=obstacle)
        rows = tuple(row.condition for row in self._report.rows if _power(row.condition) > 0)
        necessary = tuple(row for row in rows if row.necessity == "necessary")
        if not recommended:
            return self._find_least(necessary, ())
        recommended_rows = tuple(row.condition for row in broken if row.necessity == "recommended")
        unmet_ids = {row.id for row in self._broken_at(self._at_most, recommended_rows)}
        unmet = tuple(row for row in recommended_rows if row.id in unmet_ids)
        both = self._find_least(tuple(row for row in rows if row not in unmet), unmet)
        return both if both.ok else self._find_least(necessary, recommended_rows)

    def _find_least(self, rows: tuple[Condition, ...], unmet: tuple[Condition, ...]) -> SlowDown:
        """Returns the smallest slow-down that satisfies these rows."""
        ids = {row.id for row in rows}
        broken = [row for row in _broken(self._report) if row.id in ids]
        if not broken:
            return replace(self._template, factor=1.0, motion=self._motion, report=self._report, unmet=unmet)
        low, margin = 1.0, PRECISION / 2.0
        ratio = max(row.ratio ** (1.0 / _power(row.condition)) for row in broken)
        while True:
            high = min(low * ratio * (1.0 + margin), self._at_most)
            found = self._broken_at(high, rows)
            if not found:
                break
            if high >= self._at_most:
                return replace(self._template, decisive=found[0], obstacle=self._obstacle(found[0]))
            # Not smooth: a step in velocity decreases only linearly with the factor.
            low, broken, margin, ratio = high, found, 20.0 * margin, max(row.ratio for row in found)
        factor = max(low, high / (1.0 + PRECISION))
        while high > low * (1.0 + PRECISION) + 1e-12:
            found = self._broken_at(factor, rows)
            if found:
                low, broken = factor, found
            else:
                high = factor
            factor = sqrt(low * high)
        return self._verified(high, broken[0].id, unmet)

    def _broken_at(self, factor: float, rows: tuple[Condition, ...]) -> list[ConditionResult]:
        """Returns the rows that are violated at a factor."""
        if not rows:
            return []
        found = _broken(self._report.check_again(self._motion.slowed(factor), rows))
        self._attempts += 1
        self._progress(self._attempts / (self._attempts + _TYPICAL_ATTEMPTS))
        return found

    def _obstacle(self, row: ConditionResult) -> Obstacle:
        """Returns why a row is still violated at the largest factor."""
        start = self._report.start
        if row.time < (_START_CYCLES + 0.5) * CYCLE_TIME:
            if np.abs(self._motion.start - start.q).max() > START_POSITION_TOLERANCE:
                return "elsewhere"
            if start.moving:
                return "moving_start"
        before = next(result for result in self._report.rows if result.id == row.id)
        smooth = max(before.ratio, 1.0) / self._at_most ** _power(row.condition)
        return "jump" if row.ratio > _JUMP_RATIO * smooth else "too_fast"

    def _verified(self, factor: float, name: str, unmet: tuple[Condition, ...]) -> SlowDown:
        motion = self._motion.slowed(factor)
        report = self._report.check_again(motion, tuple(row.condition for row in self._report.rows))
        if not report.ok:  # The slowed motion has more rows on the same path; one may exceed a bound of position.
            return replace(self._template, decisive=_broken(report)[0], obstacle="position")
        decisive = next(row for row in report.rows if row.id == name)
        return replace(self._template, factor=factor, motion=motion, report=report, decisive=decisive, unmet=unmet)


def _broken(report: Report) -> list[ConditionResult]:
    """Returns the violated rows, necessary ones first, the worst of each kind first."""
    return sorted((row for row in report.rows if not row.ok), key=lambda row: (row.necessity, -row.ratio))


def _power(condition: Condition) -> int:
    """Returns the power of the factor by which a condition's values decrease; 0 if they do not change."""
    if condition.signal == "torque":  # Without gravity: accelerations, and products of velocities.
        return condition.order + 2
    return condition.order


def _max_factor(motion: Motion, at_most: float | None) -> float:
    if at_most is None:
        return MAX_FACTOR if motion.duration == 0.0 else min(MAX_FACTOR, max(2.0, MAX_DURATION / motion.duration))
    number = as_number(at_most, "at_most")
    if not 1.0 <= number < math.inf:
        raise InvalidValueError("at_most", number, "must be 1 or more, and finite: the largest factor to try")
    return number
