"""Optional libraries, which only some exports need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rcilab.core.errors import UsageError


class MissingExtraError(UsageError):
    """A library of the extra `export` is not installed.

    Attributes:
        library: Name of the library.
    """

    def __init__(self, library: str, purpose: str) -> None:
        super().__init__(f"{purpose} needs {library}, which is not installed: pip install 'rcilab[export]'")
        self.library = library


def require_library(name: str, purpose: str) -> Any:
    """Returns a library of the extra `export`.

    Raises:
        MissingExtraError: It is not installed; the message says how to install it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(name.split(".")[0], purpose) from error
