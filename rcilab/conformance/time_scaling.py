"""The least slow-down that makes a motion conform, found from ratios and proven by checks."""

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

AT_MOST = 20.0
"""Largest factor that is tried: a motion that needs more does not run too fast, it jumps."""
LONGEST = 600.0  # [s]
"""How long a slowed motion may last: 600 000 rows. The factor 2 is tried in any case."""
PRECISION = 1e-3
"""Part by which the factor may be larger than the least one."""

_USUAL_TRIES = 6  # Measured searches took 2 to 13; for the progress estimate only.
_LOOK_BACK = 3  # [cycles] How long a third difference sees the start.
_JUMP = 4.0
"""Times more than a smooth motion would have left at the largest factor: then it jumps."""

Obstacle: TypeAlias = Literal["position", "elsewhere", "moving_start", "jump", "too_fast"]
"""Why no slow-down helps: the path itself leaves its range or the box; it starts elsewhere than the arm is; the arm
moves at the start, and the slowed motion does not continue that; it jumps somewhere; it is too fast for the
largest factor tried."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SlowDown:
    """The least slow-down of a motion that passes, or why no slow-down passes; `str` returns a sentence."""

    before: Motion
    """The motion as it was."""
    factor: float | None = None
    """Times slower, 1 or more; None when no slow-down passes."""
    motion: Motion | None = None
    """The slowed motion; the one of the report when the factor is 1, None when no slow-down passes."""
    report: Report | None = None
    """Its own report, with the certificate; None when no slow-down passes."""
    decisive: ConditionResult | None = None
    """What decides the factor, as the slowed motion has it; or what stays broken at the largest factor tried. None when
    the motion passes as it is."""
    obstacle: Obstacle | None = None
    """Why no slow-down passes; None when one does."""
    unmet: tuple[Condition, ...] = ()
    """Recommended conditions that were asked for and that no slow-down meets."""
    at_most: float
    """The largest factor tried."""

    @property
    def ok(self) -> bool:
        """Whether there is a slow-down that passes."""
        return self.factor is not None

    def explain(self, language: Language = "en") -> str:
        """Returns it in a sentence.

        Raises:
            InvalidValueError: There is no such language.
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
    """Returns the least slow-down of a report's motion that passes, or why none does.

    Args:
        report: On the motion as it is.
        recommended: Whether to meet the recommended conditions too, those that some slow-down meets.
        at_most: Largest factor to try, 1 or more; None is `AT_MOST`, or what makes the motion last `LONGEST`.
        progress: Called after every try with the part of the work that is done, 0 to 1: an estimate, as the
            number of tries is not known. What it raises ends the search.

    Raises:
        InvalidValueError: `at_most` is no number of at least 1.
    """
    return _Search(report, _largest(report.motion, at_most), progress or (lambda part: None)).run(recommended)


class _Search:
    """One search, with the report it starts from and the largest factor it may try."""

    def __init__(self, report: Report, at_most: float, progress: Callable[[float], None]) -> None:
        self._report = report
        self._motion = report.motion
        self._at_most = at_most
        self._nothing = SlowDown(before=report.motion, at_most=at_most)
        self._progress, self._tries = progress, 0

    def run(self, recommended: bool) -> SlowDown:
        """Returns the least slow-down that keeps the necessary conditions, and on demand the recommended ones."""
        broken = _broken(self._report)
        for row in broken:
            if row.necessity == "necessary" and _power(row.condition) == 0:
                obstacle = "elsewhere" if row.condition.stage == "start" else "position"
                return replace(self._nothing, decisive=row, obstacle=obstacle)
        rows = tuple(row.condition for row in self._report.rows if _power(row.condition) > 0)
        necessary = tuple(row for row in rows if row.necessity == "necessary")
        if not recommended:
            return self._least(necessary, ())
        advised = tuple(row.condition for row in broken if row.necessity == "recommended")
        stubborn = {row.id for row in self._at(self._at_most, advised)}
        unmet = tuple(row for row in advised if row.id in stubborn)
        both = self._least(tuple(row for row in rows if row not in unmet), unmet)
        return both if both.ok else self._least(necessary, advised)

    def _least(self, rows: tuple[Condition, ...], unmet: tuple[Condition, ...]) -> SlowDown:
        """Returns the least slow-down that keeps these rows."""
        wanted = {row.id for row in rows}
        broken = [row for row in _broken(self._report) if row.id in wanted]
        if not broken:
            return replace(self._nothing, factor=1.0, motion=self._motion, report=self._report, unmet=unmet)
        low, spare = 1.0, PRECISION / 2.0
        need = max(row.ratio ** (1.0 / _power(row.condition)) for row in broken)
        while True:
            high = min(low * need * (1.0 + spare), self._at_most)
            found = self._at(high, rows)
            if not found:
                break
            if high >= self._at_most:
                return replace(self._nothing, decisive=found[0], obstacle=self._obstacle(found[0]))
            # Not smooth, then: a step in velocity shrinks with the factor alone.
            low, broken, spare, need = high, found, 20.0 * spare, max(row.ratio for row in found)
        probe = max(low, high / (1.0 + PRECISION))
        while high > low * (1.0 + PRECISION) + 1e-12:
            found = self._at(probe, rows)
            if found:
                low, broken = probe, found
            else:
                high = probe
            probe = sqrt(low * high)
        return self._proven(high, broken[0].id, unmet)

    def _at(self, factor: float, rows: tuple[Condition, ...]) -> list[ConditionResult]:
        """Returns those of the rows that are broken at a factor."""
        if not rows:
            return []
        found = _broken(self._report.check_again(self._motion.slowed(factor), rows))
        self._tries += 1
        self._progress(self._tries / (self._tries + _USUAL_TRIES))
        return found

    def _obstacle(self, row: ConditionResult) -> Obstacle:
        """Returns why a row is still broken at the largest factor."""
        start = self._report.start
        if row.time < (_LOOK_BACK + 0.5) * CYCLE_TIME:
            if np.abs(self._motion.start - start.q).max() > START_POSITION_TOLERANCE:
                return "elsewhere"
            if start.moving:
                return "moving_start"
        before = next(was for was in self._report.rows if was.id == row.id)
        smooth = max(before.ratio, 1.0) / self._at_most ** _power(row.condition)
        return "jump" if row.ratio > _JUMP * smooth else "too_fast"

    def _proven(self, factor: float, name: str, unmet: tuple[Condition, ...]) -> SlowDown:
        motion = self._motion.slowed(factor)
        report = self._report.check_again(motion, tuple(row.condition for row in self._report.rows))
        if not report.ok:  # More rows of the same path: one of them is past a bound that those before just kept.
            return replace(self._nothing, decisive=_broken(report)[0], obstacle="position")
        decisive = next(row for row in report.rows if row.id == name)
        return replace(self._nothing, factor=factor, motion=motion, report=report, decisive=decisive, unmet=unmet)


def _broken(report: Report) -> list[ConditionResult]:
    """Returns the rows that are broken, necessary ones first, the worst of each kind first."""
    return sorted((row for row in report.rows if not row.ok), key=lambda row: (row.necessity, -row.ratio))


def _power(condition: Condition) -> int:
    """Returns with which power of the factor a condition's values shrink; 0 for those that stay."""
    if condition.signal == "torque":  # Without gravity: accelerations, and products of velocities.
        return condition.order + 2
    return condition.order


def _largest(motion: Motion, at_most: float | None) -> float:
    """Returns the largest factor to try."""
    if at_most is None:
        return AT_MOST if motion.duration == 0.0 else min(AT_MOST, max(2.0, LONGEST / motion.duration))
    number = as_number(at_most, "at_most")
    if not 1.0 <= number < math.inf:
        raise InvalidValueError("at_most", number, "must be 1 or more, and finite: how many times slower to try")
    return number
