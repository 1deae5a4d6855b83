"""What every catalogue of sentences must keep: the same keys and the same places to fill in every language."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable, Mapping


def fields(entry: str) -> set[str]:
    """The places to fill in an entry."""
    return {name for _, name, _, _ in string.Formatter().parse(entry) if name}


def require_equal(load: Callable[[str], Mapping[str, str]], languages: Iterable[str]) -> None:
    """Fails where a language lacks a key, has one too many, or fills other places than English."""
    english = load("en")
    for language in languages:
        catalogue = load(language)
        assert set(catalogue) == set(english), language
        for key, entry in catalogue.items():
            assert fields(entry) == fields(english[key]), f"{language}: {key}"
            assert entry.strip(), key
