"""The lab's packages are an extra: the error for a missing one says how to install it."""

from __future__ import annotations

from importlib.util import find_spec

from rcilab.core.errors import UsageError


def require_installed(package: str, purpose: str) -> None:
    """Checks that a package is installed.

    Args:
        package: Name it is imported by.
        purpose: The feature that needs it, such as "plot".

    Raises:
        UsageError: It is not installed; the message says how to install it.
    """
    if find_spec(package) is None:
        raise UsageError(f"{purpose} needs {package}, which is not installed: pip install -e '.[lab]' adds it")
