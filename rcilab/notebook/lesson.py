"""What the lessons share: the language they are read in, and the word on an exercise."""

from __future__ import annotations

from rcilab.i18n.locale import Language
from rcilab.i18n.notebook_language import language

__all__ = ["answer", "language"]

_WORDS: dict[Language, tuple[str, str]] = {"en": ("not yet", "right"), "zh": ("还没有", "正确")}


def answer(is_right: bool, fact: str) -> None:
    """Prints whether an exercise is solved, in the reader's language, and the number that decided it.

    Args:
        is_right: Whether it is.
        fact: What was found, in symbols and units, so that it needs no translation: "T = 1.952 s".
    """
    word = _WORDS[language()][bool(is_right)]
    print(f"{'✓' if is_right else '✗'} {word}: {fact}")
