"""Programs on the command line: checked like motions, with what their planner and their reader have to say."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from rcilab.cli import main
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, plan_joint, plan_program

MODEL = load_model("xMatePro7")
HOME = MODEL.forward(MODEL.home)
PROGRAM = Program(
    model="xMatePro7",
    start=MODEL.home,
    waypoints=(
        Waypoint.line(Pose(HOME.position + (0.0, 0.05, 0.0), HOME.wxyz), speed=1.0, blend=0.2),
        Waypoint.joint(MODEL.home + 0.1, speed=1.0),
    ),
)


@pytest.fixture
def file(tmp_path):
    PROGRAM.save(tmp_path / "program.json")
    return tmp_path / "program.json"


def test_check_plans_a_program_for_its_own_arm_and_says_what_was_shortened(file, tmp_path, capsys):
    assert main(["check", str(file), "--slow-down", str(tmp_path / "out.npz")]) == 0
    said = capsys.readouterr().out
    assert said.startswith("note: waypoint 1 (line): blend radius 200.0 mm shortened to 25.0 mm")
    assert "conforms" in said
    written = Motion.load(tmp_path / "out.npz")
    assert written.fingerprint == plan_program(MODEL, PROGRAM, law="torque_rate_limited").fingerprint
    assert set(written.segment) == {0, 1}


def test_check_refuses_another_arm_and_a_spoiled_file_in_one_line(file, capsys):
    assert main(["check", str(file), "--model", "xMate3"]) == 2
    assert "program: 'xMatePro7' is the model of the program, not xMate3" in capsys.readouterr().err
    file.write_text(file.read_text().replace('"speed": 1.0', '"speed": 7', 1))
    assert main(["check", str(file)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "program.json, line 8, waypoint 1 (line), speed must be from 0.001 to 1" in said


def test_a_motion_needs_the_name_of_an_arm(tmp_path, capsys):
    plan_joint(MODEL, MODEL.home, MODEL.home + 0.1).save(tmp_path / "motion.npz")
    assert main(["check", str(tmp_path / "motion.npz")]) == 2
    assert "add --model NAME" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "motion.npz"), "--model", "xMatePro7"]) == 0


def test_check_judges_as_it_will_be_sent_and_refuses_a_mode_that_is_none(file, capsys):
    assert main(["check", str(file), "--mode", "cartesian_position"]) in (0, 1)
    assert "cartesian.velocity.translation" in capsys.readouterr().out
    assert main(["check", str(file), "--mode", "sideways"]) == 2
    assert "known: joint_position" in capsys.readouterr().err


def test_a_slow_down_does_not_take_the_place_of_what_is_judged(file, tmp_path, capsys):
    rows = tmp_path / "rows.csv"
    plan_joint(MODEL, MODEL.home, MODEL.home + 0.1).save(rows)
    before = rows.read_bytes()
    assert main(["check", str(rows), "--model", "xMatePro7", "--slow-down", str(tmp_path / "." / "rows.csv")]) == 2
    assert "is the file to check" in capsys.readouterr().err
    assert rows.read_bytes() == before


@pytest.mark.parametrize("name", ["none.npz", "x" * 300 + ".npz", "x" * 300 + ".rcirun"])
def test_a_file_that_does_not_exist_is_named_in_one_line(file, tmp_path, capsys, name):
    there = tmp_path / "there.npz"
    there.touch()
    assert main(["check", str(tmp_path / name), "--model", "xMatePro7", "--slow-down", str(there)]) == 2
    assert main(["check", str(file), "--slow-down", str(tmp_path / name)]) == (0 if name == "none.npz" else 2)
    assert "Traceback" not in capsys.readouterr().err


def test_json_has_the_verdict_every_condition_and_the_slow_down(file, tmp_path, capsys):
    fast = Motion.from_cycles(plan_program(MODEL, PROGRAM).q[::2])
    fast.save(tmp_path / "fast.csv")
    argv = ["check", str(tmp_path / "fast.csv"), "--model", "xmatepro7", "--json"]
    assert main(argv) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["model"], found["ok"]) == ("xMatePro7", False)
    assert found["violations"][0]["fault"].startswith("k")
    assert len(found["conditions"]) == len({row["id"] for row in found["conditions"]}) > 10
    assert main([*argv, "--slow-down", str(tmp_path / "out.csv")]) in (0, 1)
    slowed = json.loads(capsys.readouterr().out)["slow_down"]
    assert (slowed["factor"] is None) == (slowed["written"] is None)


def test_a_reader_that_goes_away_leaves_the_exit_code_and_no_traceback(file):
    command = [sys.executable, "-m", "rcilab.cli"]
    doctor = main(["doctor", "--seconds", "0"])
    for arguments, code in (
        (["check", str(file)], 0),
        (["check", "no.npz"], 2),
        (["urdf", "xMatePro7"], 141),
        (["doctor", "--seconds", "0"], doctor),
    ):
        process = subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        process.stdout.close()
        err = process.stderr.read()
        process.stderr.close()
        assert process.wait(30) == code, err
        assert "Traceback" not in err
        assert "BrokenPipe" not in err


def test_a_waypoint_that_cannot_be_planned_is_named_with_its_file_and_line(tmp_path, capsys):
    home = list(MODEL.home)
    waypoints = [{"type": "joint", "q": home}, {"type": "line", "position": [5.5, 0.1, 0.4], "wxyz": [0, 0, 1, 0]}]
    rows = ",\n".join(json.dumps(waypoint) for waypoint in waypoints)
    text = f'{{"format": "rcilab program", "version": 1, "model": "{MODEL.name}",\n"start": {json.dumps(home)},\n'
    (tmp_path / "far.json").write_text(f'{text}"waypoints": [\n{rows}]}}\n')
    assert main(["check", str(tmp_path / "far.json")]) == 2
    assert "far.json, line 5, waypoint 2 (line)" in capsys.readouterr().err


def test_a_recorded_run_is_refused_with_the_command_that_shows_it(tmp_path, capsys):
    run = tmp_path / "mine.rcirun"
    run.write_bytes(b"of a run")
    assert main(["run", str(run), "--robot", "rci://127.0.0.1:1"]) == 2
    assert f"open it with `rcilab replay {run}`" in capsys.readouterr().err
