"""Sentences of explanations: one catalogue for each language, found by key, filled with values."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from rcilab.i18n import catalogue
from rcilab.i18n.locale import Language, require_language
from rcilab.i18n.units import USUAL, Units

__all__ = ["Language", "Phrase", "load_catalogue", "say"]


class Phrase(str):
    """An English sentence that also exists in the other languages.

    Args:
        key: Of the sentence in the catalogues.
        values: What it is filled with.
    """

    key: str
    values: Mapping[str, object]

    def __new__(cls, key: str, **values: object) -> Phrase:  # noqa: D102  # The class says it.
        phrase = super().__new__(cls, say("en", key, **values))
        phrase.key, phrase.values = key, MappingProxyType(values)
        return phrase

    def text(self, language: Language, units: Units = USUAL) -> str:
        """Returns the text in a language, with angles and lengths in these units."""
        return fill(language, self.key, self.values, units)


def say(language: Language, key: str, **values: object) -> str:
    """Returns a sentence in a language, filled with values.

    Raises:
        InvalidValueError: There is no catalogue for this language; the message lists those that exist.
    """
    return fill(language, key, values, USUAL)


def fill(language: Language, key: str, values: Mapping[str, object], units: Units) -> str:
    """Returns the same with angles and lengths in these units."""
    return units.fill(load_catalogue(require_language(language))[key], values)


def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all sentences of one language by key: those of the engine, and of every maker on its faults and rows."""
    return catalogue.merge_catalogues(("rcilab.conformance", *catalogue.MAKERS), language)
