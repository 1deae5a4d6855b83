"""Long runs: `pytest -m endurance`. Each has a short version in the default suite."""

from __future__ import annotations

from pathlib import Path

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    if "endurance" not in config.option.markexpr:
        mine = [item for item in items if item.path.is_relative_to(here)]
        config.hook.pytest_deselected(items=mine)
        items[:] = [item for item in items if item not in mine]
