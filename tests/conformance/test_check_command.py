import argparse

import numpy as np
import pytest

from rcilab.cli import check as command
from rcilab.core.errors import InvalidValueError, ModelError
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMate3")
MOTION = plan_joint(MODEL, MODEL.home, MODEL.home + 0.4, speed=0.5, law="s_profile")


def run(*arguments: object) -> int:
    parser = argparse.ArgumentParser()
    command.add_parser(parser.add_subparsers())
    args = parser.parse_args(["check", *map(str, arguments)])
    return args.run(args)


def test_a_good_motion_prints_its_report_and_gives_0(tmp_path, capsys):
    MOTION.save(tmp_path / "a.npz")
    assert run(tmp_path / "a.npz", "--model", "xmate3") == 0
    assert "conforms; nearest" in capsys.readouterr().out


def test_a_bad_motion_prints_what_is_wrong_and_gives_1(tmp_path, capsys):
    q = MOTION.q.copy()
    q[300, 2] += 0.1
    Motion.from_cycles(q).save(tmp_path / "a.npz")
    assert run(tmp_path / "a.npz", "--model", "xMate3") == 1
    assert "- joint 3: commanded jerk" in capsys.readouterr().out


def test_bad_input_is_an_error_of_ours_which_the_command_line_turns_into_2(tmp_path):
    MOTION.save(tmp_path / "a.npz")
    with pytest.raises(ModelError, match="known robots"):
        run(tmp_path / "a.npz", "--model", "xMate9")
    with pytest.raises(InvalidValueError, match="does not exist"):
        run(tmp_path / "b.npz", "--model", "xMate3")
    with pytest.raises(InvalidValueError, match="for 6 joints, xMatePro7 has 7"):
        run(tmp_path / "a.npz", "--model", "xMatePro7")
    np.savez(tmp_path / "c.npz", photo=np.zeros(3))
    with pytest.raises(InvalidValueError, match="does not contain a motion"):
        run(tmp_path / "c.npz", "--model", "xMate3")


def test_a_motion_that_is_too_fast_is_written_slowed_down_and_the_new_one_passes(tmp_path, capsys):
    fast = Motion(polynomial=MOTION.polynomial.slowed(1.0 / 3.0), goal=MOTION.goal, law=MOTION.law)
    fast.save(tmp_path / "a.npz")
    assert run(tmp_path / "a.npz", "--model", "xMate3") == 1
    assert run(tmp_path / "a.npz", "--model", "xMate3", "--slow-down", tmp_path / "b.npz") == 0
    said = capsys.readouterr().out
    assert "slow-down: It conforms" in said
    assert f"written: {tmp_path / 'b.npz'}" in said
    assert run(tmp_path / "b.npz", "--model", "xMate3") == 0
    assert Motion.load(tmp_path / "b.npz").duration > 1.2 * fast.duration


def test_a_motion_that_no_slow_down_mends_is_not_written(tmp_path, capsys):
    Motion.from_cycles(np.repeat([MODEL.limits.joint.upper], 3, axis=0)).save(tmp_path / "a.npz")
    assert run(tmp_path / "a.npz", "--model", "xMate3", "--slow-down", tmp_path / "b.npz") == 1
    assert "slow-down: No slow-down corrects it" in capsys.readouterr().out
    assert not (tmp_path / "b.npz").exists()


def test_it_can_be_said_in_whole_sentences_in_chinese(tmp_path, capsys):
    MOTION.save(tmp_path / "a.npz")
    assert run(tmp_path / "a.npz", "--model", "xMate3", "--explain", "zh") == 0
    assert capsys.readouterr().out.startswith("机器人会接受该运动")
