"""`rcilab urdf` and `rcilab mjcf`."""

from __future__ import annotations

import argparse
from pathlib import Path
from types import ModuleType

import pytest

from rcilab.cli import mjcf, urdf
from rcilab.core.errors import ModelError
from rcilab.robots import describe_robot
from rcilab.robots.mjcf import build_mjcf
from rcilab.robots.urdf import build_urdf


def run(module: ModuleType, *words: str) -> int:
    parser = argparse.ArgumentParser()
    module.add_parser(parser.add_subparsers())
    args = parser.parse_args([module.__name__.rsplit(".", 1)[1], *words])
    return args.run(args)


def test_both_print_to_standard_output_by_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(urdf, "xmatepro3") == 0
    assert capsys.readouterr().out == build_urdf(describe_robot("xMatePro3"))
    assert run(mjcf, "xMate3") == 0
    assert capsys.readouterr().out == build_mjcf(describe_robot("xMate3"))


def test_output_writes_the_file_and_its_meshes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(urdf, "xMate3", "--output", str(tmp_path)) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "xMate3.urdf")
    named = {line.split('"')[1] for line in (tmp_path / "xMate3.urdf").read_text().split("<mesh filename=")[1:]}
    assert len(named) > 15
    assert all((tmp_path / name).is_file() for name in named)


def test_an_unknown_arm_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ModelError, match="xMatePro7"):
        run(mjcf, "xMate9")


def test_a_directory_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file, no directory")
    with pytest.raises(ModelError, match="--output"):
        run(urdf, "xMate3", "--output", str(tmp_path / "taken"))
