"""Which language a notebook is read in; whatever shows itself in one asks here."""

from __future__ import annotations

import os
import sys
from typing import Any

from rcilab.i18n.locale import Language, require_language

_SESSION = "JPY_SESSION_NAME"
"""Where Jupyter's server leaves the name of a kernel's notebook."""
_CODE_FILE = "__vsc_ipynb_file__"
"""Where VS Code leaves it, among the variables of the notebook."""


def language() -> Language:
    """Returns the language of the notebook that runs here: Chinese when it is named `*.zh.ipynb`, else English.

    A lesson has the same code in both languages, so it asks: `print(report.explain(language()))`. Where the name of
    the notebook is not known, it is English.
    """
    return "zh" if ".zh.ipynb" in os.environ.get(_SESSION, "") + _name_in_code() else "en"


def chosen_language(asked: str | None, neighbour: Language | None = None) -> Language:
    """Returns the language that was asked for, else that of what it is shown with, else that of the notebook.

    Args:
        asked: "en" or "zh"; None leaves it open.
        neighbour: Language of the part that this one was made from; None without such a part.

    Raises:
        InvalidValueError: There is no such language.
    """
    return neighbour or language() if asked is None else require_language(asked)


def shell() -> Any:
    """Returns IPython's shell; None outside of it."""
    module = sys.modules.get("IPython.core.getipython")  # Where there is a shell it has been imported.
    return None if module is None else module.get_ipython()


def _name_in_code() -> str:
    found = shell()
    return "" if found is None else str(found.user_ns.get(_CODE_FILE, ""))
