from __future__ import annotations

import argparse
import os
import subprocess
import sys

import pytest

import rcilab
from rcilab.cli import COMMANDS, main
from rcilab.core.errors import UsageError


def test_the_version_is_the_packages_own(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ending:
        main(["--version"])
    assert ending.value.code == 0
    assert capsys.readouterr().out == f"rcilab {rcilab.__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ending:
        main([command, "--help"])
    assert ending.value.code == 0
    assert f"rcilab {command}" in capsys.readouterr().out


def test_an_unknown_command_is_refused_with_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ending:
        main(["danse"])
    assert ending.value.code == 2
    said = capsys.readouterr().err
    assert "danse" in said
    assert "workbench" in said


def test_an_error_of_ours_is_one_line_on_stderr_and_exit_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["urdf", "xMate9"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert said.err.startswith("rcilab: ")
    assert "xMate9" in said.err
    assert all(name in said.err for name in ("xMatePro3", "xMatePro7", "xMate3", "xMate7"))


def test_a_bare_option_belongs_to_the_workbench(monkeypatch: pytest.MonkeyPatch) -> None:
    from rcilab.cli import workbench

    asked: list[argparse.Namespace] = []

    def run(args: argparse.Namespace) -> int:
        asked.append(args)
        raise UsageError("far enough")

    monkeypatch.setattr(workbench, "run", run)
    assert main(["--model", "xMate3", "--no-browser"]) == 2
    assert main([]) == 2
    assert [(args.model, args.robot) for args in asked] == [("xMate3", "virtual"), (None, "virtual")]


def test_naming_the_commands_loads_no_heavy_library() -> None:
    heavy = ["pinocchio", "mujoco", "viser", "ruckig", "matplotlib", "meshcat", "numpy"]
    code = f"""
import sys
from rcilab.cli import main
try:
    main(["--help"])
except SystemExit:
    print("LOADED", *[name for name in {heavy} if name in sys.modules])
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.splitlines()[-1] == "LOADED"


@pytest.mark.parametrize(("line", "among"), [("rcilab mj", "mjcf"), ("rcilab run --to", "--to-start")])
def test_the_shell_completes_commands_and_options(line: str, among: str) -> None:
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_STDOUT_FILENAME": "/dev/stdout", "_ARGCOMPLETE_SUPPRESS_SPACE": "1"}
    asked |= {"COMP_LINE": line, "COMP_POINT": str(len(line)), "_ARGCOMPLETE_IFS": "\n"}
    command = [sys.executable, "-m", "rcilab.cli"]
    result = subprocess.run(command, env={**os.environ, **asked}, capture_output=True, text=True, check=False)
    assert result.stdout.split() == [among], result.stderr
