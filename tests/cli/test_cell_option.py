"""`--cell` of check, run and controller."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rcilab
from rcilab.app.text import Text as PageText
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame, Obstacle
from rcilab.cell.shapes import Box, Solid
from rcilab.cell.tool import Tool
from rcilab.cli import main
from rcilab.control_process.launch import start_controller
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error
from rcilab.model.dynamics.payload import Payload
from rcilab.motion import Program, Waypoint

MODEL = rcilab.load_model("xMatePro7")
GOAL = MODEL.home + (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
HALFWAY = MODEL.forward((MODEL.home + GOAL) / 2.0).position
WALL = Obstacle(name="wall", shape=Box(size=(0.1, 0.02, 0.3)), pose=Pose.from_rpy(HALFWAY, (0.0, 0.0, 0.5)))
TOOL = Tool(
    T_flange_tool=Pose((0.0, 0.0, 0.1)),
    payload=Payload(mass=0.5, center_of_mass=np.array((0.0, 0.0, 0.05))),
    solids=(Solid(shape=Box(size=(0.04, 0.04, 0.1)), pose=Pose((0.0, 0.0, 0.05))),),
)
CELL = Cell(model="xMatePro7", tool=TOOL, obstacles=(WALL,))


@pytest.fixture
def files(tmp_path: Path) -> Path:
    CELL.save(tmp_path / "walled.json")
    CELL.without("wall").save(tmp_path / "free.zip")
    Program(model=MODEL.name, start=tuple(MODEL.home.tolist()), waypoints=(Waypoint.joint(GOAL, speed=0.5),)).save(
        tmp_path / "program.json"
    )
    rcilab.plan_joint(MODEL, MODEL.home, GOAL, speed=0.5).save(tmp_path / "motion.npz")
    return tmp_path


def test_a_program_or_a_motion_through_a_wall_is_refused_in_both_languages(files, capsys):
    for name in ("program.json", "motion.npz"):
        assert main(["check", str(files / name), "--cell", str(files / "walled.json")]) == 1
        assert "  violated  clearance.cell " in capsys.readouterr().out
    argv = ["check", str(files / "program.json"), "--cell"]
    assert main([*argv, str(files / "walled.json"), "--explain", "zh"]) == 1
    assert "与障碍物的距离必须大于 0 m" in capsys.readouterr().out
    assert main([*argv, str(files / "walled.json"), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert "load 0.5 kg" in report["arm"]
    assert [v["id"] for v in report["violations"]] == ["clearance.cell"]
    assert main([*argv, str(files / "free.zip")]) == 0
    assert "clearance.cell" not in capsys.readouterr().out


def test_a_program_with_another_tool_than_the_cell_has_a_note(files, capsys):
    file = files / "own.json"
    program = replace(Program.load(files / "program.json"), tool=(0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0))
    program.save(file)
    assert main(["check", str(file), "--cell", str(files / "free.zip")]) == 0
    assert "the file has another tool or load than the cell; those of the cell count" in capsys.readouterr().out


@pytest.mark.parametrize("argv", [("check", "program.json"), ("controller",)], ids=lambda argv: argv[0])
def test_tool_and_load_of_a_cell_are_not_given_a_second_time(files, capsys, argv):
    command, *rest = argv
    file = [str(files / name) for name in rest]
    assert main([command, *file, "--cell", str(files / "walled.json"), "--load", "1"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "rcilab: --cell has the tool and the load of the arm: leave out --tool and --load"


def test_run_refuses_a_motion_through_a_wall_and_runs_it_where_there_is_none(files, capsys):
    controller = start_controller(MODEL.name, lockstep=True, options=["--cell", str(files / "walled.json")])
    try:
        assert controller.address is not None
        argv = ["run", str(files / "program.json"), "--robot", controller.address, "--yes", "--cell"]
        assert main([*argv, str(files / "walled.json")]) == 1
        captured = capsys.readouterr()
        assert "wall: distance from an obstacle" in captured.out
        assert captured.err == "The motion does not conform; nothing was sent.\n"
        assert main([*argv, str(files / "free.zip")]) == 0
        assert "<Run" in capsys.readouterr().out
        program, cell = in_tray(files)
        assert main(["run", program, "--robot", controller.address, "--yes", "--cell", cell]) == 0
        assert "<Run" in capsys.readouterr().out
    finally:
        controller.end()


def in_tray(files: Path) -> tuple[str, str]:
    """A program with a waypoint in a frame, from the goal back, and the cell with this frame."""
    tray, there = (
        Pose.from_rpy((0.3, 0.1, 0.2), (0.0, 0.0, 0.4)),
        MODEL.with_tool(TOOL.T_flange_tool).forward(MODEL.home),
    )
    program, cell = files / "tray.json", files / "tray_cell.json"
    waypoint = Waypoint.joint(tray.inverse() @ there, speed=0.5, frame="tray")
    Program(model=MODEL.name, start=tuple(GOAL.tolist()), waypoints=(waypoint,)).save(program)
    replace(CELL, obstacles=(), frames=(Frame(name="tray", T_parent_frame=tray),)).save(cell)
    return str(program), str(cell)


def test_waypoints_in_a_frame_are_those_of_the_cell(files, capsys):
    program, cell = in_tray(files)
    assert main(["check", program, "--cell", cell, "--slow-down", str(files / "out.npz")]) == 0
    capsys.readouterr()
    arm = MODEL.with_tool(TOOL.T_flange_tool)
    end = rcilab.Motion.load(files / "out.npz").q[-1]
    assert arm.forward(end).is_close(arm.forward(MODEL.home), 1e-6)
    for argv in (["check", program], ["run", program, "--robot", "rci://127.0.0.1:9", "--yes"]):
        assert main(argv) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line == "rcilab: tray.json needs its cell (tray): add --cell CELL, the cell that has them"
    assert main(["check", program, "--cell", str(files / "free.zip")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    expected = "tray.json, line 8, waypoint 1 (joint), frame: 'tray' does not exist; there are: world"
    assert line == f"rcilab: {expected}"


@pytest.mark.parametrize(
    ("text", "english", "chinese"),
    [
        ("[1]", "cell.json, line 1: not a cell of rcilab", "cell.json 第 1 行：不是 rcilab 的工作单元"),
        ('{"format": "rcilab program", "version": 1, "model": "xMatePro7"}', "not a cell", "不是 rcilab 的工作单元"),
        (
            '{"format": "rcilab cell", "version": 1, "model": "xMatePro7", "tool": 3}',
            "“tool” has the wrong type",
            "“tool”的类型不对",
        ),
    ],
)
def test_errors_of_a_cell_file_are_about_a_cell(tmp_path, text, english, chinese):
    file = tmp_path / "cell.json"
    file.write_text(text)
    with pytest.raises(rcilab.RcilabError) as error:
        Cell.load(file)
    message = describe_error(error.value)
    assert english in PageText("en").render(message)
    assert chinese in PageText("zh").render(message)
