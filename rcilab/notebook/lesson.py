"""Functions of the lessons: the reader's language, and the result of an exercise."""

from __future__ import annotations

from rcilab.i18n.notebook_language import language
from rcilab.i18n.translator import Text

__all__ = ["answer", "language"]


def answer(is_right: bool, fact: str) -> None:
    """Prints whether an exercise is solved, in the reader's language, and the deciding number.

    Args:
        is_right: Whether it is solved.
        fact: The result, in symbols and units, which need no translation: "T = 1.952 s".
    """
    verdict = Text(language(), "rcilab.notebook")("exercise.right" if is_right else "exercise.wrong")
    print(f"{'✓' if is_right else '✗'} {verdict}: {fact}")
