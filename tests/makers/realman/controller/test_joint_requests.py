"""The parameters of the joints: every request, the rules for setting, and what a restart keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rcilab.makers.realman.errors import RealManError
from tests.makers.realman.controller.bench import Bench

ARMS = pytest.mark.parametrize("model", ["RM65", "RM75"])
SETTERS = {
    "max_speed": (15000, "joint_speed"),
    "max_acc": (400000, "joint_acc"),
    "min_pos": (-100000, "min_pos"),
    "max_pos": (100000, "max_pos"),
}


def disabled(model: str = "RM65", joint: int = 2, file: Path | None = None) -> Bench:
    bench = Bench(model, file=file)
    assert bench.ask("set_joint_en_state", joint_en_state=[joint, 0])["joint_en_state"] is True
    return bench


@ARMS
@pytest.mark.parametrize("name", SETTERS)
@pytest.mark.parametrize("kind", ["", "drive_"])
def test_a_value_of_a_disabled_joint_is_set_and_read_back_and_the_joint_stays_disabled(model, name, kind):
    value, key = SETTERS[name]
    bench = disabled(model)
    before = bench.ask(f"get_joint_{kind}{name}")
    assert before["command" if kind else "state"] == (f"get_joint_{kind}{name}" if kind else f"joint_{name}")
    field = f"joint_{name}"
    assert bench.ask(f"set_joint_{kind}{name}", **{field: [2, value]}) == {
        "command": f"set_joint_{kind}{name}",
        field: True,
    }
    wanted = list(before[key])
    wanted[1] = value
    assert bench.ask(f"get_joint_{kind}{name}")[key] == wanted
    assert len(wanted) == bench.n
    assert bench.ask("get_joint_en_state") == {"state": "joint_en_state", "en_state": [1, 0] + [1] * (bench.n - 2)}
    assert bench.ask("get_joint_err_flag")["brake_state"][1] == 1


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("max_speed", 0, "above 0"),
        ("max_acc", 500001, "up to 500000"),
        ("min_pos", -130001, "must be -130000"),
        ("max_pos", -130000, "leave a range"),
        ("max_pos", 2**40, "integer of 32 bits"),
        ("max_speed", "fast", "integer of 32 bits"),
    ],
)
def test_a_value_out_of_bounds_is_refused_with_the_bound(name, value, problem):
    bench = disabled()
    assert bench.ask(f"set_joint_{name}", **{f"joint_{name}": [2, value]})[f"joint_{name}"] is False
    assert problem in bench.logged[-1][1]


@pytest.mark.parametrize(
    ("command", "fields"),
    [
        *((f"set_joint_{name}", {f"joint_{name}": [2, value]}) for name, (value, _) in SETTERS.items()),
        ("set_joint_zero_pos", {"joint_zero_pos": 2}),
    ],
)
def test_an_enabled_joint_one_with_an_error_and_a_wrong_joint_refuse_changes(command, fields):
    bench = Bench()
    (field,) = fields
    assert bench.ask(command, **fields)[field] is False
    assert "disable it" in bench.logged[-1][1]
    bench.ask("set_joint_en_state", joint_en_state=[2, 0])
    bench.controller.joint_errors[1] = RealManError.JOINT_OVERCURRENT.code
    assert bench.ask(command, **fields)[field] is False
    assert "0x0040" in bench.logged[-1][1]
    assert bench.ask("set_joint_en_state", joint_en_state=[2, 1])["joint_en_state"] is False
    assert bench.ask("get_joint_err_flag")["err_flag"] == [0, 64, 0, 0, 0, 0]
    assert bench.ask("set_joint_clear_err", joint_clear_err=2)["joint_clear_err"] is True
    assert bench.ask(command, **fields)[field] is True
    wrong = 9 if isinstance(fields[field], int) else [9, 1]
    assert bench.ask(command, **{field: wrong})[field] is False


def test_a_joint_whose_stream_stepped_moves_and_refuses_changes_until_it_is_cleared():
    bench = Bench()
    q = bench.q
    bench.send("movej_canfd", joint=[q[0] + 11000, *q[1:]], follow=True)
    assert bench.ask("get_joint_err_flag")["err_flag"][0] == 0x4000
    assert bench.ask("movej", joint=q, v=50)["receive_state"] is True
    bench.run_until_event()
    bench.ask("set_joint_en_state", joint_en_state=[1, 0])
    assert bench.ask("set_joint_max_speed", joint_max_speed=[1, 20000])["joint_max_speed"] is False
    bench.ask("set_joint_clear_err", joint_clear_err=1)
    assert bench.ask("set_joint_max_speed", joint_max_speed=[1, 20000])["joint_max_speed"] is True


def test_a_ratio_of_acceleration_to_speed_below_the_recommended_one_is_set_with_a_warning():
    bench = disabled()
    assert bench.ask("set_joint_max_acc", joint_max_acc=[2, 40000])["joint_max_acc"] is True
    assert bench.logged[-1][0] == "warning"
    assert "1.33" in bench.logged[-1][1]


@pytest.mark.parametrize(("first", "second"), [("", "drive_"), ("drive_", "")])
def test_controller_and_drive_leave_a_range(first, second):
    bench = Bench()
    bench.ask("set_joint_en_state", joint_en_state=[1, 0])
    assert bench.ask(f"set_joint_{first}max_pos", joint_max_pos=[1, 50000])["joint_max_pos"] is True
    for value, taken in ((100000, False), (50000, False), (49999, True)):
        assert bench.ask(f"set_joint_{second}min_pos", joint_min_pos=[1, value])["joint_min_pos"] is taken
    assert bench.ask(f"set_joint_{first}max_pos", joint_max_pos=[1, 49999])["joint_max_pos"] is False


def test_the_ranges_of_the_specification_come_back_at_once():
    bench = disabled()
    bench.ask("set_joint_max_pos", joint_max_pos=[2, 50000])
    assert bench.ask("auto_set_joint_limit", limit_mode=1)["limit_mode"] is False  # The others are enabled.
    for joint in range(1, 7):
        bench.ask("set_joint_en_state", joint_en_state=[joint, 0])
    assert bench.ask("auto_set_joint_limit", limit_mode=2)["limit_mode"] is False
    assert bench.ask("auto_set_joint_limit", limit_mode=1)["limit_mode"] is True
    assert bench.ask("get_joint_max_pos")["max_pos"] == [178000, 130000, 135000, 178000, 128000, 360000]


def test_new_limits_hold_for_checks_and_motions():
    bench = disabled(joint=1)
    bench.ask("set_joint_max_pos", joint_max_pos=[1, 30000])
    bench.ask("set_joint_max_speed", joint_max_speed=[1, 5000])
    bench.ask("set_joint_en_state", joint_en_state=[1, 1])
    q = bench.q
    assert bench.ask("movej", joint=[31000, *q[1:]], v=100)["receive_state"] is False
    assert bench.err == [RealManError.TARGET_OVER_LIMIT.code]
    assert bench.ask("movej", joint=[29000, *q[1:]], v=100)["receive_state"] is True
    speeds = []
    while not bench.events:
        bench.run(1)
        speeds.append(abs(float(bench.controller.state.dq_c[0])))
    assert np.degrees(max(speeds)) == pytest.approx(30.0, rel=1e-2)  # 5 RPM.
    assert bench.q[0] == pytest.approx(29000, abs=1)


def test_a_new_zero_is_where_the_joint_stood():
    bench = disabled(joint=1)
    bench.ask("set_joint_en_state", joint_en_state=[1, 1])
    q = bench.q
    bench.ask("movej", joint=[10000, *q[1:]], v=50)
    bench.run_until_event()
    bench.run(600)
    bench.ask("set_joint_en_state", joint_en_state=[1, 0])
    assert bench.ask("set_joint_zero_pos", joint_zero_pos=1)["joint_zero_pos"] is True
    assert bench.q[0] == 0
    bench.ask("set_joint_en_state", joint_en_state=[1, 1])
    bench.ask("movej", joint=[5000, *q[1:]], v=50)
    assert bench.run_until_event()["trajectory_state"] is True
    assert bench.q[0] == pytest.approx(5000, abs=1)
    assert np.degrees(bench.controller.arm.signals.measured.q[0]) == pytest.approx(15.0, abs=1e-3)


def test_a_joint_that_moves_is_not_enabled_and_a_disabled_one_does_not_move():
    bench = disabled()
    q = bench.q
    assert bench.ask("movej", joint=[10000, *q[1:]], v=50)["receive_state"] is False
    assert bench.err == [RealManError.JOINT_DISABLED.code]
    bench.ask("set_joint_en_state", joint_en_state=[2, 1])
    assert bench.ask("movej", joint=[10000, *q[1:]], v=50)["receive_state"] is True
    assert bench.err == [0]
    bench.run(100)
    assert bench.ask("set_joint_en_state", joint_en_state=[2, 1])["joint_en_state"] is False
    assert bench.ask("set_joint_en_state", joint_en_state=[2, 0])["joint_en_state"] is True
    bench.run(1)
    assert bench.events[-1]["trajectory_state"] is False
    bench.run(1000)
    assert not bench.controller.is_moving


def test_values_are_kept_over_a_restart_in_the_file_and_forgotten_on_request(tmp_path: Path):
    file = tmp_path / "folder" / "RM65.json"
    bench = disabled(file=file)
    bench.ask("set_joint_max_speed", joint_max_speed=[2, 12345])
    bench.ask("set_joint_drive_min_pos", joint_min_pos=[2, -90000])
    again = Bench(file=file)
    assert again.ask("get_joint_max_speed")["joint_speed"][1] == 12345
    assert again.ask("get_joint_drive_min_pos")["min_pos"][1] == -90000
    file.write_text("{}")
    broken = Bench(file=file)
    assert broken.ask("get_joint_max_speed")["joint_speed"][1] == 30000
    assert "cannot be read" in broken.logged[0][1]
    from rcilab.makers.realman.controller.flash import Flash

    Flash(file).forget()
    assert not file.exists()
