from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest

from rcilab.core.errors import UsageError
from rcilab.notebook import quick_lab
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


def test_jupyterlab_builds_no_grammar_of_addresses_and_asks_yarn_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    commands, labapp = ModuleType("jupyterlab.commands"), ModuleType("jupyterlab.labapp")
    package = ModuleType("jupyterlab")
    package.commands = commands  # type: ignore[attr-defined]
    labapp.main = lambda: (sys.modules["rfc3987_syntax"], commands._yarn_config(None))  # type: ignore[attr-defined]
    for module in (package, commands, labapp):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "rfc3987_syntax", raising=False)
    grammar, yarn = quick_lab.main()
    assert grammar is None
    assert yarn == {"yarn config": {}, "npm config": {}}
