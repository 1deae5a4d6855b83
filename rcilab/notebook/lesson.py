"""What the lessons share: the language they are read in, and the word on an exercise."""

from __future__ import annotations

from rcilab.conformance.html import report_html
from rcilab.language import Language
from rcilab.notebook.spoken import language, shell
from rcilab.recording.run_html import run_html

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


def _speak() -> None:
    """Has reports and runs shown in the language of the lesson."""
    found, spoken = shell(), language()
    if found is not None and spoken != "en":
        html = found.display_formatter.formatters["text/html"]
        html.for_type_by_name("rcilab.conformance.report", "Report", lambda report: report_html(report, spoken))
        html.for_type_by_name("rcilab.recording.run", "Run", lambda run: run_html(run, spoken))


_speak()  # Every lesson imports this file, and has the same cells in both languages.
