"""The lessons as a student gets them: copies that stay the student's, and the page that leads to each of them."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from rcilab.cli import main
from rcilab.core.errors import UsageError
from rcilab.notebook.lessons import INDEX, copy_lessons, find_lessons

LESSON = "01_first.zh.ipynb"
NEW_VERSION = "01_first.new.zh.ipynb"


@pytest.fixture
def source(tmp_path: Path) -> Path:
    folder = tmp_path / "source"
    folder.mkdir()
    (folder / INDEX).write_text("# course", encoding="utf-8")
    (folder / LESSON).write_text("first", encoding="utf-8")
    return folder


def test_an_unedited_copy_follows_the_lesson_and_an_edited_one_stays(tmp_path: Path, source: Path) -> None:
    mine = tmp_path / "home" / "mine"
    assert copy_lessons(mine, source).written == (LESSON, INDEX)
    assert copy_lessons(mine, source).written == ()
    (source / LESSON).write_text("second", encoding="utf-8")
    assert copy_lessons(mine, source).written == (LESSON,)
    (mine / LESSON).write_text("my answers", encoding="utf-8")
    assert copy_lessons(mine, source).new_versions == ()  # Nothing is newer than what was given out.
    (source / LESSON).write_text("third", encoding="utf-8")
    copied = copy_lessons(mine, source)
    assert copied.new_versions == (NEW_VERSION,)
    assert NEW_VERSION in str(copied)
    assert (mine / LESSON).read_text(encoding="utf-8") == "my answers"
    assert (mine / NEW_VERSION).read_text(encoding="utf-8") == "third"


def test_a_newer_lesson_that_was_deleted_is_not_offered_again(tmp_path: Path, source: Path) -> None:
    copy_lessons(tmp_path, source)
    (tmp_path / LESSON).write_text("my answers", encoding="utf-8")
    (source / LESSON).write_text("second", encoding="utf-8")
    copy_lessons(tmp_path, source)
    (tmp_path / NEW_VERSION).unlink()
    assert copy_lessons(tmp_path, source).new_versions == ()
    (tmp_path / LESSON).unlink()
    assert copy_lessons(tmp_path, source).written == (LESSON,)


@pytest.mark.parametrize("make", [os.mkfifo, Path.mkdir, lambda path: path.write_bytes(b"\xff")])
def test_a_lesson_is_offered_next_to_a_file_that_is_not_a_copy(
    tmp_path: Path, source: Path, make: Callable[[Path], None]
) -> None:
    make(tmp_path / LESSON)
    assert copy_lessons(tmp_path, source).new_versions == (NEW_VERSION,)


def test_a_copy_without_a_record_counts_as_edited(tmp_path: Path, source: Path) -> None:
    (tmp_path / LESSON).write_text("from long ago", encoding="utf-8")
    assert copy_lessons(tmp_path, source).new_versions == (NEW_VERSION,)
    assert (tmp_path / LESSON).read_text(encoding="utf-8") == "from long ago"


def test_a_folder_that_cannot_be_written_is_refused_by_name(tmp_path: Path, source: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="file/mine: Not a directory"):
        copy_lessons(tmp_path / "file" / "mine", source)


def test_the_page_of_the_course_links_every_lesson_by_its_title_in_its_language() -> None:
    page = (find_lessons() / INDEX).read_text(encoding="utf-8")
    english, chinese = page.split("## 中文")
    for file in sorted(find_lessons().glob("*.ipynb")):
        title = json.loads(file.read_text(encoding="utf-8"))["cells"][0]["source"][0].removeprefix("# ").strip()
        part = chinese if file.name.endswith(".zh.ipynb") else english
        assert f"[{title}]({file.name})" in part
    assert all((find_lessons() / name).is_file() for name in re.findall(r"\]\((.*?\.ipynb)\)", page))


def test_root_is_told_the_flag_and_nothing_is_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 0)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert main(["lab"]) == 2
    assert "--allow-root" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("options", "place"), [([], "home"), (["--in-place"], "source")])
def test_the_lab_opens_copies_and_authors_the_lessons_themselves(
    options: list[str], place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    started: list[list[str]] = []
    monkeypatch.setattr("rcilab.notebook.lab.open_lab", lambda command: started.append(command) or 0)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert main(["lab", "--allow-root", *options]) == 0
    folder = tmp_path / "rcilab-notebooks" if place == "home" else find_lessons()
    assert str(folder) in started[0]
    assert "--LabApp.default_url=/lab/tree/index.md" in started[0]
    assert str(folder) in capsys.readouterr().out
