"""What the lessons share: the language they are read in, and the word on an exercise."""

from __future__ import annotations

import os
import sys
from typing import Any

from rcilab.conformance.html import report_html
from rcilab.language import Language

_SESSION = "JPY_SESSION_NAME"
"""Where Jupyter's server leaves the name of a kernel's notebook."""
_CODE_FILE = "__vsc_ipynb_file__"
"""Where VS Code leaves it, among the variables of the notebook."""

_WORDS: dict[Language, tuple[str, str]] = {"en": ("not yet", "right"), "zh": ("还没有", "正确")}


def language() -> Language:
    """Returns the language of the notebook that runs here: Chinese when it is named `*.zh.ipynb`, else English.

    A lesson has the same code in both languages, so it asks: `print(report.explain(language()))`. Where the name of
    the notebook is not known, it is English.
    """
    return "zh" if ".zh.ipynb" in os.environ.get(_SESSION, "") + _name_in_code() else "en"


def answer(is_right: bool, fact: str) -> None:
    """Prints whether an exercise is solved, in the reader's language, and the number that decided it.

    Args:
        is_right: Whether it is.
        fact: What was found, in symbols and units, so that it needs no translation: "T = 1.952 s".
    """
    word = _WORDS[language()][bool(is_right)]
    print(f"{'✓' if is_right else '✗'} {word}: {fact}")


def _shell() -> Any:
    if "IPython" not in sys.modules:
        return None
    from IPython.core.getipython import get_ipython

    return get_ipython()


def _name_in_code() -> str:
    shell = _shell()
    return "" if shell is None else str(shell.user_ns.get(_CODE_FILE, ""))


def _speak() -> None:
    """Has reports shown in the language of the lesson."""
    shell, spoken = _shell(), language()
    if shell is not None and spoken != "en":
        html = shell.display_formatter.formatters["text/html"]
        html.for_type_by_name("rcilab.conformance.report", "Report", lambda report: report_html(report, spoken))


_speak()  # Every lesson imports this file, and has the same cells in both languages.
