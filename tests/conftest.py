"""What every test shares: fixed seeds, examples that a busy machine does not cut short, and lanes.

The suite runs in parallel (`-n auto --dist loadgroup`). Tests of a file stay together, because they share fixtures.
Files that draw pages are one group, and those with real deadlines another: two of a kind at the same time would be too
much for one machine of two cores.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from rcilab.makers.maker import Capabilities, maker_of
from rcilab.model.robot_model import load_model

_COMMON = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("rcilab", _COMMON, derandomize=True, database=None)
settings.register_profile("explore", _COMMON, print_blob=True)  # `.ci/run`: a random seed, and failures remembered.
settings.load_profile("rcilab")

# Containers like to switch bytecode off. Every worker, kernel and control process would compile the package again.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

_HERE = Path(__file__).parent
_LANES = {
    "pages": ("browser/", "views/test_browser.py", "notebook/test_lab_browser.py"),
    "deadlines": ("control_process/", "workbench/", "execution/test_virtual.py", "cli/test_bench.py"),
}
"""Name of each lane and the files in it, those that draw in a browser and those that keep real deadlines."""
_LONG = (
    "notebook/test_lessons.py",
    "peers/test_start_of_motion.py",
    "makers/realman/test_scenarios.py",
    "makers/ufactory/clients/test_sdk.py",
    "app/fault_lab/test_fault_lab.py",
    "makers/ufactory/test_scenarios.py",
    "makers/realman/clients/test_robotic_arm.py",
    "model/kinematics/test_numeric.py",
)
"""Other files that take half a minute and more; the last ones to begin would keep one core busy alone."""


def lane_of(file: str) -> str | None:
    """Returns the lane of a test file, given by its path below `tests`, or None."""
    if "supervisor" in file:  # A notebook with a control process behind it.
        return "deadlines"
    return next((lane for lane, places in _LANES.items() if file.startswith(places)), None)


def group_of(item: pytest.Item) -> str:
    """Returns the group of a test: its lane, or its file."""
    file = item.path.relative_to(_HERE).as_posix()
    return lane_of(file) or file


def pytest_itemcollected(item: pytest.Item) -> None:
    """Groups the tests for `--dist loadgroup`, before pytest-xdist reads the groups."""
    item.add_marker(pytest.mark.xdist_group(group_of(item)))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts the groups first that take longest (`--no-loadscope-reorder`)."""
    first = [*_LANES, *_LONG]
    items.sort(key=lambda item: first.index(group) if (group := group_of(item)) in first else len(first))


@pytest.fixture
def only_planned(monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of an arm that can be planned for, checked and drawn only, as one of a maker without a controller."""
    name = "Panda"
    maker = maker_of(load_model(name))
    assert maker is not None
    monkeypatch.setattr(type(maker), "capabilities", Capabilities())
    return name


@pytest.fixture(scope="session", autouse=True)
def _no_files_of_the_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Files that the user has stored, such as poses, neither change a test nor are changed by one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IPYTHONDIR", os.fspath(tmp_path_factory.mktemp("ipython")))
        for name in ("CONFIG", "STATE"):
            patch.setenv(f"XDG_{name}_HOME", os.fspath(tmp_path_factory.mktemp(name.lower())))
        yield
