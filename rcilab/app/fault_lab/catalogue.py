"""Words of the gallery: one catalogue a language."""

from __future__ import annotations

from collections.abc import Mapping

from rcilab.i18n import catalogue
from rcilab.i18n.locale import Language, require_language
from rcilab.i18n.units import USUAL, Units


def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all sentences of one language, by key."""
    return catalogue.load_catalogue("rcilab.app.fault_lab", language)


def say(language: Language, key: str, units: Units = USUAL, **values: object) -> str:
    """Returns a sentence in a language, filled with values, angles and lengths in these units.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """
    return units.fill(load_catalogue(require_language(language))[key], values)
