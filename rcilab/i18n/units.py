"""In which units angles and lengths are shown and typed: the one place that converts them for people.

Everything behind the page counts in degrees and millimetres where a person reads or types (fields, messages), and in
rad and m elsewhere. What is chosen in Settings is applied last, when words are made, and first, when a number is read.
What comes as a finished sentence (of a controller, of the gallery) is restated number by number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from rcilab.i18n.rounding import fixed

AngleUnit = Literal["deg", "rad"]
LengthUnit = Literal["mm", "m"]

ANGLES: tuple[AngleUnit, ...] = ("deg", "rad")
LENGTHS: tuple[LengthUnit, ...] = ("mm", "m")

_MORE_DIGITS = {"rad": 2, "m": 3}
"""Digits behind the point that the larger unit needs to say as much."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_N = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
_BOTH = re.compile(rf"({_N}) rad \({_N}°\)")
"""An angle in both units, as reports write it."""
_QUANTITY = re.compile(
    rf"(?P<first>(?:(?<=between )|(?<=from )){_N}(?= (?:and|to) {_N}\s?(?P<ahead>°|deg\b|rad\b|mm\b|m\b)))"
    rf"|(?<![\w.^-])(?P<numbers>{_N}|[\[(]{_N}(?:,? +{_N})+[\])])\s?"
    r"(?P<unit>°|deg|rad|mm|m)(?P<rate>(?:/s(?:[²³]|\^[23])?)?)(?![\w/²³^°])"
)
"""In a finished sentence: a number, or some in brackets, and the unit behind; or the first of two before a unit."""
_SPOKEN = re.compile(r"(\{\w+\}|\d+(?:\.\d+)?)\s?(°|deg\b|mm\b)((?:/s[²³]?)?)")
"""In a catalogue: a place to fill, or a number, and the unit behind it."""


@dataclass(frozen=True)
class Unit:
    """What stands in for degrees or millimetres on this page."""

    name: str
    """deg, rad, mm or m."""
    factor: float
    """How many of it one degree, or one millimetre, is."""

    def restate(self, said: str) -> str:
        """Returns words with every number in them taken over from degrees or millimetres."""
        return said if self.factor == 1.0 else _NUMBER.sub(self._restate, said)

    def complete(self, typed: str) -> str:
        """Returns what was typed with this unit behind it, unless it is the usual one or another was typed."""
        return typed if self.factor == 1.0 or not typed.strip()[-1:].isdigit() else f"{typed.strip()} {self.name}"

    def _restate(self, found: re.Match[str]) -> str:
        said = found.group()
        value = self.factor * float(said)
        if "e" in said:
            return f"{value:.3g}"
        return fixed(value, len(said.partition(".")[2]) + _MORE_DIGITS[self.name])


@dataclass(frozen=True)
class Units:
    """The units of a page."""

    angle: AngleUnit = "deg"
    length: LengthUnit = "mm"

    def unit(self, usual: str) -> Unit:
        """Returns what is shown for "deg" or "mm"; any other unit is shown as it is."""
        if usual in ("deg", "°") and self.angle == "rad":
            return Unit("rad", math.pi / 180.0)
        if usual == "mm" and self.length == "m":
            return Unit("m", 1e-3)
        return Unit(usual, 1.0)

    def angle_of(self, angle: float, digits: int = 1) -> str:
        """Returns an angle with its unit, such as "12.3°" or "0.215 rad".

        Args:
            angle: [rad].
            digits: Behind the point, in degrees; radians get two more.
        """
        return self._shown(math.degrees(angle), "deg", digits)

    def length_of(self, length: float, digits: int = 0) -> str:
        """Returns a length with its unit, such as "42 mm" or "0.042 m".

        Args:
            length: [m].
            digits: Behind the point, in millimetres; metres get three more.
        """
        return self._shown(1000.0 * length, "mm", digits)

    def from_si(self, unit: str) -> tuple[float, str]:
        """Returns how many of its unit on the page one SI unit is, and that one's name: of rad/s^2, 57.3 and °/s²."""
        raised = unit.replace("^2", "²").replace("^3", "³").replace("N m", "N·m")
        if raised == "rad" or raised.startswith("rad/"):
            return (math.degrees(1.0), "°" + raised[3:]) if self.angle == "deg" else (1.0, raised)
        if raised == "m" or raised.startswith("m/"):
            return (1000.0, "m" + raised) if self.length == "mm" else (1.0, raised)
        return 1.0, raised

    def numbers(self, unit: str, *values: float) -> tuple[str, ...]:
        """Returns numbers of an SI unit in that of the page, with as few digits as show which of them differ.

        Args:
            unit: Such as rad/s^2; any unit that is none of an angle or a length stays.
            values: In that unit.
        """
        factor, _ = self.from_si(unit)
        shown = [factor * value for value in values]
        texts = [plain_number(value) for value in shown]
        for digits in range(5, 17):
            if len(set(texts)) == len(set(values)):
                break
            texts = [plain_number(value, digits) for value in shown]
        return tuple(_EXPONENT.sub(_as_power, text) for text in texts)

    def with_unit(self, numbers: str, unit: str) -> str:
        """Returns what `numbers` has made of an SI unit, and its unit on the page behind."""
        return _with_unit(numbers, self.from_si(unit)[1])

    def restate(self, said: str) -> str:
        """Returns a finished sentence of the library with its angles and lengths in these units.

        The library counts in SI, and sometimes says an angle in degrees beside; numbers keep their digits.
        """
        return _QUANTITY.sub(self._restate, _BOTH.sub(r"\1 rad", said))

    def adapt(self, entry: str) -> str:
        """Returns an entry of a catalogue whose places to fill will be shown in these units.

        A catalogue writes a place to fill, or a number, and then °, deg or mm; or {in_deg}, {in_mm} for the bare name.
        """
        if "°" in entry or "mm" in entry or "deg" in entry:
            named = entry.replace("{in_deg}", self.angle).replace("{in_mm}", self.length)
            return named if self == USUAL else _SPOKEN.sub(self._adapt, named)
        return entry

    def values(self, values: Mapping[str, object]) -> Mapping[str, object]:
        """Returns values that fill such an entry."""
        return values if self == USUAL else {name: _Value(value, self) for name, value in values.items()}

    def _shown(self, value: float, usual: str, digits: int) -> str:
        unit = self.unit(usual)
        return _with_unit(fixed(unit.factor * value, digits + _MORE_DIGITS.get(unit.name, 0)), _sign(unit))

    def _restate(self, found: re.Match[str]) -> str:
        unit = found["ahead"] or found["unit"]
        factor, usual = _TO_USUAL[unit]
        to = self.unit(usual)
        if _sign(to) == unit:
            return found.group()
        scale = factor * to.factor
        if found["first"]:
            return _rescale(found["first"], scale)
        numbers = _NUMBER.sub(lambda number: _rescale(number.group(), scale), found["numbers"])
        rate = found["rate"].replace("^2", "²").replace("^3", "³")
        return _with_unit(numbers, _sign(to) + rate)

    def _adapt(self, found: re.Match[str]) -> str:
        said, usual, rate = found.groups()
        unit = self.unit(usual)
        if unit.factor == 1.0:
            return found.group()
        shown = said[:-1] + ":" + unit.name + "}" if said.startswith("{") else unit.restate(said)
        return f"{shown} {unit.name}{rate}"


USUAL = Units()
"""Degrees and millimetres."""

_TO_USUAL = {
    "rad": (math.degrees(1.0), "deg"), "deg": (1.0, "deg"), "°": (1.0, "deg"), "m": (1000.0, "mm"), "mm": (1.0, "mm"),
}  # fmt: skip
"""How many degrees or millimetres one of these is."""
_EXPONENT = re.compile(r"(\d[\d.]*)e([+-]\d+)")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LARGE = 1e7
"""From here on a number has an exponent."""


def plain_number(value: float, digits: int = 4) -> str:
    """Returns a number with so many digits, without an exponent where it can be read without."""
    text = f"{value + 0.0:.{digits}g}"  # No "-0".
    if "e" not in text or not math.isfinite(value):
        return text
    if 1.0 <= abs(value) < _LARGE:
        return f"{value:.0f}"
    return f"{value:.1e}" if digits <= 4 else text


def _as_power(found: re.Match[str]) -> str:
    power = str(int(found[2])).translate(_RAISED)
    return f"10{power}" if float(found[1]) == 1.0 else f"{found[1]}·10{power}"


def _rescale(said: str, scale: float) -> str:
    digits = len(said.partition("e")[0].replace(".", "").lstrip("-0"))
    return plain_number(scale * float(said), max(digits, 3))


def _sign(unit: Unit) -> str:
    return "°" if unit.name == "deg" else unit.name


def _with_unit(text: str, name: str) -> str:
    return f"{text}{name}" if name.startswith("°") else f"{text} {name}".rstrip()


@dataclass(frozen=True, slots=True)
class _Value:
    value: object
    units: Units

    def __format__(self, spec: str) -> str:
        said = str(self.value)
        return self.units.unit({"rad": "deg", "m": "mm"}[spec]).restate(said) if spec else said
