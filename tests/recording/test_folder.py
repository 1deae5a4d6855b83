"""The folder of recorded runs: what it holds, how old ones go, and that no empty file stays behind."""

from __future__ import annotations

import os

import pytest

from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import InvalidValueError
from rcilab.model.robot_model import load_model
from rcilab.recording.folder import FolderStats, keep_newest, stored_runs
from rcilab.recording.live_recording import LiveRecording, RunFacts
from rcilab.recording.run_file import RunFile
from rcilab.recording.run_setup import Setup


@pytest.fixture
def folder(tmp_path):
    for number in range(5):
        file = tmp_path / f"{number}.rcirun"
        file.write_bytes(b"x" * (number + 1))
        os.utime(file, ns=(number * 10**9, number * 10**9))
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "sub.rcirun").mkdir()
    (tmp_path / "link.rcirun").symlink_to(tmp_path / "notes.txt")
    return tmp_path


def test_runs_are_counted_and_nothing_else_is(folder):
    assert stored_runs(folder) == FolderStats(5, 15)
    assert stored_runs(folder / "nowhere") == FolderStats(0, 0)


def test_the_newest_stay_and_what_is_no_run_is_never_touched(folder):
    assert keep_newest(folder, 2) == FolderStats(3, 6)
    assert sorted(path.name for path in folder.iterdir()) == [
        "3.rcirun", "4.rcirun", "link.rcirun", "notes.txt", "sub.rcirun",
    ]  # fmt: skip
    assert keep_newest(folder, 2) == FolderStats(0, 0)
    assert keep_newest(folder, 0) == FolderStats(2, 9)
    with pytest.raises(InvalidValueError, match="keeps none"):
        keep_newest(folder, -1)


def test_a_motion_that_was_refused_before_its_first_cycle_leaves_no_file(tmp_path):
    model = load_model("xMatePro7")
    file = RunFile(tmp_path / "run.rcirun", cycle_dtype(7), plan=None, model=model)
    assert LiveRecording(RunFacts(plan=None, model=model, setup=Setup()), file).finish("refused") is None
    assert list(tmp_path.iterdir()) == []
