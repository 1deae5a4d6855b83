"""The language of the notebook that runs in this process."""

from __future__ import annotations

import os
import sys
from typing import Any

from rcilab.i18n.locale import Language, require_language

_SESSION = "JPY_SESSION_NAME"
"""Environment variable in which Jupyter's server passes the name of the notebook to its kernel."""
_CODE_FILE = "__vsc_ipynb_file__"
"""Variable of the notebook in which VS Code passes its name."""


def language() -> Language:
    """Returns the language of the notebook that runs here: Chinese when it is named `*.zh.ipynb`, else English.

    A lesson has the same code in both languages and therefore calls this: `print(report.explain(language()))`.
    English if the name of the notebook is not known.
    """
    return "zh" if ".zh.ipynb" in os.environ.get(_SESSION, "") + _name_in_code() else "en"


def chosen_language(requested: str | None, neighbour: Language | None = None) -> Language:
    """Returns the requested language, else that of the neighbouring part, else that of the notebook.

    Args:
        requested: "en" or "zh"; None leaves it open.
        neighbour: Language of the part from which this one was built; None without such a part.

    Raises:
        InvalidValueError: There is no such language.
    """
    return neighbour or language() if requested is None else require_language(requested)


def shell() -> Any:
    """Returns IPython's shell; None outside IPython."""
    module = sys.modules.get("IPython.core.getipython")  # A running shell has imported it.
    return None if module is None else module.get_ipython()


def _name_in_code() -> str:
    found = shell()
    return "" if found is None else str(found.user_ns.get(_CODE_FILE, ""))
