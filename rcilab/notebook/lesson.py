"""Functions of the lessons: the reader's language, and the result of an exercise."""

from __future__ import annotations

from rcilab.i18n.locale import Language
from rcilab.i18n.notebook_language import language

__all__ = ["answer", "language"]

_WORDS: dict[Language, tuple[str, str]] = {"en": ("not yet", "right"), "zh": ("还没有", "正确")}


def answer(is_right: bool, fact: str) -> None:
    """Prints whether an exercise is solved, in the reader's language, and the deciding number.

    Args:
        is_right: Whether it is solved.
        fact: The result, in symbols and units, which need no translation: "T = 1.952 s".
    """
    word = _WORDS[language()][bool(is_right)]
    print(f"{'✓' if is_right else '✗'} {word}: {fact}")
