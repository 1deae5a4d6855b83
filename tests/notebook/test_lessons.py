"""The lessons run from top to bottom without a display, and their exercises can be solved."""

from __future__ import annotations

import os
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
LESSONS = sorted(NOTEBOOKS.glob("*.ipynb"))

ANSWERS = {
    "01_first_motion.ipynb": {"speed = 0.5  # <- change me": "speed = 0.13", "number = 0  # <- change me": "number = 2"}
}


def run_lesson(path: Path, answers: dict[str, str]) -> nbformat.NotebookNode:
    """Executes a copy of a lesson with some of its lines replaced."""
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        for line, answer in answers.items():
            cell.source = cell.source.replace(line, answer)
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    client = NotebookClient(notebook, timeout=60, resources={"metadata": {"path": str(path.parent)}})
    return client.execute(env=environment)


def printed(notebook: nbformat.NotebookNode) -> list[str]:
    return [
        output.text
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.output_type == "stream"
    ]


def shown(notebook: nbformat.NotebookNode, kind: str) -> list[str]:
    return [
        output.data[kind]
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.output_type in ("execute_result", "display_data") and kind in output.data
    ]


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_is_committed_without_output(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == [None] * len(cells)
    assert all(cell.outputs == [] for cell in cells)
    assert notebook.cells[0].cell_type == "markdown"


def test_the_first_lesson_runs_and_its_exercises_can_be_solved() -> None:
    path = NOTEBOOKS / "01_first_motion.ipynb"
    notebook = run_lesson(path, ANSWERS[path.name])
    errors = [o for c in notebook.cells if c.cell_type == "code" for o in c.outputs if o.get("name") == "stderr"]
    assert errors == []
    text = "".join(printed(notebook))
    assert "refused: ConformanceError" in text
    assert text.count("right - ") == 2
    frames = "".join(shown(notebook, "text/html"))
    assert frames.count('<iframe src="http://127.0.0.1:') == 3  # The arm, the motion in meshcat, the motion in viser.
    assert len(shown(notebook, "image/png")) == 3  # Plan, broken plan, plan against actual.
    assert len(shown(notebook, "application/vnd.jupyter.widget-view+json")) == 1


def test_an_exercise_left_as_it_is_says_not_yet() -> None:
    path = NOTEBOOKS / "01_first_motion.ipynb"
    assert "".join(printed(run_lesson(path, {}))).count("not yet - ") == 2
