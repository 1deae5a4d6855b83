"""Texts of reports: one catalogue per language, by key, formatted with values."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from rcilab.i18n import catalogue
from rcilab.i18n.locale import Language, require_language
from rcilab.i18n.units import USUAL, Units

__all__ = ["Language", "Phrase", "load_catalogue", "translate"]


class Phrase(str):
    """An English text that also exists in the other languages.

    Args:
        key: Key of the text in the catalogues.
        values: Values of its placeholders.
    """

    key: str
    values: Mapping[str, object]

    def __new__(cls, key: str, **values: object) -> Phrase:  # noqa: D102  # See the class.
        phrase = super().__new__(cls, translate("en", key, **values))
        phrase.key, phrase.values = key, MappingProxyType(values)
        return phrase

    def text(self, language: Language, units: Units = USUAL) -> str:
        """Returns the text in a language, with angles and lengths in `units`."""
        return format_text(language, self.key, self.values, units)


def translate(language: Language, key: str, **values: object) -> str:
    """Returns a text in a language, with its values.

    Raises:
        InvalidValueError: The language has no catalogue; the message lists those that have one.
    """
    return format_text(language, key, values, USUAL)


def format_text(language: Language, key: str, values: Mapping[str, object], units: Units) -> str:
    """Returns a text in a language, with angles and lengths in `units`."""
    return units.fill(load_catalogue(require_language(language))[key], values)


def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all texts of a language by key: those of the engine, and of every maker's faults and conditions."""
    return catalogue.merge_catalogues(("rcilab.conformance", *catalogue.MAKERS), language)
