"""Units in which angles and lengths are shown and typed: the only conversion for users.

Values of messages are in SI. A variable of a catalogue states its unit and its digits: `{angle:rad.1f}` becomes 12.3°
or 0.215 rad. `{deg:2.9}` and `{mm/s:250}` are constants in the text. Fields are in degrees and millimetres.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Literal, cast

from rcilab.i18n.rounding import format_fixed

AngleUnit = Literal["deg", "rad"]
LengthUnit = Literal["mm", "m"]

ANGLES: tuple[AngleUnit, ...] = ("deg", "rad")
LENGTHS: tuple[LengthUnit, ...] = ("mm", "m")

_MORE_DIGITS = {"rad": 2, "m": 3}
"""Additional decimals that the larger unit needs for the same resolution."""
_FIXED = {
    "deg": ("rad", math.pi / 180.0),
    "mm": ("m", 1e-3),
    "deg/s": ("rad/s", math.pi / 180.0),
    "mm/s": ("m/s", 1e-3),
    "rad/s²": ("rad/s^2", 1.0),
}
"""Units of constants in the text: SI unit, and the factor to it."""


@dataclass(frozen=True)
class Unit:
    """The unit shown for degrees or millimetres, or for a rate of them."""

    name: str
    """deg, rad, mm or m, or such as rad/s²."""
    factor: float
    """One degree, or one millimetre, in this unit."""

    def convert(self, number: str) -> str:
        """Converts the text of a number in the usual unit to this unit; any other text is unchanged."""
        if self.factor == 1.0:
            return number
        try:
            value = float(number)
        except ValueError:
            return number
        if self.name not in _MORE_DIGITS:  # A rate.
            return f"{self.factor * value:g}"
        return format_fixed(self.factor * value, len(number.partition(".")[2]) + _MORE_DIGITS[self.name])

    def complete(self, typed: str) -> str:
        """Appends this unit to a typed number, unless it is the usual unit or a unit was typed."""
        has_unit = "/" in typed or not typed.strip()[-1:].isdecimal()
        return typed if self.factor == 1.0 or has_unit else f"{typed.strip()} {self.name}"


@dataclass(frozen=True)
class Units:
    """The units of a page."""

    angle: AngleUnit = "deg"
    length: LengthUnit = "mm"

    def unit(self, usual: str) -> Unit:
        """Returns the unit shown for "deg" or "mm", or a rate such as "°/s"; any other unit is unchanged."""
        base, per, time = usual.partition("/")
        if base in ("deg", "°") and self.angle == "rad":
            return Unit(f"rad{per}{time}", math.pi / 180.0)
        if base == "mm" and self.length == "m":
            return Unit(f"m{per}{time}", 1e-3)
        return Unit(usual, 1.0)

    def format_angle(self, angle: float, digits: int = 1) -> str:
        """Returns an angle with its unit, such as "12.3°" or "0.215 rad".

        Args:
            angle: [rad].
            digits: Decimals in degrees; radians get two more.
        """
        return self._shown(math.degrees(angle), "deg", digits)

    def format_length(self, length: float, digits: int = 0) -> str:
        """Returns a length with its unit, such as "42 mm" or "0.042 m".

        Args:
            length: [m].
            digits: Decimals in millimetres; metres get three more.
        """
        return self._shown(1000.0 * length, "mm", digits)

    def from_si(self, unit: str) -> tuple[float, str]:
        """Returns factor and name of the unit shown for an SI unit: 57.3 and °/s² for rad/s^2."""
        raised = unit.replace("^2", "²").replace("^3", "³").replace("N m", "N·m")
        if raised == "rad" or raised.startswith("rad/"):
            return (math.degrees(1.0), "°" + raised[3:]) if self.angle == "deg" else (1.0, raised)
        if raised == "m" or raised.startswith("m/"):
            return (1000.0, "m" + raised) if self.length == "mm" else (1.0, raised)
        return 1.0, raised

    def format_numbers(self, unit: str, *values: float) -> tuple[str, ...]:
        """Converts numbers from an SI unit and formats them with the fewest digits that show which of them differ.

        Args:
            unit: SI unit, such as rad/s^2; units other than of angle and length are not converted.
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
        """Appends the unit shown for an SI unit to the result of `numbers`."""
        return _with_unit(numbers, self.from_si(unit)[1])

    def fill(self, entry: str, values: Mapping[str, object] = MappingProxyType({})) -> str:
        """Fills in the variables of a catalogue entry; angles and lengths are in SI."""
        if "{" not in entry:
            return entry
        return entry.format(**{**_names(self), **{name: _Value(value, self) for name, value in values.items()}})

    def format(self, value: object, spec: str) -> str:
        """Formats one or several numbers with their unit.

        Args:
            value: A number in the SI unit, or a sequence of numbers; a pair inside a sequence is a range.
            spec: Unit, point and digits, such as "rad.1f", "m/s.3g" or "m.1z" (at most 1 decimal). The digits apply
                to degrees and millimetres; radians and metres get more. A "#" at the end omits the unit.
        """
        unit, _, form = spec.partition(".")
        numbers = self._digits(value, unit, form.rstrip("#"))
        return numbers if form.endswith("#") else _with_unit(numbers, _scale(self, unit)[1])

    def _digits(self, value: object, unit: str, form: str, between: str = ", ") -> str:
        if isinstance(value, (tuple, list)):
            return between.join(self._digits(one, unit, form, "…") for one in value)
        number, usual, factor = float(cast(float, value)), _scale(USUAL, unit)[0], _scale(self, unit)[0]
        text = _format_number(usual * number, form)
        if factor == usual or not math.isfinite(number):
            return text
        if "e" in text:
            return f"{factor * number:.3g}"
        return format_fixed(factor * number, len(text.partition(".")[2]) + _MORE_DIGITS[unit.partition("/")[0]])

    def _shown(self, value: float, usual: str, digits: int) -> str:
        unit = self.unit(usual)
        return _with_unit(format_fixed(unit.factor * value, digits + _MORE_DIGITS.get(unit.name, 0)), _sign(unit))


USUAL = Units()
"""Degrees and millimetres."""
SI = Units(angle="rad", length="m")

_EXPONENT = re.compile(r"(\d[\d.]*)e([+-]\d+)")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LARGE = 1e7
"""From this value on, numbers have an exponent."""


def plain_number(value: float, digits: int = 4) -> str:
    """Formats a number with significant digits; an exponent only below 1e-4 and from `_LARGE` on."""
    text = f"{value + 0.0:.{digits}g}"  # No "-0".
    if "e" not in text or not math.isfinite(value):
        return text
    if 1.0 <= abs(value) < _LARGE:
        return f"{value:.0f}"
    return f"{value:.1e}" if digits <= 4 else text


def _as_power(found: re.Match[str]) -> str:
    power = str(int(found[2])).translate(_RAISED)
    return f"10{power}" if float(found[1]) == 1.0 else f"{found[1]}·10{power}"


def _format_number(value: float, form: str) -> str:
    digits, kind = int(form[:-1]), form[-1]
    if kind == "g":
        return f"{value + 0.0:.{digits}g}"
    text = format_fixed(value, digits)
    return text.rstrip("0").rstrip(".") if kind == "z" and digits else text


def _sign(unit: Unit) -> str:
    return "°" if unit.name == "deg" else unit.name


def _with_unit(text: str, name: str) -> str:
    return f"{text}{name}" if name.startswith("°") else f"{text} {name}".rstrip()


@dataclass(frozen=True, slots=True)
class _Value:
    """A value of a message: `{name:rad.1f}` formats a number in the units of the user; text is unchanged."""

    value: object
    units: Units

    def __format__(self, spec: str) -> str:
        if spec[:1] not in ("r", "m"):
            return format(self.value, spec)
        return self.value if isinstance(self.value, str) else self.units.format(self.value, spec)


@dataclass(frozen=True, slots=True)
class _FixedNumber:
    """A constant in the text: `{deg:2.9}`."""

    unit: str
    scale: float
    units: Units

    def __format__(self, spec: str) -> str:
        return self.units.format(self.scale * float(spec), f"{self.unit}.{len(spec.partition('.')[2])}f")


@lru_cache
def _scale(units: Units, unit: str) -> tuple[float, str]:
    """Caches `Units.from_si`: the page fills hundreds of texts per second."""
    return units.from_si(unit)


@lru_cache
def _names(units: Units) -> Mapping[str, object]:
    """Returns the variables that every text can use."""
    fixed_numbers = {name: _FixedNumber(unit, scale, units) for name, (unit, scale) in _FIXED.items()}
    return MappingProxyType({"in_deg": units.angle, "in_mm": units.length, **fixed_numbers})
