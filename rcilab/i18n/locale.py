"""The languages of the user interfaces."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, TypeAlias, cast

from rcilab.core.errors import InvalidValueError

Language: TypeAlias = Literal["en", "zh"]
"""English or Chinese."""

LANGUAGES: Mapping[str, str] = MappingProxyType({"en": "English", "zh": "中文"})
"""Name of each language in that language."""


def require_language(language: str) -> Language:
    """Returns `language` if the user interfaces have it.

    Raises:
        InvalidValueError: They do not; the message lists the languages.
    """
    if language not in LANGUAGES:
        raise InvalidValueError("language", language, f"is unknown; known: {', '.join(LANGUAGES)}")
    return cast(Language, language)
