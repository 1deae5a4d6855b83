"""The README keeps its promises: its Python runs, its commands and files exist."""

from __future__ import annotations

import contextlib
import io
import json
import re
import subprocess
import sys
from pathlib import Path

from rcilab.cli import main

ROOT = Path(__file__).parents[1]
SCHEMA = ROOT / "rcilab/motion/program.schema.json"
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_ten_lines_run_as_printed() -> None:
    code = re.findall(r"```python\n(.*?)```", README, re.DOTALL)[0]
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, timeout=60, cwd=ROOT
    )
    assert result.returncode == 0, result.stderr
    said = re.fullmatch(r"arrived after (\S+) s; largest error (\S+) rad\n", result.stdout)
    assert said, result.stdout
    assert 0.1 < float(said[1]) < 3.0
    assert float(said[2]) < 1e-9  # The ideal plant is where it is told to be.


def test_the_program_written_by_hand_is_sound_and_the_one_from_python_runs(tmp_path) -> None:
    import jsonschema  # Takes 2 s, which other workers need not wait for.

    (text,) = re.findall(r"```json\n(.*?)```", README, re.DOTALL)
    jsonschema.validate(json.loads(text), json.loads(SCHEMA.read_text(encoding="utf-8")))
    (tmp_path / "program.json").write_text(text, encoding="utf-8")
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert main(["check", str(tmp_path / "program.json")]) == 0
        exec(re.findall(r"```python\n(.*?)```", README, re.DOTALL)[1], {})
    assert said.getvalue().count("conforms; nearest") == 2  # No word of a recommendation that is not met.
    assert said.getvalue().endswith(" 2\n")


def test_the_parts_of_the_lab_combine_around_a_session_as_printed() -> None:
    code = re.findall(r"```python\n(.*?)```", README, re.DOTALL)[3]
    end = "assert plan.state is run.state is scene.state\nrobot.close()\n"
    result = subprocess.run([sys.executable, "-c", code + end], capture_output=True, text=True, timeout=60, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    assert "conforms" in result.stdout


def test_the_motion_in_a_cell_conforms() -> None:
    code = next(block for block in re.findall(r"```python\n(.*?)```", README, re.DOTALL) if "Cell.example" in block)
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    assert "clearance.cell" in result.stdout
    assert "does not conform" not in result.stdout


def test_both_set_up_commands_stand_on_a_line_of_their_own() -> None:
    lines = README.splitlines()
    assert "python3 -m venv .venv && .venv/bin/pip install -e . && .venv/bin/rcilab" in lines
    assert "python3 -m venv .venv && .venv/bin/pip install -e '.[test]' && .venv/bin/pytest" in lines


def test_every_link_leads_to_a_file() -> None:
    targets = re.findall(r"\]\(([^)#:]+)\)", README)
    assert len(targets) >= 5
    assert [target for target in targets if not (ROOT / target).exists()] == []


def test_every_command_it_names_exists() -> None:
    listing = subprocess.run([sys.executable, "-m", "rcilab.cli", "--help"], capture_output=True, text=True, check=True)
    named = {words for words in re.findall(r"rcilab (\w+)", README) if words.islower()}
    assert named >= {"lab", "controller", "urdf", "mjcf", "doctor", "bench"}
    assert [name for name in sorted(named) if not re.search(rf"\b{name}\b", listing.stdout)] == []
