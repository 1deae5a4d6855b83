from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rcilab.core.errors import UsageError
from rcilab.notebook.lab import lab_command


def test_a_missing_directory_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no-such-place"):
        lab_command(tmp_path / "no-such-place", allow_root=True)


def test_each_directory_has_open_tabs_of_its_own(tmp_path: Path) -> None:
    """Those of another one are not there: JupyterLab asked for them, and got a 404 for each."""
    (tmp_path / "a").mkdir()

    def kept(directory: Path) -> str:
        (option,) = (part for part in lab_command(directory, allow_root=True) if "workspaces_dir" in part)
        return option

    assert kept(tmp_path) == kept(tmp_path / "a" / "..") != kept(tmp_path / "a")


def test_jupyterlab_itself_is_started_without_asking_for_extensions(tmp_path: Path) -> None:
    command = lab_command(tmp_path, allow_root=True)
    assert command[:4] == [sys.executable, "-m", "jupyterlab", str(tmp_path)]
    assert "--LabApp.extension_manager=readonly" in command
