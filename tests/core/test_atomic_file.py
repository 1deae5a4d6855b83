"""A file that is replaced is the old one until the new one is whole, whatever saves it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rcilab import check, load_model, load_run, plan_joint, simulate
from rcilab.core.atomic_file import read_own_text, replacing
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.optional_deps import MissingExtraError
from rcilab.motion import Motion, Program, Waypoint
from rcilab.workbench.access import find_token


def folder_after(file: Path) -> list[str]:
    return sorted(path.name for path in file.parent.iterdir())


def test_a_failed_write_leaves_the_file_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "kept"
    file.write_text("old")

    def fail() -> None:
        with replacing(file) as stream:
            stream.write(b"half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert file.read_text() == "old"
    assert folder_after(file) == ["kept"]


def test_a_link_stays_a_link_and_permissions_stay(tmp_path: Path) -> None:
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("old")
    file.chmod(0o640)
    link.symlink_to(file)
    with replacing(link) as stream:
        stream.write(b"new")
    assert link.is_symlink()
    assert (file.read_text(), file.stat().st_mode & 0o777) == ("new", 0o640)


def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    mask = os.umask(0o027)
    try:
        with replacing(tmp_path / "new") as stream:
            stream.write(b"new")
    finally:
        os.umask(mask)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o640


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    with replacing(f"/dev/fd/{writer}") as stream:
        stream.write(b"through")
    os.close(writer)
    assert os.read(reader, 100) == b"through"
    os.close(reader)


@pytest.fixture(scope="module")
def run():
    model = load_model("xMate3")
    with simulate(model) as robot:
        robot.power_on()
        yield robot.execute(plan_joint(model, model.home, model.home + 0.01))


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: os.symlink("/dev/zero", path)])
def test_what_has_no_end_is_not_read(tmp_path: Path, make: Callable[[Path], None]) -> None:
    own = tmp_path / "own.json"
    make(own)
    with pytest.raises(OSError, match="not a regular file"):
        read_own_text(own)
    with pytest.raises(UsageError, match="not a regular file"):
        find_token("127.0.0.1", file=own, environ={})
    for load, ending in ((Motion.load, "npz"), (Motion.load, "csv"), (Program.load, "json"), (load_run, "rcirun")):
        file = tmp_path / f"any.{ending}"
        make(file)
        with pytest.raises(InvalidValueError, match="cannot be read: not a regular file"):
            load(file)


def test_a_folder_in_the_place_of_an_own_file_costs_no_descriptor(tmp_path: Path) -> None:
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(3):
        with pytest.raises(IsADirectoryError):
            read_own_text(tmp_path)
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_link_to_something_huge_in_the_place_of_an_own_file_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "huge"
    file.touch()
    os.truncate(file, 2**40)
    with pytest.raises(OSError, match="1099512 MB are more than 32"):
        read_own_text(file)


@pytest.mark.parametrize(("ending", "library"), [(".parquet", "pyarrow"), (".mcap", "mcap")])
def test_a_run_that_cannot_be_saved_leaves_the_file_that_is_there(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, library: str
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == library]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)
    file = tmp_path / f"keep{ending}"
    file.write_bytes(b"precious")
    with pytest.raises(MissingExtraError):
        run.save(file)
    assert file.read_bytes() == b"precious"
    assert folder_after(file) == [file.name]


@pytest.mark.parametrize("ending", [".rcirun", ".csv", ".npz", ".parquet", ".mcap", ".html"])
def test_a_run_that_is_interrupted_while_it_is_saved_leaves_the_file_that_is_there(run, tmp_path: Path, ending) -> None:
    def interrupted(share: float) -> None:
        raise KeyboardInterrupt

    file = tmp_path / f"keep{ending}"
    file.write_bytes(b"precious")
    with pytest.raises(KeyboardInterrupt):
        run.save(file, progress=interrupted)
    assert file.read_bytes() == b"precious"
    assert folder_after(file) == [file.name]


def test_motions_and_programs_that_fail_half_way_leave_the_file_that_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = load_model("xMate3")
    motion, file = plan_joint(model, model.home, model.home + 0.01), tmp_path / "keep.npz"
    motion.save(file)
    before = file.read_bytes()

    def full(stream, **content: object) -> None:
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(UsageError, match="No space left on device"):
        motion.save(file)
    assert file.read_bytes() == before
    assert folder_after(file) == ["keep.npz"]
    program = Program(model=model.name, start=model.home, waypoints=(Waypoint.joint(model.home + 0.1),))
    with pytest.raises(UsageError):
        program.save(tmp_path / "nowhere" / "program.json")
    assert check(motion, model).ok
