"""Libraries that only some exports need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rcilab.errors import UsageError


def require_library(name: str, purpose: str) -> Any:
    """Returns a library of the extra `export`.

    Raises:
        UsageError: It is not installed; the message says how to install it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        library = name.split(".")[0]
        raise UsageError(f"{purpose} needs {library}, which is not installed: pip install 'rcilab[export]'") from error
