"""`rcilab check` of recorded runs, and with tool, load and safety box on the command line."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import rcilab
from rcilab.cli import main
from rcilab.control_process.simulate import simulate
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, plan_joint
from rcilab.motion.program import box_numbers
from rcilab.recording.run import build_run, load_run
from rcilab.recording.sent_motion import sent_motion
from tests.recording.runs import MODEL, PLAN, SETUP, some_cycles, some_run

BOX = SafetyBox(size=(2.0, 2.0, 2.0), T_base_box=Pose((0.0, 0.0, 0.5)))


def run_of(cycles: np.ndarray, **facts):
    return build_run(cycles, plan=None, model=MODEL, setup=SETUP, **facts)


def report_of(capsys, *argv: str) -> tuple[int, dict]:
    code = main(["check", *argv, "--json"])
    return code, json.loads(capsys.readouterr().out)


def row(report: dict, condition: str) -> dict:
    return next(entry for entry in report["conditions"] if entry["id"] == condition)


def test_a_run_is_checked_with_its_own_arm_tool_and_load(tmp_path, capsys):
    run_of(some_cycles()).save(tmp_path / "a.rcirun")
    assert main(["check", str(tmp_path / "a.rcirun")]) == 0
    said = capsys.readouterr().out
    assert "note: with tool 0, 10, 120 mm turned by" in said
    assert "load 1.5 kg at 0, 0, 0 mm" in said
    assert "xMatePro7" in said


def test_a_run_is_checked_with_the_soft_limits_that_were_in_force(tmp_path, capsys):
    lower, upper = MODEL.limits.joint.lower.tolist(), MODEL.limits.joint.upper.tolist()
    upper[1] = PLAN.q[:, 1].max() - 0.01
    settings = {"joint_lower": lower, "joint_upper": upper}
    cycles = some_cycles()
    build_run(cycles, plan=None, model=MODEL, setup=replace(SETUP, settings=settings)).save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 1
    assert (report["violations"][0]["id"], report["violations"][0]["place"]) == ("joint.position", "joint 2")
    assert "soft limits joint 2 " in report["arm"]
    assert "joint 1 " not in report["arm"]


def test_what_was_sent_is_checked_not_the_plan_and_not_what_the_controller_made_of_it(tmp_path, capsys):
    cycles = some_cycles().copy()
    cycles["command"][200, 3] += 5e-4
    build_run(cycles, plan=PLAN, model=MODEL, setup=SETUP).save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 1
    assert report["arm"].startswith("with tool 0, 10, 120 mm")
    worst = report["violations"][0]
    assert (worst["place"], worst["worst_time"]) == ("joint 4", pytest.approx(0.2, abs=2.1e-3))


def test_lost_commands_are_interpolated_without_a_step(tmp_path):
    cycles = some_cycles().copy()
    cycles["command"][150:153] = cycles["command"][300] = np.nan
    motion = sent_motion(run_of(cycles))
    np.testing.assert_allclose(motion.q, PLAN.q, atol=2e-8)  # 0.1 of the step that 100 rad/s^3 makes in 3 ms.
    assert motion.notes == ("4 commands are missing in the record and interpolated: they never came, or came too late",)
    assert sent_motion(run_of(some_cycles())).notes == ()


def test_the_first_command_is_compared_with_the_state_before_it(tmp_path, capsys):
    cycles = some_cycles().copy()
    cycles["q_c"] -= 0.01
    run_of(cycles).save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 1
    assert report["violations"][0]["time"] <= 0.001


def test_a_run_of_poses_is_checked_by_the_poses_that_were_sent(tmp_path, capsys):
    model = load_model("xMatePro7")
    motion = plan_joint(model, model.home, model.home + 0.05, speed=0.1)
    with simulate(model) as robot:
        robot.power_on()
        robot.execute(plan_joint(model, robot.state.q_c, model.home))
        robot.execute(motion, mode="cartesian_position").save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 0
    assert "cartesian_position" in report["title"]
    assert row(report, "cartesian.velocity.translation")["value"] > 0.0
    run = load_run(tmp_path / "a.rcirun")
    cycles = run.cycles.copy()
    cycles["command_pose"][0, 1, 3] += 0.1  # [m]
    replace(run, cycles=cycles).save(tmp_path / "b.rcirun")
    assert report_of(capsys, str(tmp_path / "b.rcirun"))[0] == 1
    cycles["command_pose"][100, 0, 3] += 3.0
    replace(run, cycles=cycles[1:]).save(tmp_path / "c.rcirun")
    code, report = report_of(capsys, str(tmp_path / "c.rcirun"))
    assert code == 1
    assert "cartesian.frame" in {violation["id"] for violation in report["violations"]}


def test_a_run_of_torques_is_checked_by_the_torques_that_were_sent(tmp_path, capsys):
    model = load_model("xMatePro7")
    with simulate(model) as robot:
        robot.power_on()

        def callback(state, t):
            tau = np.zeros(7)
            tau[0] = 3.0 * min(t, 0.1)
            return rcilab.JointTorque(tau, finished=t >= 0.2)

        run = robot.control(callback, "torque")
    run.save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 0
    assert row(report, "torque.range")["value"] == pytest.approx(0.3)
    assert row(report, "torque.rate")["value"] == pytest.approx(3.0)
    cycles = run.cycles.copy()
    cycles["command_tau"][50, 2] += 2.0
    replace(run, cycles=cycles).save(tmp_path / "b.rcirun")
    code, report = report_of(capsys, str(tmp_path / "b.rcirun"))
    assert code == 1
    assert report["violations"][0]["id"] == "torque.rate"
    assert report["violations"][0]["place"] == "joint 3"
    assert main(["check", str(tmp_path / "b.rcirun"), "--slow-down", str(tmp_path / "c.npz")]) == 2
    assert "torques cannot be slowed down" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "b.rcirun"), "--explain", "en"]) == 1
    assert "Remedy: " in capsys.readouterr().out


def test_why_a_run_ended_early_is_in_its_report(tmp_path, capsys):
    some_run(stopped="on request").save(tmp_path / "a.rcirun")
    assert main(["check", str(tmp_path / "a.rcirun")]) == 0
    assert "the run ended early: on request" in capsys.readouterr().out


def test_options_take_the_place_of_the_tool_the_load_and_the_box_of_a_file(tmp_path, capsys):
    file = tmp_path / "a.csv"
    Motion.from_cycles(PLAN.q).save(file)
    argv = [str(file), "--model", "xMatePro7", "--mode", "cartesian_position"]
    _, short = report_of(capsys, *argv)
    _, long = report_of(capsys, *argv, "--tool", "0,0,300mm", "--load", "3@0,0,100mm", "--box", "2,2,2@0,0,0.5")
    speed = "cartesian.velocity.translation"
    assert abs(row(long, speed)["value"]) > 1.1 * abs(row(short, speed)["value"])
    assert {entry["id"] for entry in long["conditions"]} - {entry["id"] for entry in short["conditions"]} == {
        "cartesian.position"
    }
    heavy = report_of(capsys, str(file), "--model", "xMatePro7", "--load", "3@0,0,100mm")[1]
    light = report_of(capsys, str(file), "--model", "xMatePro7")[1]
    assert abs(row(heavy, "joint.torque")["value"]) > 1.1 * abs(row(light, "joint.torque")["value"])
    assert main(["check", *argv, "--tool", "0,0"]) == 2
    assert "--tool: '0,0' is not of the form" in capsys.readouterr().err


def test_a_program_file_is_checked_with_its_own_load_and_box(tmp_path, capsys):
    model = load_model("xMatePro7")
    program = Program(
        model=model.name,
        start=model.home,
        waypoints=(Waypoint.joint(model.home + 0.1),),
        tool=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0),
        payload=(2.0, 0.0, 0.0, 0.05),
        box=box_numbers(BOX),
    )
    program.save(tmp_path / "a.json")
    assert main(["check", str(tmp_path / "a.json")]) == 0
    assert "with tool 0, 0, 100 mm, load 2 kg at 0, 0, 50 mm, safety box 2000 x 2000 x 2000 mm around 0, 0, 500 mm" in (
        capsys.readouterr().out
    )
    tool = program.applied_to(model).forward(model.home)
    narrow = SafetyBox(size=(0.02, 0.02, 0.02), T_base_box=tool)
    replace(program, box=box_numbers(narrow)).save(tmp_path / "a.json")
    assert main(["check", str(tmp_path / "a.json")]) == 1
    assert main(["check", str(tmp_path / "a.json"), "--box", "2,2,2@0,0,0.5"]) == 0


def test_a_run_that_ended_in_the_middle_is_not_blamed_for_a_jump_at_its_end(tmp_path, capsys):
    run_of(some_cycles()[:300], stopped="an emergency stop was pressed").save(tmp_path / "a.rcirun")
    assert main(["check", str(tmp_path / "a.rcirun")]) == 0
    said = capsys.readouterr().out
    assert "note: the run ended early: an emergency stop was pressed" in said
    assert "motion samples of 0.299 s" in said
    spoiled = some_cycles()[:300].copy()
    spoiled["command"][150, 1] += 1e-4
    run_of(spoiled, stopped="joint 2: jump").save(tmp_path / "b.rcirun")
    code, report = report_of(capsys, str(tmp_path / "b.rcirun"))
    assert code == 1
    assert {violation["place"] for violation in report["violations"]} == {"joint 2"}
    assert all(0.149 < violation["worst_time"] < 0.154 for violation in report["violations"])


def test_a_jump_at_the_end_of_a_run_is_a_violation_and_no_stop_is_written(tmp_path, capsys):
    cycles = some_cycles()[:300].copy()
    cycles["command"][-1, 1] += 1e12
    run_of(cycles, stopped="joint 2: jump").save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 1
    assert report["violations"][0]["place"] == "joint 2"
    assert main(["check", str(tmp_path / "a.rcirun"), "--slow-down", str(tmp_path / "b.npz")]) == 1


def test_a_run_refused_at_its_second_command_is_checked_by_its_two_commands(tmp_path, capsys):
    """Their jerk is that of one jump; commands that stayed there would have twice as much, with the other sign."""
    jump = 1e-4  # [rad]
    cycles = some_cycles()[:2].copy()
    cycles["command"] = MODEL.home
    cycles["command"][1, 1] += jump
    cycles["q_c"] = MODEL.home
    run_of(cycles, stopped="joint 2: jump").save(tmp_path / "a.rcirun")
    code, report = report_of(capsys, str(tmp_path / "a.rcirun"))
    assert code == 1
    assert row(report, "joint.jerk")["value"] == pytest.approx(jump / 1e-9)
    assert all(violation["worst_time"] < 0.0015 for violation in report["violations"])


def test_a_run_whose_file_is_damaged_before_its_first_cycles_is_named_damaged(tmp_path, capsys):
    file = tmp_path / "a.rcirun"
    some_run().save(file)
    content = file.read_bytes()
    whole = len(content)
    place = whole // 2
    file.write_bytes(content[:place] + bytes(4 * [255]) + content[place + 4 :])
    assert main(["check", str(file)]) == 2
    assert "there are no cycles in this run: the rest of its file is damaged" in capsys.readouterr().err


def test_a_check_of_the_table_of_a_run_names_what_is_checked(tmp_path, capsys):
    some_run().save(tmp_path / "a.csv")
    main(["check", str(tmp_path / "a.csv"), "--model", MODEL.name])
    assert "its measured angles q are checked, without tool, load and box" in capsys.readouterr().out
    Motion.from_cycles(PLAN.q).save(tmp_path / "b.csv")
    main(["check", str(tmp_path / "b.csv"), "--model", MODEL.name])
    assert "measured" not in capsys.readouterr().out


def test_a_slowed_run_ends_at_standstill(tmp_path, capsys):
    run_of(some_cycles()[:300], stopped="an emergency stop was pressed").save(tmp_path / "a.rcirun")
    assert main(["check", str(tmp_path / "a.rcirun"), "--slow-down", str(tmp_path / "b.npz")]) == 0
    written = Motion.load(tmp_path / "b.npz")
    assert written.duration > 0.3
    assert f"a stop of {written.duration - 0.299:.3f} s is added to the 0.299 s" in capsys.readouterr().out
    assert np.abs(np.diff(written.q[-2:], axis=0)).max() < 1e-6


def test_a_run_checked_as_one_of_another_arm_has_a_note(tmp_path, capsys):
    run_of(some_cycles()).save(tmp_path / "a.rcirun")
    main(["check", str(tmp_path / "a.rcirun"), "--model", "xMatePro3", "--load", "1@0,0,0"])
    assert "note: the run is of the xMatePro7, checked as one of the xMatePro3" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([[k, *angles] for k, angles in enumerate(PLAN.q)], "name their column t [ms]"),
        ([[1e5 * k, *angles] for k, angles in enumerate(PLAN.q)], "name their column t [ms]"),
        (PLAN.q, "has 6 joints after the time, xMatePro7 has 7; is there a column t [s]?"),
        (-PLAN.q, "the first column is the time: is it missing?"),
    ],
)
def test_a_table_with_wrong_times_names_the_cause(tmp_path, capsys, rows, expected):
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",")
    main(["check", str(tmp_path / "a.csv"), "--model", "xMatePro7"])
    said = capsys.readouterr()
    assert expected in said.out + said.err
