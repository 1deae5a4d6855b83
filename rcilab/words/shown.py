"""Numbers and units as people read them."""

from __future__ import annotations

from rcilab.words.text import Text


def pretty_unit(unit: str, text: Text) -> str:
    """Returns a unit with raised digits; a unit that is a word, in the language of the text."""
    return text("unit.cycles") if unit == "cycles" else unit.replace("^2", "²").replace("^3", "³")


def number(value: float) -> str:
    """Returns a number with four digits, without an exponent where it can be read without."""
    size = abs(value)
    return f"{value:.0f}" if size >= 1000.0 else f"{value:.4g}" if size >= 1e-3 or size == 0.0 else f"{value:.1e}"
