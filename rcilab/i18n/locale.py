"""The languages people are spoken to in, and the catalogues of words that parts of the package bring along."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType
from typing import Literal, TypeAlias, cast

from rcilab.core.errors import InvalidValueError

Language: TypeAlias = Literal["en", "zh"]
"""English or Chinese."""

LANGUAGES: Mapping[str, str] = MappingProxyType({"en": "English", "zh": "中文"})
"""What each calls itself."""


def require_language(language: str) -> Language:
    """Returns the language if there is one of this name.

    Raises:
        InvalidValueError: There is none; the message lists those that exist.
    """
    if language not in LANGUAGES:
        raise InvalidValueError("language", language, f"is unknown; known: {', '.join(LANGUAGES)}")
    return cast(Language, language)


@lru_cache
def load_words(package: str, language: Language) -> Mapping[str, str]:
    """Returns all entries of one language by key: `catalogues/LANGUAGE.json` of a package, such as rcilab.app."""
    path = files(package) / "catalogues" / f"{language}.json"
    return MappingProxyType(json.loads(path.read_text(encoding="utf-8")))
