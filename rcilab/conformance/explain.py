"""Reports in sentences, in English and Chinese: quantity, joint, time, excess, fault and remedy."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

from rcilab.conformance.advice import factor_text, with_degrees
from rcilab.conformance.catalogue import Language, Phrase, load_catalogue, translate
from rcilab.core.clearance import FLOOR, PART, TOOL
from rcilab.core.condition import Condition
from rcilab.core.errors import UsageError
from rcilab.i18n.rounding import format_pair
from rcilab.i18n.units import USUAL, Units

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report, Violation
    from rcilab.conformance.time_scaling import SlowDown

MAX_LISTED = 8  # Violations that a report describes; the rest is counted.

_FACTOR_FROM = 10.0
"""Ratio to a bound from which it is written as a factor, not in percent."""


@dataclass(frozen=True, slots=True)
class _Writer:
    """Language and units of the text; without units SI, with degrees next to radians."""

    language: Language
    units: Units | None = None

    def translate(self, key: str, **values: str) -> str:
        return translate(self.language, key, **values)

    def join(self, *sentences: str) -> str:
        """Returns the sentences as one text."""
        return reduce(lambda first, second: self.translate("sentences", first=first, second=second), sentences)


def explain_report(
    report: Report, language: Language = "en", units: Units | None = None, slowed: SlowDown | None = None
) -> str:
    """Returns a report in sentences, one per line: the verdict, the violations, the effect of a slow-down.

    Args:
        report: The report.
        language: "en" is English, "zh" Chinese.
        units: Units of angles and lengths; None is SI, with degrees next to radians.
        slowed: The result of `report.slow_down`, if known; the search takes most of the time.

    Raises:
        InvalidValueError: The language is unknown.
    """
    writer = _Writer(language, units)
    lines = [explain_verdict(report, language, units)]
    found = (*report.violations, *report.warnings)
    lines += [f"- {explain_violation(violation, language, units)}" for violation in found[:MAX_LISTED]]
    if len(found) > MAX_LISTED:
        lines.append(f"- {writer.translate('verdict.more', count=str(len(found) - MAX_LISTED))}")
    if not report.ok:
        with suppress(UsageError):  # Commanded torques cannot be slowed down.
            lines.append(explain_slow_down(slowed or report.slow_down(), language))
    return "\n".join(lines)


def explain_violation(violation: Violation, language: Language = "en", units: Units | None = None) -> str:
    """Returns a violation in sentences: value, fault and remedy.

    Raises:
        InvalidValueError: The language is unknown.
    """
    row, writer = violation.condition, _Writer(language, units)
    stop = writer.translate("stop")
    sentences = (
        _describe_value(violation, writer) + _describe_time(violation, writer) + stop,
        _describe_fault(row, writer),
    )
    advice = violation.advice
    if isinstance(advice, Phrase):
        advice = advice.text(language, units or USUAL)
    return writer.join(*sentences, writer.translate("remedy", advice=advice))


def explain_slow_down(result: SlowDown, language: Language = "en") -> str:
    """Returns the effect of a slow-down in a sentence; it contains no angles and lengths.

    Raises:
        InvalidValueError: The language is unknown.
    """
    row, writer = result.decisive, _Writer(language)
    at_most = f"{result.at_most:g}"
    if row is None:
        text = translate(language, "slow_down.none")
    else:
        place, quantity = explain_place(row, language), explain_quantity(row.condition, writer.language)
        if result.obstacle is not None:
            time = f"{row.time / (1.0 if result.obstacle == 'position' else result.at_most):.3f}"
            key = f"slow_down.{result.obstacle}"
            return translate(language, key, place=place, quantity=quantity, at_most=at_most, time=time)
        assert result.factor is not None
        assert result.motion is not None
        text = translate(
            language,
            "slow_down.passes",
            factor=f"{result.factor:.4g}",
            duration=f"{result.motion.duration:.3f}",
            before=f"{result.before.duration:.3f}",
            place=place,
            quantity=quantity,
        )
    if not result.unmet:
        return text
    names = translate(language, "comma").join(explain_quantity(row, writer.language) for row in result.unmet)
    return writer.join(text, writer.translate("slow_down.warned", at_most=at_most, quantities=names))


def explain_verdict(report: Report, language: Language = "en", units: Units | None = None) -> str:
    """Returns the verdict of a report in a sentence or two.

    Raises:
        InvalidValueError: The language is unknown.
    """
    writer = _Writer(language, units)
    if not report.ok:
        has_fault = any(violation.fault is not None for violation in report.violations)
        key = "verdict.broken" if has_fault else "verdict.collides"
        parts = [writer.translate(key, count=str(len(report.violations)))]
    else:
        parts = [writer.translate("verdict.ok"), _describe_nearest(report.worst, writer)]
    if report.warnings:
        parts.append(writer.translate("verdict.warned", count=str(len(report.warnings))))
    return writer.join(*parts)


def _describe_nearest(row: ConditionResult, writer: _Writer) -> str:
    """Returns the sentence on the nearest necessary bound of an accepted motion."""
    time = f"{row.time:.3f}"
    if row.condition.signal == "position":
        return writer.translate(
            "verdict.deepest", depth=_amount(row.condition, max(-row.value, 0.0), writer), time=time
        )
    if row.condition.signal == "frame":
        return writer.translate("verdict.singular", share=_share(row.ratio, writer), time=time)
    if row.condition.is_clearance:
        place = explain_place(row, writer.language)
        return writer.translate(
            "verdict.clearest", place=place, distance=_amount(row.condition, row.value, writer), time=time
        )
    value, bound = _amounts(row.condition, row.value, row.bound, writer)
    return writer.translate(
        "verdict.nearest",
        place=explain_place(row, writer.language),
        quantity=explain_quantity(row.condition, writer.language),
        value=value,
        bound=bound,
        share=_share(row.ratio, writer),
        time=time,
    )


def _describe_value(violation: Violation, writer: _Writer) -> str:
    row = violation.condition
    place, quantity = explain_place(violation, writer.language), explain_quantity(row, writer.language)
    if violation.reported:
        return writer.translate("fact.reported", place=place, quantity=quantity, reported=violation.reported)
    if row.signal == "frame":
        return writer.translate("fact.frame", place=place, quantity=quantity)
    if math.isnan(violation.value):
        return writer.translate("fact.not_finite", place=place, quantity=quantity)
    value, bound = _amounts(row, violation.value, violation.bound, writer)
    if row.signal == "elbow_sign":
        return writer.translate("fact.elbow_sign", place=place, quantity=quantity, value=value)
    if row.signal == "position":
        return writer.translate("fact.box", place=place, quantity=quantity, value=value)
    if row.is_clearance:
        key = "fact.overlap" if violation.value < 0.0 else "fact.clearance"
        depth = _amount(row, abs(violation.value), writer)
        return writer.translate(key, place=place, quantity=quantity, value=value, bound=bound, depth=depth)
    if row.stage != "throughout":
        limit = _amount(row, abs(violation.bound), writer)
        return writer.translate("fact.rest", place=place, quantity=quantity, value=value, bound=limit)
    excess = _amount(row, abs(violation.value - violation.bound), writer)
    text = writer.translate("fact.bound", place=place, quantity=quantity, value=value, bound=bound, excess=excess)
    if row.order == 0 and row.unit == "rad":  # A share of a range has no meaning: zero may be anywhere in it.
        return text
    return text + writer.translate("fact.share", share=_share(violation.ratio, writer))


def _describe_time(violation: Violation, writer: _Writer) -> str:
    if violation.condition.stage != "throughout":
        return ""
    time, worst = f"{violation.time:.3f}", f"{violation.worst_time:.3f}"
    if violation.count == 1:
        return writer.translate("when.once", time=time)
    return writer.translate("when.lasting", time=time, worst=worst, count=str(violation.count))


def _describe_fault(row: Condition, writer: _Writer) -> str:
    if row.fault is None:
        return writer.translate("raises.nothing" if row.necessity == "recommended" else "raises.unnoticed")
    cause = writer.translate(f"fault.{row.fault.key}")
    return writer.translate("raises.fault", fault=row.fault.manual_name, cause=cause)


def explain_place(found: ConditionResult | Violation, language: Language = "en") -> str:
    """Returns the axis or part of a value: "joint 2", "tool", "base and link 5".

    Raises:
        InvalidValueError: The language is unknown.
    """
    if found.links is not None:
        writer = _Writer(language)
        first, second, obstacle = found.links
        other = translate(language, "place.obstacle", name=obstacle) if obstacle else _link(second, writer)
        return translate(language, "place.pair", first=_link(first, writer), second=other)
    return explain_axis(found.condition, found.joint, language)


def explain_axis(row: Condition, axis: int, language: Language = "en") -> str:
    """Returns the part of the arm that a value of a condition belongs to: "joint 2", "tool".

    Raises:
        InvalidValueError: The language is unknown.
    """
    place = "joint" if row.is_per_joint and axis else row.location(axis)
    return translate(language, f"place.{place}", axis=str(axis))


def explain_quantity(row: Condition, language: Language = "en") -> str:
    """Returns the name of a condition's quantity.

    Raises:
        InvalidValueError: The language is unknown.
    """
    return load_catalogue(language).get(f"quantity.{row.id}", row.quantity)


def explain_source(row: Condition, language: Language = "en") -> str:
    """Returns the source of a condition and its bound; a source without translation stays in English.

    Raises:
        InvalidValueError: The language is unknown.
    """
    return load_catalogue(language).get(f"source.{row.source}", row.source)


def explain_formula(row: Condition, language: Language = "en") -> str:
    """Returns the formula of a condition; formulas without words are the same in every language.

    Raises:
        InvalidValueError: The language is unknown.
    """
    return load_catalogue(language).get(f"formula.{row.formula}", row.formula)


def explain_limit(source: str, language: Language = "en") -> str:
    """Returns the source of a limit; a source without translation stays in English.

    Args:
        source: Text of `Limits.source`.
        language: Language of the text.

    Raises:
        InvalidValueError: The language is unknown.
    """
    return load_catalogue(language).get(f"limit.{source}", source)


def _link(number: int, writer: _Writer) -> str:
    key = {FLOOR: "floor", TOOL: "tool", PART: "part", 0: "base"}.get(number, "link")
    return writer.translate(f"place.{key}", number=str(number))


def _amounts(row: Condition, value: float, bound: float, writer: _Writer) -> tuple[str, str]:
    """Returns value and bound with units, with as many digits as they need to differ."""
    if writer.units is not None:
        first, second = writer.units.format_numbers(row.unit, value, bound)
        return _with_unit(row, first, writer.units, writer), _with_unit(row, second, writer.units, writer)
    texts = format_pair(value, bound)
    first, second = (_in_unit(row, number, text, writer) for number, text in zip((value, bound), texts, strict=True))
    return first, second


def _amount(row: Condition, value: float, writer: _Writer) -> str:
    if writer.units is not None:
        return _with_unit(row, writer.units.format_numbers(row.unit, value)[0], writer.units, writer)
    return _in_unit(row, value, f"{value:.4g}", writer)


def _with_unit(row: Condition, number: str, units: Units, writer: _Writer) -> str:
    unit = load_catalogue(writer.language).get(f"unit.{row.unit}")
    return units.with_unit(number, row.unit) if unit is None else f"{number} {unit}"


def _in_unit(row: Condition, value: float, text: str, writer: _Writer) -> str:
    if row.unit == "rad" and math.isfinite(value):
        return with_degrees(value, text)
    unit = load_catalogue(writer.language).get(f"unit.{row.unit}", row.unit)
    return f"{text} {unit}"


def _share(ratio: float, writer: _Writer) -> str:
    if ratio < _FACTOR_FROM:
        return writer.translate("share.percent", number=f"{100.0 * ratio:.1f}")
    return writer.translate("share.times", number=factor_text(ratio))
