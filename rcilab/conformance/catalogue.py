"""Words of explanations: one catalogue a language, found by key, filled with values."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType
from typing import Literal, TypeAlias, get_args

from rcilab.errors import InvalidValueError

Language: TypeAlias = Literal["en", "zh"]
"""English or Chinese."""


class Phrase(str):
    """English words that can also be said in the other languages.

    Args:
        key: Of the sentence in the catalogues.
        values: What it is filled with.
    """

    key: str
    values: Mapping[str, str]

    def __new__(cls, key: str, **values: str) -> Phrase:  # noqa: D102  # The class says it.
        phrase = super().__new__(cls, say("en", key, **values))
        phrase.key, phrase.values = key, MappingProxyType(values)
        return phrase

    def text(self, language: Language) -> str:
        """Returns the words in a language."""
        return say(language, self.key, **self.values)


def say(language: Language, key: str, **values: str) -> str:
    """Returns a sentence in a language, filled with values.

    Raises:
        InvalidValueError: There is no catalogue for this language; the message lists those that exist.
    """
    if language not in get_args(Language):
        raise InvalidValueError("language", language, f"is unknown; known: {', '.join(get_args(Language))}")
    return load_catalogue(language)[key].format(**values)


@lru_cache
def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all sentences of one language, by key."""
    path = files("rcilab.conformance") / "catalogues" / f"{language}.json"
    return MappingProxyType(json.loads(path.read_text(encoding="utf-8")))
