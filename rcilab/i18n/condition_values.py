"""Values and units of conditions as text, in the units of the user."""

from __future__ import annotations

from rcilab.i18n.translator import Text


def unit_name(unit: str, text: Text) -> str:
    """Returns the displayed name of an SI unit; a unit that is a word in the language of `text`."""
    return text("unit.cycles") if unit == "cycles" else text.units.from_si(unit)[1]


def with_unit(numbers: str, unit: str, text: Text) -> str:
    """Returns numbers from `Units.format_numbers` with their unit.

    Args:
        numbers: The converted numbers.
        unit: Their SI unit before the conversion.
        text: Language and units of the user.
    """
    return f"{numbers} {text('unit.cycles')}" if unit == "cycles" else text.units.with_unit(numbers, unit)


def value_against_bound(value: float, bound: float, unit: str, text: Text) -> str:
    """Returns a value and its bound, both given in an SI unit, as text such as "-62.2 / -124.6°/s"."""
    return with_unit(" / ".join(text.units.format_numbers(unit, value, bound)), unit, text)
