"""Parsing of typed numbers. The result is a value or a message, never an exception.

viser's own number fields are not used: they turn a typed "-0.25" into "+0.25" and send every key press.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from rcilab.i18n.translator import ComparedValue, Message, message

_AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number whose comma can be a decimal comma or a thousands separator, such as 1,000."""
_RATES = ("/s", "/s²", "/s³")
_UNITS: dict[str, dict[str, float]] = {
    "deg": {"deg": 1.0, "°": 1.0, "rad": math.degrees(1.0)},
    "mm": {"mm": 1.0, "m": 1000.0},
    **{f"°{per}": {f"°{per}": 1.0, f"deg{per}": 1.0, f"rad{per}": math.degrees(1.0)} for per in _RATES},
    **{f"mm{per}": {f"mm{per}": 1.0, f"m{per}": 1000.0} for per in _RATES},
}
"""Units accepted after a number, by the field's unit, each in the field's unit; longer names first."""
_SHOWN = 5e-4  # Part of a bound by which what is shown of it may be rounded.
_MAX_LENGTH = 40  # Characters; longer than any number in normal use.


@dataclass(frozen=True)
class Parsed:
    """A number, or the reason why the text is not a valid one."""

    value: float | None
    problem: Message | None = None


def parse_number(
    typed: str, low: float, high: float, unit: str, *, soft_low: bool = False, soft_high: bool = False
) -> Parsed:
    """Returns the number in a typed text.

    Accepts a decimal comma, a typographic minus sign, and a unit after the number, from which it is converted. An
    ambiguous comma is rejected with a message that lists both readings.

    Args:
        typed: Content of the field.
        low: Smallest number allowed, in the unit of the field.
        high: Largest number allowed.
        unit: The unit of the field, such as "deg".
        soft_low: Whether `low` is a soft limit of a joint.
        soft_high: Whether `high` is one.
    """
    shown = typed.strip()
    shown = shown if len(shown) <= _MAX_LENGTH else shown[: _MAX_LENGTH - 1] + "…"
    plain = typed.strip()[: 10 * _MAX_LENGTH].replace("−", "-").replace("–", "-")
    plain = plain.replace("^2", "²").replace("^3", "³")
    suffix = next((name for name in _UNITS.get(unit, {unit: 1.0}) if name and plain.endswith(name)), "")
    plain = plain.removesuffix(suffix).strip()
    if not plain:
        return Parsed(None, message("parse.empty", bounds=_bounds(low, high, unit)))
    if _AMBIGUOUS.fullmatch(plain):
        return Parsed(
            None, message("parse.two_ways", typed=shown, point=plain.replace(",", "."), whole=plain.replace(",", ""))
        )
    if plain.count(",") == 1 and "." not in plain:
        plain = plain.replace(",", ".")
    try:
        if "_" in plain:
            raise ValueError
        value = float(plain)
    except ValueError:
        return Parsed(None, message("parse.garbage", typed=shown, unit=unit))
    if not math.isfinite(value):
        return Parsed(None, message("parse.not_finite", typed=shown, unit=unit))
    value = _at_shown_end(value * _UNITS.get(unit, {}).get(suffix, 1.0), low, high)
    if (soft_low and value < low) or (soft_high and value > high):
        limit = math.radians(low if value < low else high)
        return Parsed(None, message("parse.range_soft", typed=shown, bounds=_bounds(low, high, unit), limit=limit))
    if not low <= value <= high:
        return Parsed(None, message("parse.range", typed=shown, bounds=_bounds(low, high, unit)))
    return Parsed(value)


def _at_shown_end(value: float, low: float, high: float) -> float:
    """Returns a number, or the bound if it is beyond it by no more than the rounding of what is shown of a bound."""
    if low - _SHOWN * max(1.0, abs(low)) <= value < low:
        return low
    return high if high < value <= high + _SHOWN * max(1.0, abs(high)) else value


def _bounds(low: float, high: float, unit: str) -> Message:
    if not unit:
        return message("parse.bounds.plain", low=format_short(low), high=format_short(high))
    if unit not in _UNITS:
        return message("parse.bounds", low=format_short(low), high=format_short(high), unit=unit)
    angle = unit.startswith(("deg", "°"))
    scale = math.pi / 180.0 if angle else 1e-3
    if "/" in unit:
        rate = ("rad" if angle else "m") + unit[unit.index("/") :]
        ends = scale * low, scale * high
        shown = (ComparedValue(end, other, rate) for end, other in (ends, ends[::-1]))
        return message("parse.bounds.plain", low=next(shown), high=next(shown))
    return message(f"parse.bounds.{unit}", low=scale * low, high=scale * high)


@dataclass(frozen=True)
class ParsedQuaternion:
    """A unit quaternion, wxyz, or the reason why the text is not a valid one."""

    value: tuple[float, ...] | None
    problem: Message | None = None


def parse_quaternion(typed: str) -> ParsedQuaternion:
    """Returns the orientation typed as four numbers w x y z, normalised.

    The separators are blanks, semicolons or commas; decimal commas are accepted only with blanks or semicolons.
    """
    plain = typed.strip()[: 8 * _MAX_LENGTH].strip("()[]{} ")
    parts = [part.rstrip(",") for part in re.split(r"[\s;]+", plain) if part.strip(",")]
    if len(parts) == 1:
        parts = [part for part in plain.split(",") if part]
    if len(parts) != 4:
        return ParsedQuaternion(None, message("parse.quaternion", count=len(parts)))
    numbers: list[float] = []
    for part in parts:
        parsed = parse_number(part, -1e6, 1e6, "")
        if parsed.value is None:
            return ParsedQuaternion(None, parsed.problem)
        numbers.append(parsed.value)
    length = math.hypot(*numbers)
    if length < 1e-6:
        return ParsedQuaternion(None, message("parse.no_turn"))
    return ParsedQuaternion(tuple(number / length for number in numbers))


def format_short(number: float) -> str:
    """Returns a number with at most three digits after the point, without trailing zeros."""
    return f"{number:.3f}".rstrip("0").rstrip(".")
