from __future__ import annotations

import io

import numpy as np
import pytest

from rcilab.cli import main
from rcilab.model import load_model
from rcilab.motion import Motion, plan_joint
from rcilab.supervisor.launch import start_controller

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
    assert "Nothing was sent" in captured.err
    monkeypatch.setattr("sys.stdin", io.StringIO("yes\n"))
    assert main(["run", motion_file, "--robot", address]) == 0
    assert "<Run" in capsys.readouterr().out
    # The arm has moved: the same motion now starts elsewhere, and a refusal says so.
    assert main(["run", motion_file, "--robot", address, "--yes"]) in (1, 2)
    captured = capsys.readouterr()
    assert "joint" in captured.out + captured.err


def test_a_motion_that_breaks_a_condition_is_shown_and_not_sent(address, tmp_path, capsys):
    file = tmp_path / "jump.npz"
    Motion.from_samples(np.vstack([MODEL.home, MODEL.home + 0.5])).save(file)
    assert main(["run", str(file), "--robot", address, "--yes", "--model", "xMatePro7"]) == 1
    assert "does not conform" in capsys.readouterr().err


def test_bad_input_is_one_line_and_exit_code_two(motion_file, capsys):
    assert main(["run", motion_file, "--robot", "rci://127.0.0.2:9", "--timeout", "0.5"]) == 2
    assert main(["run", "no-such-file.npz", "--robot", "rci://127.0.0.2:9"]) == 2
    assert main(["run", motion_file, "--robot", "http://x"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert "teach pendant" in lines[0]
