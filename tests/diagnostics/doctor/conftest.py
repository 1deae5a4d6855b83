from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from rcilab.diagnostics.doctor.system import System

Tree = Callable[[Mapping[str, str]], System]


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    """Makes a machine's /proc and /sys out of paths and texts."""

    def plant(files: Mapping[str, str]) -> System:
        for path, text in files.items():
            file = tmp_path / path.lstrip("/")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        return System(tmp_path)

    return plant
