"""Named poses: what is stored comes back, for its own arm only, and no bad file is overwritten or believed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.model.robot_model import load_model
from rcilab.motion.named_poses import NamedPoseStore, default_file

PRO7, MATE3 = load_model("xMatePro7"), load_model("xMate3")


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "rcilab" / "poses.json"


def test_a_stored_pose_comes_back_in_the_order_of_storing_and_goes_when_deleted(file):
    book = NamedPoseStore(PRO7, file)
    assert book.names() == ()
    assert book.store("  above the table ", PRO7.home) == "above the table"
    book.store("夹爪上方", np.zeros(7))
    again = NamedPoseStore(PRO7, file)
    assert again.names() == ("above the table", "夹爪上方")
    assert again.recall("above the table") == pytest.approx(PRO7.home, abs=1e-9)
    again.delete("above the table")
    again.delete("above the table")
    assert book.names() == ("夹爪上方",)


def test_poses_belong_to_one_arm(file):
    NamedPoseStore(PRO7, file).store("here", PRO7.home)
    other = NamedPoseStore(MATE3, file)
    assert other.names() == ()
    other.store("here", MATE3.home)
    other.delete("here")
    assert NamedPoseStore(PRO7, file).names() == ("here",)


@pytest.mark.parametrize("name", ["", "   ", "x" * 41, "two\nlines"])
def test_what_is_no_name_is_refused(file, name):
    with pytest.raises(InvalidValueError, match="1 to 40"):
        NamedPoseStore(PRO7, file).store(name, PRO7.home)
    assert not file.exists()


def test_a_taken_name_and_an_unknown_one_are_told(file):
    book = NamedPoseStore(PRO7, file)
    book.store("here", PRO7.home)
    with pytest.raises(InvalidValueError, match="is already used"):
        book.store("here", np.zeros(7))
    assert book.recall("here") == pytest.approx(PRO7.home)
    with pytest.raises(InvalidValueError, match="stored: here"):
        book.recall("there")


@pytest.mark.parametrize("q", [[0.0] * 6, [float("nan")] * 7])
def test_what_is_no_pose_is_not_stored(file, q):
    with pytest.raises(InvalidValueError):
        NamedPoseStore(PRO7, file).store("bad", q)
    assert not file.exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ("[]", "not a pose file"),
        ('{"format": "rcilab poses", "version": 1, "poses": {"xMatePro7": []}}', "not a pose file"),
        ('{"format": "rcilab poses", "version": 1}', "not a pose file"),
    ],
)
def test_a_file_that_is_none_is_named_and_left_alone(file, text, said):
    file.parent.mkdir()
    file.write_text(text)
    book = NamedPoseStore(PRO7, file)
    for act in (book.names, lambda: book.store("a", PRO7.home), lambda: book.delete("a")):
        with pytest.raises(InvalidValueError, match=said):
            act()
    assert file.read_text() == text


def test_a_pipe_in_the_place_of_the_file_is_refused(file):
    file.parent.mkdir()
    os.mkfifo(file)
    with pytest.raises(InvalidValueError, match=r"cannot be read: not a regular file"):
        NamedPoseStore(PRO7, file).names()


def test_a_file_of_another_version_is_left_alone(file):
    file.parent.mkdir()
    file.write_text('{"format": "rcilab poses", "version": 2, "poses": {}}')
    with pytest.raises(VersionMismatchError, match="found version 2"):
        NamedPoseStore(PRO7, file).names()


@pytest.mark.parametrize(
    ("angles", "said"), [([9.0] + [0.0] * 6, "joint 1"), ([0.0] * 6, "delete"), ("here", "or delete")]
)
def test_a_pose_that_somebody_has_written_by_hand_is_looked_at(file, angles, said):
    file.parent.mkdir()
    content = {"format": "rcilab poses", "version": 1, "poses": {"xMatePro7": {"bad": angles}}}
    file.write_text(json.dumps(content))
    with pytest.raises(InvalidValueError, match=said):
        NamedPoseStore(PRO7, file).recall("bad")


def test_a_write_that_fails_leaves_the_old_poses_and_nothing_else(file, monkeypatch):
    book = NamedPoseStore(PRO7, file)
    book.store("old", PRO7.home)

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(InvalidValueError, match="cannot be written: No space left"):
        book.store("new", PRO7.home)
    assert book.names() == ("old",)
    assert list(file.parent.iterdir()) == [file]


def test_the_file_is_in_the_users_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert default_file() == tmp_path / "rcilab" / "poses.json"
    monkeypatch.setenv("XDG_CONFIG_HOME", "relative")  # Not absolute: to be ignored, says the XDG specification.
    assert default_file() == Path.home() / ".config" / "rcilab" / "poses.json"
