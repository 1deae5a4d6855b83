"""Reports in whole sentences, in English and Chinese: what, where, when, by how much, which fault, what to do."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

from rcilab.conformance.advice import with_degrees
from rcilab.conformance.catalogue import Language, Phrase, load_catalogue, say
from rcilab.core.clearance import FLOOR, TOOL
from rcilab.core.condition import Condition
from rcilab.i18n.rounding import format_pair
from rcilab.i18n.units import USUAL, Units

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report, Violation
    from rcilab.conformance.time_scaling import SlowDown

LISTED = 8  # Violations in full in a report: a thousand sentences are of no use.

_TIMES = 10.0
"""From this share of a bound on it is written as a factor, not in percent."""


@dataclass(frozen=True, slots=True)
class _Voice:
    """Language and units of the sentences; without units SI, with degrees next to radians."""

    language: Language
    units: Units | None = None

    def say(self, key: str, **values: str) -> str:
        return say(self.language, key, **values)

    def join(self, *sentences: str) -> str:
        """Returns sentences one after the other."""
        return reduce(lambda first, second: self.say("sentences", first=first, second=second), sentences)


def explain_report(
    report: Report, language: Language = "en", units: Units | None = None, slowed: SlowDown | None = None
) -> str:
    """Returns a report in sentences, a line each: the verdict, what is broken, what a slow-down does.

    Args:
        report: What to explain.
        language: "en" is English, "zh" Chinese.
        units: Units of angles and lengths; None is SI, with degrees next to radians.
        slowed: The result of `report.slow_down`, where it is known already: the search takes the longest.

    Raises:
        InvalidValueError: There is no such language.
    """
    voice = _Voice(language, units)
    lines = [explain_verdict(report, language, units)]
    found = (*report.violations, *report.warnings)
    lines += [f"- {explain_violation(violation, language, units)}" for violation in found[:LISTED]]
    if len(found) > LISTED:
        lines.append(f"- {voice.say('verdict.more', count=str(len(found) - LISTED))}")
    if not report.ok:
        lines.append(explain_slow_down(slowed or report.slow_down(), language))
    return "\n".join(lines)


def explain_violation(violation: Violation, language: Language = "en", units: Units | None = None) -> str:
    """Returns a violation of any condition in sentences: the fact, the fault, the remedy.

    Raises:
        InvalidValueError: There is no such language.
    """
    row, voice = violation.condition, _Voice(language, units)
    stop = voice.say("stop")
    sentences = (_fact(violation, voice) + _when(violation, voice) + stop, _fault(row, voice))
    advice = violation.advice
    if isinstance(advice, Phrase):
        advice = advice.text(language, units or USUAL)
    return voice.join(*sentences, voice.say("remedy", advice=advice))


def explain_slow_down(result: SlowDown, language: Language = "en") -> str:
    """Returns what a slow-down does to a motion, in a sentence; angles and lengths are not in it.

    Raises:
        InvalidValueError: There is no such language.
    """
    row, voice = result.decisive, _Voice(language)
    at_most = f"{result.at_most:g}"
    if row is None:
        text = say(language, "slow_down.none")
    else:
        place, what = explain_place(row, language), explain_quantity(row.condition, voice.language)
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
    names = say(language, "comma").join(explain_quantity(row, voice.language) for row in result.unmet)
    return voice.join(text, voice.say("slow_down.warned", at_most=at_most, quantities=names))


def explain_verdict(report: Report, language: Language = "en", units: Units | None = None) -> str:
    """Returns the verdict of a report in a sentence or two.

    Raises:
        InvalidValueError: There is no such language.
    """
    voice = _Voice(language, units)
    if not report.ok:
        is_noticed = any(violation.fault is not None for violation in report.violations)
        key = "verdict.broken" if is_noticed else "verdict.collides"
        parts = [voice.say(key, count=str(len(report.violations)))]
    else:
        parts = [voice.say("verdict.ok"), _nearest(report.worst, voice)]
    if report.warnings:
        parts.append(voice.say("verdict.warned", count=str(len(report.warnings))))
    return voice.join(*parts)


def _nearest(row: ConditionResult, voice: _Voice) -> str:
    """Returns how near an accepted motion comes to a bound."""
    time = f"{row.time:.3f}"
    if row.condition.signal == "position":
        return voice.say("verdict.deepest", depth=_one(row.condition, max(-row.value, 0.0), voice), time=time)
    if row.condition.signal == "frame":
        return voice.say("verdict.singular", share=_share(row.ratio, voice), time=time)
    if row.condition.is_clearance:
        place = explain_place(row, voice.language)
        return voice.say("verdict.clearest", place=place, distance=_one(row.condition, row.value, voice), time=time)
    value, bound = _amounts(row.condition, row.value, row.bound, voice)
    return voice.say(
        "verdict.nearest",
        place=explain_place(row, voice.language),
        quantity=explain_quantity(row.condition, voice.language),
        value=value,
        bound=bound,
        share=_share(row.ratio, voice),
        time=time,
    )


def _fact(violation: Violation, voice: _Voice) -> str:
    """Returns what is broken, where and by how much."""
    row = violation.condition
    place, quantity = explain_place(violation, voice.language), explain_quantity(row, voice.language)
    if row.signal == "frame":
        return voice.say("fact.frame", place=place, quantity=quantity)
    value, bound = _amounts(row, violation.value, violation.bound, voice)
    if row.signal == "elbow_sign":
        return voice.say("fact.elbow_sign", place=place, quantity=quantity, value=value)
    if row.signal == "position":
        return voice.say("fact.box", place=place, quantity=quantity, value=value)
    if row.is_clearance:
        key = "fact.overlap" if violation.value < 0.0 else "fact.clearance"
        depth = _one(row, abs(violation.value), voice)
        return voice.say(key, place=place, quantity=quantity, value=value, bound=bound, depth=depth)
    if row.stage != "throughout":
        limit = _one(row, abs(violation.bound), voice)
        return voice.say("fact.rest", place=place, quantity=quantity, value=value, bound=limit)
    excess = _one(row, abs(violation.value - violation.bound), voice)
    text = voice.say("fact.bound", place=place, quantity=quantity, value=value, bound=bound, excess=excess)
    if row.order == 0 and row.unit == "rad":  # A share of a range says nothing: zero may be anywhere in it.
        return text
    return text + voice.say("fact.share", share=_share(violation.ratio, voice))


def _when(violation: Violation, voice: _Voice) -> str:
    if violation.condition.stage != "throughout":
        return ""
    time, worst = f"{violation.time:.3f}", f"{violation.worst_time:.3f}"
    if violation.count == 1:
        return voice.say("when.once", time=time)
    return voice.say("when.lasting", time=time, worst=worst, count=str(violation.count))


def _fault(row: Condition, voice: _Voice) -> str:
    if row.fault is None:
        return voice.say("raises.nothing" if row.necessity == "recommended" else "raises.unnoticed")
    cause = voice.say(f"fault.{row.fault.key}")
    return voice.say("raises.fault", fault=row.fault.manual_name, cause=cause)


def explain_place(found: ConditionResult | Violation, language: Language = "en") -> str:
    """Returns whose value it is: "joint 2", "tool", "base and link 5".

    Raises:
        InvalidValueError: There is no such language.
    """
    row, axis = found.condition, str(found.joint)
    if found.links is not None:
        first, second = (_link(number, _Voice(language)) for number in found.links)
        return say(language, "place.pair", first=first, second=second)
    return say(language, f"place.{'joint' if row.is_per_joint else row.location(found.joint)}", axis=axis)


def explain_quantity(row: Condition, language: Language = "en") -> str:
    """Returns the quantity of a condition.

    Raises:
        InvalidValueError: There is no such language.
    """
    return load_catalogue(language).get(f"quantity.{row.id}", row.quantity)


def explain_source(row: Condition, language: Language = "en") -> str:
    """Returns where a condition and its bound come from; sources without other words keep their English ones.

    Raises:
        InvalidValueError: There is no such language.
    """
    return load_catalogue(language).get(f"source.{row.source}", row.source)


def explain_formula(row: Condition, language: Language = "en") -> str:
    """Returns what a condition demands; formulas without words in them are the same in every language.

    Raises:
        InvalidValueError: There is no such language.
    """
    return load_catalogue(language).get(f"formula.{row.formula}", row.formula)


def explain_limit(source: str, language: Language = "en") -> str:
    """Returns where a limit was taken from; sources without other words keep their English ones.

    Args:
        source: From `Limits.source`.
        language: Which.

    Raises:
        InvalidValueError: There is no such language.
    """
    return load_catalogue(language).get(f"limit.{source}", source)


def _link(number: int, voice: _Voice) -> str:
    key = {FLOOR: "floor", TOOL: "tool", 0: "base"}.get(number, "link")
    return voice.say(f"place.{key}", number=str(number))


def _amounts(row: Condition, value: float, bound: float, voice: _Voice) -> tuple[str, str]:
    """Returns value and bound with units, with as few digits as show that they differ."""
    if voice.units is not None:
        first, second = voice.units.format_numbers(row.unit, value, bound)
        return _with_unit(row, first, voice.units, voice), _with_unit(row, second, voice.units, voice)
    texts = format_pair(value, bound)
    first, second = (_in_unit(row, number, text, voice) for number, text in zip((value, bound), texts, strict=True))
    return first, second


def _one(row: Condition, value: float, voice: _Voice) -> str:
    if voice.units is not None:
        return _with_unit(row, voice.units.format_numbers(row.unit, value)[0], voice.units, voice)
    return _in_unit(row, value, f"{value:.4g}", voice)


def _with_unit(row: Condition, number: str, units: Units, voice: _Voice) -> str:
    unit = load_catalogue(voice.language).get(f"unit.{row.unit}")
    return units.with_unit(number, row.unit) if unit is None else f"{number} {unit}"


def _in_unit(row: Condition, value: float, text: str, voice: _Voice) -> str:
    if row.unit == "rad" and math.isfinite(value):
        return with_degrees(value, text)
    unit = load_catalogue(voice.language).get(f"unit.{row.unit}", row.unit)
    return f"{text} {unit}"


def _share(ratio: float, voice: _Voice) -> str:
    if ratio < _TIMES:
        return voice.say("share.percent", number=f"{100.0 * ratio:.1f}")
    return voice.say("share.times", number=f"{ratio:.0f}")
