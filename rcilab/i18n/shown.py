"""Numbers and units of conditions as people read them, in the units of the face."""

from __future__ import annotations

from rcilab.i18n.translator import Text


def unit_name(unit: str, text: Text) -> str:
    """Returns what an SI unit is shown as; a unit that is a word, in the language of the text."""
    return text("unit.cycles") if unit == "cycles" else text.units.from_si(unit)[1]


def with_unit(numbers: str, unit: str, text: Text) -> str:
    """Returns what `Units.numbers` has made of an SI unit, and its unit behind."""
    return f"{numbers} {text('unit.cycles')}" if unit == "cycles" else text.units.with_unit(numbers, unit)


def value_against_bound(value: float, bound: float, unit: str, text: Text) -> str:
    """Returns a value and its bound, both of an SI unit, such as "-62.2 / -124.6°/s"."""
    return with_unit(" / ".join(text.units.numbers(unit, value, bound)), unit, text)
