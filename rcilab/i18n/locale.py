"""The languages of the user interfaces."""

from __future__ import annotations

from collections.abc import Mapping
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
        InvalidValueError: It does not exist; the message lists those that do.
    """
    if language not in LANGUAGES:
        raise InvalidValueError("language", language, f"is unknown; known: {', '.join(LANGUAGES)}")
    return cast(Language, language)
