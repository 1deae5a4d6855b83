"""Every Chinese lesson from top to bottom: its code is that of the English one, what the code calls speaks Chinese."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.notebook.test_lessons import CHINESE, EXERCISES, execute, printed, shown, with_solved_exercises

pytestmark = pytest.mark.endurance


@pytest.mark.parametrize("path", CHINESE, ids=lambda path: path.stem)
def test_a_chinese_lesson_runs_and_answers_in_chinese(path: Path) -> None:
    notebook = execute(with_solved_exercises(path), path)
    assert printed(notebook, "stderr") == ""
    assert re.findall("✗ 还没有|✓ 正确", printed(notebook)) == ["✗ 还没有", "✓ 正确"] * EXERCISES
    for told in shown(notebook, "text/html"):
        assert "<table" not in told or re.search("[一-鿿]", told)
