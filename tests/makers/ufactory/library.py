"""The maker's client library in tests, imported as rcilab does, so that the process stays as it was."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

import pytest

from rcilab.makers.ufactory.driver.library import load_client_library

needs_library = pytest.mark.skipif(find_spec("xarm") is None, reason="the extra xarm is not installed")


def library_module(name: str) -> ModuleType:
    """Returns a module of the library, such as "xarm.core.config.x_config"."""
    load_client_library()
    return import_module(name)
