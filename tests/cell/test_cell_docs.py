"""docs/cell.md keeps its promises: its Python runs, its file is valid, its options and rows exist."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rcilab.cell.cell import Cell
from rcilab.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/cell.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
FRAMES = r"\[0\.5 0\.1 0\.4\]\n\[0\.55 0\.1  0\.4 \]\n"
EVENTS = r"\['input', 'output', 'output', 'output'\]\n"
OUTPUTS = (
    r"",
    r"part and divider: distance from an obstacle .* they overlap, .*\n",
    FRAMES,
    EVENTS,
    r".*tool and divider.*\n",
)


@pytest.mark.parametrize(
    ("snippet", "output"), [*zip(SNIPPETS, OUTPUTS, strict=True)], ids=["value", "plan", "frame", "signals", "session"]
)
def test_its_python_runs_as_printed(tmp_path: Path, snippet: str, output: str) -> None:
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", snippet], capture_output=True, text=True, timeout=120, cwd=tmp_path
    )
    assert result.returncode == 0, result.stderr
    assert re.fullmatch(output, result.stdout, re.DOTALL), result.stdout
    assert sorted(file.suffix for file in tmp_path.iterdir()) in ([], [".html"], [".json"])


def test_its_file_is_a_cell_of_the_schema(tmp_path: Path) -> None:
    import jsonschema  # Takes 2 s, which other workers need not wait for.

    (text,) = re.findall(r"```json\n(.*?)```", PAGE, re.DOTALL)
    jsonschema.validate(json.loads(text), json.loads((ROOT / "rcilab/cell/cell.schema.json").read_text("utf-8")))
    (tmp_path / "cell.json").write_text(text, encoding="utf-8")
    cell = Cell.load(tmp_path / "cell.json")
    assert cell.held == "cube"
    assert cell.solid("wall").pose.rotation[:, 2] == pytest.approx((0.0, 1.0, 0.0))  # Free towards the arm.


def test_its_links_and_options_exist(capsys) -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target
    for command in ("check", "run", "controller", "mjcf"):
        with pytest.raises(SystemExit):
            main([command, "--help"])
        assert "--cell" in capsys.readouterr().out
