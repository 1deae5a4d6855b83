from __future__ import annotations

import io
import json
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from rcilab.cli import main
from rcilab.control_process.launch import start_controller
from rcilab.core.command import JointPosition
from rcilab.core.errors import ControlError
from rcilab.execution.connect import connect
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, plan_joint
from rcilab.recording.run import load_run
from tests.waiting import wait_for

MODEL = load_model("xMatePro7")
GOAL = np.array([0.2, 0.5, 0.1, 1.1, 0.0, 1.4, 0.1])


@pytest.fixture(scope="module")
def address():
    controller = start_controller(MODEL.name, lockstep=True)
    yield controller.address
    controller.end()


@pytest.fixture
def motion_file(tmp_path):
    file = tmp_path / "motion.npz"
    plan_joint(MODEL, MODEL.home, GOAL, speed=1.0).save(file)
    return str(file)


def test_without_a_yes_nothing_is_sent_and_with_one_the_arm_arrives(address, motion_file, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO("no\n"))
    assert main(["run", motion_file, "--robot", address]) == 1
    captured = capsys.readouterr()
    assert "xMatePro7 at rci://127.0.0.2" in captured.out
    assert "'no' is not 'yes': nothing was sent." in captured.err.splitlines()
    monkeypatch.setattr("sys.stdin", io.StringIO("yes\n"))
    assert main(["run", motion_file, "--robot", address]) == 0
    assert "<Run" in capsys.readouterr().out
    # The arm has moved: the same motion now starts elsewhere, and a refusal says so.
    assert main(["run", motion_file, "--robot", address, "--yes"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("rcilab: the motion does not start at the arm's position: joint ")
    assert line.endswith("rcilab run --to-start moves the arm to the start of the file, after a confirmation")


def test_the_way_to_the_start_has_a_report_and_a_question_of_its_own(address, tmp_path, monkeypatch, capsys):
    with connect(address) as robot:
        q = robot.state.q_c
    file = tmp_path / "elsewhere.csv"
    plan_joint(MODEL, q + 0.1, q + 0.15, speed=1.0).save(file)
    monkeypatch.setattr("sys.stdin", io.StringIO("no\n"))
    assert main(["run", str(file), "--robot", address, "--to-start"]) == 1
    assert capsys.readouterr().out.count("will move for") == 1
    monkeypatch.setattr("sys.stdin", io.StringIO("yes\nyes\n"))
    assert main(["run", str(file), "--robot", address, "--to-start"]) == 0
    captured = capsys.readouterr()
    assert captured.out.count("conforms") == captured.out.count("<Run") == captured.out.count("Type yes: ") == 2
    with connect(address) as robot:
        assert np.allclose(robot.state.q_c, q + 0.15, atol=1e-6)


def test_to_start_clears_a_fault_first(address, tmp_path, capsys):
    with connect(address) as robot:
        robot.power_on()
        q = robot.state.q_c
        with pytest.raises(ControlError):
            robot.control(lambda state, t: JointPosition(q=q + (0.2 if t > 0.01 else 0.0)), mode="joint_position")
    file = tmp_path / "motion.npz"
    plan_joint(MODEL, q + 0.05, q + 0.1, speed=1.0).save(file)
    assert main(["run", str(file), "--robot", address, "--yes"]) == 2
    with connect(address) as robot:
        q_c = robot.state.q_c
    plan_joint(MODEL, q_c, q + 0.1).save(tmp_path / "here.npz")
    assert main(["run", str(tmp_path / "here.npz"), "--robot", address, "--yes"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "()" not in captured.err
    assert "rcilab run --to-start clears the fault" in captured.err
    assert main(["run", str(file), "--robot", address, "--yes", "--to-start"]) == 0
    assert "The robot is stopped by kCommandJoint" in capsys.readouterr().out


def test_json_is_one_object_on_stdout_and_all_text_is_on_stderr(address, tmp_path, capsys):
    with connect(address) as robot:
        q = robot.state.q_c
    file = tmp_path / "motion.npz"
    plan_joint(MODEL, q, q - 0.05, speed=1.0).save(file)
    assert main(["run", str(file), "--robot", address, "--yes", "--json"]) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert found["outcome"] == "done"
    (move,) = found["moves"]
    assert move["report"]["ok"] is True
    assert move["run"]["stopped"] is None
    assert "will move for" in captured.err


def test_json_names_what_ends_a_run_or_prevents_it(tmp_path, capsys):
    controller = start_controller(MODEL.name)
    try:
        file = tmp_path / "motion.npz"
        plan_joint(MODEL, MODEL.home, GOAL, speed=0.5).save(file)
        host, port = controller.world_address.split(":")
        with SimulationControl(host, int(port)) as world:
            world.push((0, 0, -200, 0, 0, 0))
            saved = tmp_path / "fault.rcirun"
            command = ["run", str(file), "--robot", controller.address, "--yes", "--json"]
            assert main([*command, "--save", str(saved)]) == 2
        captured = capsys.readouterr()
        found = json.loads(captured.out)
        assert captured.err.endswith(f"; the run is in {saved}\n")
        assert "()" not in captured.err
        assert load_run(saved).faults == (Fault.COLLISION,)
        assert found["outcome"] == "failed"
        assert found["error"]["type"] == "ControlError"
        assert found["error"]["faults"] == ["kCollision"]
        assert found["error"]["text"] in captured.err
    finally:
        controller.end()
    assert main(["run", str(tmp_path / "none.npz"), "--robot", controller.address, "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["type"] == "InvalidValueError"
    assert main(["check", str(tmp_path / "none.npz"), "--model", "xMatePro7", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["ok"] is False


def test_a_question_that_cannot_be_read_is_not_agreed_to(address, tmp_path):
    with connect(address) as robot:
        q = robot.state.q_c
    file = tmp_path / "motion.npz"
    plan_joint(MODEL, q, q + 0.01).save(file)
    command = [sys.executable, "-u", "-m", "rcilab.cli", "run", str(file), "--robot", address]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.close()
    process.stdin.write("yes\n")
    process.stdin.close()
    err = process.stderr.read()
    process.stderr.close()
    assert process.wait(20) == 1, err
    assert err.strip().endswith("nothing was sent.")
    assert "Traceback" not in err


def test_a_program_is_planned_for_the_robot_s_arm_and_runs(address, tmp_path, capsys):
    with connect(address) as robot:
        start = robot.state.q_c
    steps = Waypoint.joint(start + 0.05, speed=1.0, blend=0.01), Waypoint.joint(start, speed=1.0)
    Program(model="xMatePro7", start=start, waypoints=steps).save(tmp_path / "program.json")
    assert main(["run", str(tmp_path / "program.json"), "--robot", address, "--yes"]) == 0
    assert "<Run" in capsys.readouterr().out


def test_another_arm_than_the_robot_s_is_refused_and_both_are_named(address, motion_file, capsys):
    assert main(["run", motion_file, "--robot", address, "--model", "xMatePro3", "--yes"]) == 2
    assert "is an xMatePro7 (7 axes), you gave xMatePro3 (7)" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_brings_the_arm_to_rest_and_says_where(number, tmp_path):
    controller = start_controller(MODEL.name)
    try:
        file = tmp_path / "slow.npz"
        plan_joint(MODEL, MODEL.home, GOAL, speed=0.05).save(file)
        process = subprocess.Popen(
            [sys.executable, "-m", "rcilab.cli", "run", str(file), "--robot", controller.address, "--yes"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        while "will move for" not in (line := process.stdout.readline()):
            assert line, process.stderr.read()
        host, port = controller.world_address.split(":")
        with SimulationControl(host, int(port)) as world:
            wait_for(lambda: np.abs(np.array(world.status().q) - MODEL.home).max() > 1e-4, what="the arm moving")
        process.send_signal(number)
        out, err = process.communicate(timeout=20)
        assert process.returncode == 1, err
        assert re.search(r"^stopped on request at t = \d+\.\d\d s; the arm is at rest", err, re.MULTILINE)
        assert "<Run" in out
        with connect(controller.address) as robot:
            state = robot.state
            assert state.faults == ()
            assert np.abs(state.dq).max() < 1e-9
            assert 0.0 < np.abs(state.q_c - MODEL.home).max() < np.abs(GOAL - MODEL.home).max()
    finally:
        controller.end()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_at_the_prompt_sends_nothing_and_says_so(number, address, tmp_path):
    with connect(address) as robot:
        q = robot.state.q_c
    file = tmp_path / "motion.npz"
    plan_joint(MODEL, q, q + 0.01).save(file)
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "rcilab.cli", "run", str(file), "--robot", address],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while "will move for" not in (line := process.stdout.readline()):
        assert line, process.stderr.read()
    time.sleep(0.3)
    process.send_signal(number)
    _, err = process.communicate(timeout=20)
    assert (process.returncode, err.strip()) == (1, "Nothing was sent.")


def test_a_motion_that_breaks_a_condition_is_shown_and_not_sent(address, tmp_path, capsys):
    file = tmp_path / "jump.npz"
    with connect(address) as robot:
        q = robot.state.q_c
    Motion.from_cycles(np.vstack([q, q + 0.5])).save(file)
    assert main(["run", str(file), "--robot", address, "--yes", "--model", "xMatePro7"]) == 1
    assert "does not conform" in capsys.readouterr().err


def test_a_motion_that_breaks_a_condition_does_not_move_the_arm_to_its_start(address, tmp_path, capsys):
    file = tmp_path / "elsewhere.npz"
    with connect(address, MODEL) as robot:
        here = robot.state.q_c
    Motion.from_cycles(np.vstack([here + 0.1, here + 0.6])).save(file)
    assert main(["run", str(file), "--robot", address, "--to-start", "--yes", "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert [move["outcome"] for move in answer["moves"]] == ["not_conforming"]
    with connect(address, MODEL) as robot:
        assert np.array_equal(robot.state.q_c, here)


def test_bad_input_is_one_line_and_exit_code_two(motion_file, capsys):
    assert main(["run", motion_file, "--robot", "rci://127.0.0.2:9", "--timeout", "0.5"]) == 2
    assert main(["run", "no-such-file.npz", "--robot", "rci://127.0.0.2:9"]) == 2
    assert main(["run", motion_file, "--robot", "http://x"]) == 2
    for file in ("run.txt", "no-such-folder/run.csv"):
        assert main(["run", motion_file, "--robot", "rci://127.0.0.2:9", "--save", file]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 5
    assert "teach pendant" in lines[0]


def test_tool_load_and_box_of_a_program_are_reported_and_sent_with_apply(tmp_path, capsys):
    controller = start_controller(MODEL.name, lockstep=True)
    file = tmp_path / "program.json"
    program = Program(
        model=MODEL.name,
        start=MODEL.home,
        waypoints=(Waypoint.joint(GOAL, speed=1.0),),
        tool=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0),
        payload=(2.0, 0.0, 0.0, 0.0),
        box=(2.0, 2.0, 2.0, 0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0),
    )
    program.save(file)
    try:
        assert main(["run", str(file), "--robot", controller.address, "--yes"]) == 0
        output = capsys.readouterr().out
        assert output.count("note: the tool of") == output.count("note: the load of") == 1
        replace(program, start=tuple(GOAL), waypoints=(Waypoint.joint(MODEL.home, speed=1.0),)).save(file)
        assert main(["run", str(file), "--robot", controller.address, "--yes", "--apply"]) == 0
        assert "note:" not in capsys.readouterr().out
        with connect(controller.address, program.applied_to(MODEL)) as robot:  # A difference would be a warning.
            assert robot.state.tau[1] == pytest.approx(-57.52, abs=0.01)
    finally:
        controller.end()
