"""Every lesson runs from top to bottom without a display; its exercises wait for an answer, its solutions are right.

A lesson is executed once: its cells as they are, and after each exercise the same with the solution folded below it.
The Chinese lessons have the same code; that what it calls speaks Chinese is seen in `tests/endurance`.
"""

from __future__ import annotations

import ast
import os
import re
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.notebook.forked_kernels import forked_kernels

if TYPE_CHECKING:
    import nbformat

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
ALL = sorted(NOTEBOOKS.glob("*.ipynb"))
CHINESE = [path for path in ALL if path.name.endswith(".zh.ipynb")]
LESSONS = [path for path in ALL if path not in CHINESE]
EXERCISES = 2  # A lesson.
LONGEST_FUNCTION = 30  # Lines; a screen.
READING_TIME = 0.3  # [s] Before each cell, where a lesson is read slowly.
CELLS = range(10, 21)  # How many make one story.
CHECK = "# check\n"  # What of an exercise's cell comes after this line is not for the student to change.
SOLUTION = re.compile(r"<details>.*?```python\n(.*?)```\n</details>", re.DOTALL)


def read(path: Path) -> nbformat.NotebookNode:
    import nbformat  # Which other workers need not wait for.

    return nbformat.read(path, as_version=4)


def code(path: Path) -> list[str]:
    return [cell.source for cell in read(path).cells if cell.cell_type == "code"]


def text(path: Path) -> str:
    return "\n".join(cell.source for cell in read(path).cells if cell.cell_type == "markdown")


def exercises(path: Path) -> list[str]:
    return [source for source in code(path) if CHECK in source]


def solutions(path: Path) -> list[str]:
    return SOLUTION.findall(text(path))


def with_solved_exercises(path: Path) -> nbformat.NotebookNode:
    """Returns a lesson in which every exercise is followed by the same with its folded solution in place."""
    import nbformat

    notebook, pending = read(path), iter(solutions(path))
    cells: list[nbformat.NotebookNode] = []
    for cell in notebook.cells:
        cells.append(cell)
        if cell.cell_type == "code" and CHECK in cell.source:
            cells.append(nbformat.v4.new_code_cell(next(pending) + CHECK + cell.source.split(CHECK)[1]))
    notebook.cells = cells
    return notebook


def read_slowly_and_twice(path: Path) -> nbformat.NotebookNode:
    """Returns a lesson in which every cell is run two times, each after a pause."""
    import nbformat

    notebook = read(path)
    sources = [cell.source for cell in notebook.cells if cell.cell_type == "code" for _ in range(2)]
    pause = f"__import__('time').sleep({READING_TIME})\n"
    notebook.cells = [nbformat.v4.new_code_cell(pause + source) for source in sources]
    return notebook


@cache
def run_lesson(path: Path) -> nbformat.NotebookNode:
    return execute(with_solved_exercises(path), path)


def execute(notebook: nbformat.NotebookNode, path: Path) -> nbformat.NotebookNode:
    from nbclient import NotebookClient

    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["JPY_SESSION_NAME"] = str(path)  # As Jupyter's server does; the language is read from it.
    resources = {"metadata": {"path": str(path.parent)}}
    with forked_kernels():
        return NotebookClient(notebook, timeout=60, resources=resources).execute(env=environment)


def printed(notebook: nbformat.NotebookNode, stream: str = "stdout") -> str:
    return "".join(
        output.text
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.output_type == "stream" and output.name == stream
    )


def shown(notebook: nbformat.NotebookNode, kind: str) -> list[str]:
    return [
        output.data[kind]
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.output_type in ("execute_result", "display_data") and kind in output.data
    ]


def test_there_are_fourteen_lessons_in_two_languages() -> None:
    assert [path.name[:3] for path in LESSONS] == [f"{number:02}_" for number in range(1, 15)]
    assert [path.name for path in CHINESE] == [path.name.replace(".ipynb", ".zh.ipynb") for path in LESSONS]


@pytest.mark.parametrize("path", ALL, ids=lambda path: path.stem)
def test_a_lesson_is_committed_without_output(path: Path) -> None:
    import nbformat

    notebook = read(path)
    nbformat.validate(notebook)
    assert set(notebook.metadata) == {"kernelspec", "language_info"}
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == [None] * len(cells)
    assert all(cell.outputs == [] for cell in cells)
    assert all(cell.metadata == {} for cell in notebook.cells)
    assert notebook.cells[0].cell_type == "markdown"


@pytest.mark.parametrize("path", ALL, ids=lambda path: path.stem)
def test_a_lesson_is_one_story_of_ten_to_twenty_cells(path: Path) -> None:
    assert len(read(path).cells) in CELLS


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_no_function_is_longer_than_a_screen(path: Path) -> None:
    for source in code(path):
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.FunctionDef):
                assert node.end_lineno is not None
                assert node.end_lineno - node.lineno < LONGEST_FUNCTION


@pytest.mark.parametrize("path", CHINESE, ids=lambda path: path.stem)
def test_a_chinese_lesson_has_the_code_of_the_english_one(path: Path) -> None:
    english = NOTEBOOKS / path.name.replace(".zh.", ".")
    assert code(path) == code(english)
    assert [cell.cell_type for cell in read(path).cells] == [cell.cell_type for cell in read(english).cells]
    assert solutions(path) == solutions(english)


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_runs_and_its_exercises_can_be_solved(path: Path) -> None:
    assert len(exercises(path)) == len(solutions(path)) == EXERCISES
    notebook = run_lesson(path)
    assert printed(notebook, "stderr") == ""
    assert re.findall("✗ not yet|✓ right", printed(notebook)) == ["✗ not yet", "✓ right"] * EXERCISES
    assert shown(notebook, "image/png") or shown(notebook, "text/html")


def test_the_first_lesson_shows_what_it_talks_about() -> None:
    notebook = run_lesson(LESSONS[0])
    assert "refused: ConformanceError" in printed(notebook)
    frames = "".join(shown(notebook, "text/html"))
    assert frames.count('<iframe src="http://127.0.0.1:') == 3  # The arm, the motion in meshcat, the motion in viser.
    assert len(shown(notebook, "image/png")) == 3  # Plan, broken plan, plan against actual.
    assert len(shown(notebook, "application/vnd.jupyter.widget-view+json")) == 1


def test_the_sixth_lesson_shows_its_numbers_at_any_pace_and_again() -> None:
    """What its prose promises: no id left out, a success rate of 0.900, fault 19 after 50 states without an answer."""
    path = LESSONS[5]
    notebook = execute(read_slowly_and_twice(path), path)
    said = printed(notebook)
    assert printed(notebook, "stderr") == ""
    assert re.findall(r"\[\((\d+), .*?\((\d+), .*\((\d+), .*mrad", said) == [("1", "2", "300")] * 2
    assert re.findall(r"^0\.\d{3}$", said, re.MULTILINE) == ["0.900"] * 2
    assert re.findall(r"(\d+) × (00.*)", said) == [("50", "00 " * 19 + "01")] * 2
    assert said.count("kInstabilityDetection REFLEX") == said.count("RecoveryStatus.SUCCESS") == 2
    assert len(shown(notebook, "image/png")) == 2 * 2  # The bytes, the success rate.


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="pylibfranka has no wheel for this Python")
def test_the_lessons_on_two_makers_move_an_arm_of_each() -> None:
    both, breaks = printed(run_lesson(LESSONS[10])), printed(run_lesson(LESSONS[11]))
    assert re.findall(r"^(\w+) +T = \d\.\d{3} s, max", both, re.MULTILINE) == ["xMatePro7", "Panda"]
    assert re.findall(r"^(\w+) +t = .*\['(\w+)'\]", both, re.MULTILINE) == [
        ("xMatePro7", "kCommandCartesianAccelerationLimitsViolation")
    ]
    assert re.findall(r"^Panda +T = \S+ s, faults: 0$", both, re.MULTILINE)
    assert re.findall(r"^(\w+) +stopped t = .*, (\w+)$", breaks, re.MULTILINE) == [
        ("FR3", "joint_motion_generator_velocity_limits_violation"),
        ("FR3", "controller_torque_discontinuity"),
        ("FR3", "communication_constraints_violation"),
        ("FR3", "cartesian_reflex"),
    ]


def test_the_lesson_on_modes_shows_what_each_mode_refuses_and_what_ends_the_queue() -> None:
    said = printed(run_lesson(LESSONS[12]))
    rows = re.findall(r"^(\w+) +((?:\d +){6}\d)$", said, re.MULTILINE)
    taken = {name: [k for k, code in enumerate(codes.split()) if code == "0"] for name, codes in rows}
    assert taken == {
        "set_servo_angle": [0, 5], "set_position": [0, 6], "set_servo_angle_j": [1], "set_servo_cartesian": [1],
        "vc_set_joint_velocity": [3], "vc_set_cartesian_velocity": [4],
    }  # fmt: skip
    assert {code for _, codes in rows for code in codes.split()} == {"0", "9"}
    ends = re.findall(r"^(set_\w+\(\d\)) +state (\d), (\d) motions", said, re.MULTILINE)
    assert ends == [("set_state(4)", "4", "0"), ("set_state(6)", "4", "0"), ("set_mode(1)", "5", "0")]
    assert "error 21 - " in said


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="pylibfranka has no wheel for this Python")
def test_the_lesson_on_four_makers_shows_who_refuses_and_moves_an_arm_of_each() -> None:
    said = printed(run_lesson(LESSONS[13]))
    names = ["xMatePro7", "FR3", "xArm7", "RM75"]
    assert re.findall(r"^(\w+) +(\w+)://\S+$", said, re.MULTILINE) == list(
        zip(names, ("rci", "fci", "xarm", "realman"), strict=True)
    )
    assert re.findall(r"^(\w+) +(\S+), joint \d: .* of .*: (no error|\S+)", said, re.MULTILINE) == [
        ("FR3", "joint.acceleration", "joint_motion_generator_velocity_discontinuity"),
        ("xArm7", "joint.jerk", "no error"),
        ("RM75", "joint.acceleration", "0x100A"),
    ]
    assert re.findall(r"^FR3 +stopped at t = 0\.0\d\d s: (\w+)$", said, re.MULTILINE)
    assert re.findall(r"^RM75 +ends at t = \S+ s$", said, re.MULTILINE)
    assert re.findall(r"^(\w+) +arrived at t = \S+ s", said, re.MULTILINE) == names


@pytest.mark.parametrize(
    ("path", "extras"),
    [(LESSONS[10], ["franka"]), (LESSONS[11], ["franka"]), (LESSONS[13], ["franka", "xarm", "realman"])],
    ids=lambda value: getattr(value, "stem", ""),
)
def test_a_lesson_on_several_makers_runs_without_their_libraries(path: Path, extras: list[str]) -> None:
    import nbformat

    notebook = with_solved_exercises(path)
    libraries = ("panda_py", "panda_py.libfranka", "pylibfranka", "xarm", "xarm.wrapper", "Robotic_Arm")
    missing = f"import sys\nsys.modules.update(dict.fromkeys({libraries}))"
    notebook.cells.insert(0, nbformat.v4.new_code_cell(missing))
    said = printed(execute(notebook, path))
    assert re.findall(r"pip install 'rcilab\[(\w+)\]'", said) == extras
    assert re.findall("✗ not yet|✓ right", said) == ["✗ not yet", "✓ right"] * EXERCISES
