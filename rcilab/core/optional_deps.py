"""Libraries of the extras: the error for a missing one says how to install it."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal, TypeAlias

from rcilab.core.errors import UsageError

Extra: TypeAlias = Literal["export", "franka", "lab", "planning", "realman", "xarm"]


class MissingExtraError(UsageError):
    """A library of an extra is not installed.

    Attributes:
        library: Name of the library.

    Args:
        library: Name of the library.
        purpose: The feature that needs it, such as "plot".
        extra: The extra that contains it.
    """

    def __init__(self, library: str, purpose: str, extra: Extra = "export") -> None:
        super().__init__(f"{purpose} needs {library}, which is not installed: pip install 'rcilab[{extra}]'")
        self.library = library


def require_installed(library: str, purpose: str, extra: Extra = "lab") -> None:
    """Checks that a library of an extra is installed, without importing it.

    Args:
        library: Name of the module.
        purpose: The feature that needs it.
        extra: The extra that contains it.

    Raises:
        MissingExtraError: The library is not installed.
    """
    if find_spec(library) is None:
        raise MissingExtraError(library, purpose, extra)


def require_library(name: str, purpose: str, extra: Extra = "export", package: str = "") -> Any:
    """Returns a library of an extra.

    Args:
        name: Name of the module.
        purpose: The feature that needs it.
        extra: The extra that contains it.
        package: Name of the package that is installed, if it is another one.

    Raises:
        MissingExtraError: It is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(package or name.split(".")[0], purpose, extra) from error
