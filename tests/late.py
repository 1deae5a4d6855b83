"""Libraries that take long to load: every worker collects every test, and few of them run those that use one."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class Late:
    """A module that is loaded when something of it is asked for.

    Args:
        name: Of the module.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        if attribute == "_mock_name" or attribute.startswith("__"):  # Pytest asks every name in a file what it is.
            raise AttributeError(attribute)
        return getattr(import_module(self._name), attribute)
