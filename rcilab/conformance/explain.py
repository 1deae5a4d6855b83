"""Reports in whole sentences, in English and Chinese: what, where, when, by how much, which fault, what to do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rcilab.conformance.catalogue import Language, Phrase, load_catalogue, say
from rcilab.conformance.condition import Condition
from rcilab.conformance.report import LISTED, ConditionResult, Report, Violation
from rcilab.conformance.wording import amount, with_degrees
from rcilab.language import require_language

if TYPE_CHECKING:
    from rcilab.conformance.slow_down import SlowDown

_TIMES = 10.0
"""From this share of a bound on it is told as a factor, not in percent."""


def explain_report(report: Report, language: Language = "en") -> str:
    """Returns a report in sentences, a line each: the verdict, what is broken, what a slow-down does.

    Raises:
        InvalidValueError: There is no such language.
    """
    lines = [explain_verdict(report, language)]
    found = (*report.violations, *report.warnings)
    lines += [f"- {explain_violation(violation, language)}" for violation in found[:LISTED]]
    if len(found) > LISTED:
        lines.append(f"- {say(language, 'verdict.more', count=str(len(found) - LISTED))}")
    if not report.ok:
        lines.append(explain_slow_down(report.slow_down(), language))
    return "\n".join(lines)


def explain_violation(violation: Violation, language: Language = "en") -> str:
    """Returns a violation of any condition in sentences: the fact, the fault, the remedy.

    Raises:
        InvalidValueError: There is no such language.
    """
    row = violation.condition
    stop = say(language, "stop")
    sentences = (_fact(violation, language) + _when(violation, language) + stop, _fault(row, language))
    advice = violation.advice.text(language) if isinstance(violation.advice, Phrase) else violation.advice
    return say(language, "gap").join((*sentences, say(language, "remedy", advice=advice)))


def explain_source(condition: Condition, language: Language = "en") -> str:
    """Returns where a condition and its bound come from; as it was written where nobody has translated it.

    Raises:
        InvalidValueError: There is no such language.
    """
    return load_catalogue(require_language(language)).get(f"source.{condition.source}", condition.source)


def explain_slow_down(result: SlowDown, language: Language = "en") -> str:
    """Returns what a slow-down does to a motion, in a sentence.

    Raises:
        InvalidValueError: There is no such language.
    """
    row = result.decisive
    at_most = f"{result.at_most:g}"
    if row is None:
        text = say(language, "slow_down.none")
    else:
        place, what = explain_place(row, language), explain_quantity(row.condition, language)
        if result.obstacle is not None:
            time = f"{row.time / (1.0 if result.obstacle == 'position' else result.at_most):.3f}"
            key = f"slow_down.{result.obstacle}"
            return say(language, key, place=place, quantity=what, at_most=at_most, time=time)
        assert result.factor is not None
        assert result.motion is not None
        text = say(
            language,
            "slow_down.passes",
            factor=f"{result.factor:.4g}",
            duration=f"{result.motion.duration:.3f}",
            before=f"{result.before.duration:.3f}",
            place=place,
            quantity=what,
        )
    if not result.unmet:
        return text
    names = say(language, "comma").join(explain_quantity(row, language) for row in result.unmet)
    return say(language, "gap").join((text, say(language, "slow_down.warned", at_most=at_most, quantities=names)))


def explain_verdict(report: Report, language: Language = "en") -> str:
    """Returns the verdict of a report in a sentence or two.

    Raises:
        InvalidValueError: There is no such language.
    """
    if not report.ok:
        is_noticed = any(violation.fault is not None for violation in report.violations)
        key = "verdict.broken" if is_noticed else "verdict.collides"
        parts = [say(language, key, count=str(len(report.violations)))]
    else:
        parts = [say(language, "verdict.ok"), _nearest(report.worst, language)]
    if report.warnings:
        parts.append(say(language, "verdict.warned", count=str(len(report.warnings))))
    return say(language, "gap").join(parts)


def _nearest(row: ConditionResult, language: Language) -> str:
    """Returns how near an accepted motion comes to a bound."""
    time = f"{row.time:.3f}"
    if row.condition.signal == "position":
        return say(language, "verdict.deepest", depth=f"{max(-row.value, 0.0):.4g}", time=time)
    if row.condition.signal == "frame":
        return say(language, "verdict.singular", share=_share(row.ratio, language), time=time)
    if row.condition.is_clearance:
        place = explain_place(row, language)
        return say(language, "verdict.clearest", place=place, distance=f"{row.value:.4g}", time=time)
    value, bound = _amounts(row.condition, row.value, row.bound, language)
    return say(
        language,
        "verdict.nearest",
        place=explain_place(row, language),
        quantity=explain_quantity(row.condition, language),
        value=value,
        bound=bound,
        share=_share(row.ratio, language),
        time=time,
    )


def _fact(violation: Violation, language: Language) -> str:
    """Returns what is broken, where and by how much."""
    row = violation.condition
    place, quantity = explain_place(violation, language), explain_quantity(row, language)
    if row.signal == "frame":
        return say(language, "fact.frame", place=place, quantity=quantity)
    value, bound = _amounts(row, violation.value, violation.bound, language)
    if row.signal == "elbow_sign":
        return say(language, "fact.elbow_sign", place=place, quantity=quantity, value=value)
    if row.signal == "position":
        return say(language, "fact.box", place=place, quantity=quantity, value=value)
    if row.is_clearance:
        key = "fact.overlap" if violation.value < 0.0 else "fact.clearance"
        depth = _one(row, abs(violation.value), language)
        return say(language, key, place=place, quantity=quantity, value=value, bound=bound, depth=depth)
    if row.stage != "throughout":
        limit = _one(row, abs(violation.bound), language)
        return say(language, "fact.rest", place=place, quantity=quantity, value=value, bound=limit)
    excess = _one(row, abs(violation.value - violation.bound), language)
    text = say(language, "fact.bound", place=place, quantity=quantity, value=value, bound=bound, excess=excess)
    if row.order == 0 and row.unit == "rad":  # A share of a range says nothing: zero may be anywhere in it.
        return text
    return text + say(language, "fact.share", share=_share(violation.ratio, language))


def _when(violation: Violation, language: Language) -> str:
    if violation.condition.stage != "throughout":
        return ""
    time, worst = f"{violation.time:.3f}", f"{violation.worst_time:.3f}"
    if violation.count == 1:
        return say(language, "when.once", time=time)
    return say(language, "when.lasting", time=time, worst=worst, count=str(violation.count))


def _fault(row: Condition, language: Language) -> str:
    if row.fault is None:
        return say(language, "raises.nothing" if row.necessity == "recommended" else "raises.unnoticed")
    cause = say(language, f"fault.{row.fault.name}")
    return say(language, "raises.fault", fault=row.fault.manual_name, cause=cause)


def explain_place(found: ConditionResult | Violation, language: Language = "en") -> str:
    """Returns whose value it is: "joint 2", "tool", "base and link 5".

    Raises:
        InvalidValueError: There is no such language.
    """
    row, axis = found.condition, str(found.joint)
    if found.links is not None:
        first, second = (_link(number, language) for number in found.links)
        return say(language, "place.pair", first=first, second=second)
    return say(language, f"place.{'joint' if row.is_per_joint else row.place(found.joint)}", axis=axis)


def _link(number: int, language: Language) -> str:
    from rcilab.kinematics.collision import FLOOR, TOOL

    key = {FLOOR: "floor", TOOL: "tool", 0: "base"}.get(number, "link")
    return say(language, f"place.{key}", number=str(number))


def explain_quantity(row: Condition, language: Language = "en") -> str:
    """Returns what a condition judges.

    Raises:
        InvalidValueError: There is no such language.
    """
    return load_catalogue(language).get(f"quantity.{row.id}", row.quantity)


def _amounts(row: Condition, value: float, bound: float, language: Language) -> tuple[str, str]:
    """Returns value and bound with units, with as few digits as show that they differ."""
    texts = amount(value, bound)
    first, second = (_in_unit(row, number, text, language) for number, text in zip((value, bound), texts, strict=True))
    return first, second


def _one(row: Condition, value: float, language: Language) -> str:
    return _in_unit(row, value, f"{value:.4g}", language)


def _in_unit(row: Condition, value: float, text: str, language: Language) -> str:
    if row.unit == "rad" and math.isfinite(value):
        return with_degrees(value, text)
    unit = load_catalogue(language).get(f"unit.{row.unit}", row.unit)
    return f"{text} {unit}"


def _share(ratio: float, language: Language) -> str:
    if ratio < _TIMES:
        return say(language, "share.percent", number=f"{100.0 * ratio:.1f}")
    return say(language, "share.times", number=f"{ratio:.0f}")
