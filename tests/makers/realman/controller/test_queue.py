"""Commands that arrive during a motion begin at its end and are checked against it; a stop reports each of them."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.makers.realman.controller.bench import Bench

FRONT = [0, 20000, 0, 70000, 0, 90000, 0]


@pytest.fixture
def bench() -> Bench:
    bench = Bench("RM75")
    assert bench.q == FRONT
    return bench


def turned(angle: int) -> list[int]:
    return [angle, *FRONT[1:]]


def has_reached(bench: Bench) -> bool:
    return bench.run_until_event()["trajectory_state"] is True


def test_a_step_during_a_motion_is_checked_against_its_end(bench):
    bench.ask("movej", joint=turned(170000), v=100)
    bench.run(100)
    assert bench.ask("set_joint_step", joint_step=[1, 50000], v=50)["receive_state"] is False
    assert bench.err == [0x1002]
    assert bench.ask("set_joint_step", joint_step=[1, -50000], v=100)["receive_state"] is True
    assert bench.err == [0]
    assert has_reached(bench)
    assert bench.ask("movej", joint=FRONT, v=100)["receive_state"] is True
    assert bench.ask("set_joint_step", joint_step=[1, 120000], v=100)["receive_state"] is True
    assert has_reached(bench)
    assert bench.q == turned(120000)
    assert has_reached(bench)
    assert has_reached(bench)
    assert bench.q == turned(120000)


def test_a_step_behind_a_line_is_checked_when_its_turn_comes(bench):
    bench.ask("movel_offset", offset=[0, 0, -10000, 0, 0, 0], frame_type=0, v=100)
    assert bench.ask("set_joint_step", joint_step=[1, 179000], v=100)["receive_state"] is True
    assert has_reached(bench)
    assert not has_reached(bench)
    assert bench.err == [0x1002]


def test_offsets_and_steps_of_the_tool_begin_where_the_motion_before_them_ends(bench):
    bench.ask("set_manual_work_frame", frame_name="turned", frame_pose=[100000, 0, 0, 0, 0, 1571])
    bench.ask("set_change_work_frame", frame_name="turned")
    bench.ask("movej", joint=turned(30000), v=100)
    bench.ask("set_pos_step", step_type="z_step", step=-10000, v=100)
    bench.ask("movel_offset", offset=[5000, -20000, 0, 0, 0, 100], frame_type=0, v=100)
    bench.ask("movel_offset", offset=[0, 0, 5000, 0, 0, 0], frame_type=1, v=100)
    poses = []
    for _ in range(4):
        assert has_reached(bench)
        poses.append(bench.pose)
    shifts = [[b - a for a, b in zip(*pair, strict=True)] for pair in pairwise(poses)]
    assert shifts[0][:3] == pytest.approx([0, 0, -10000], abs=2)
    assert shifts[1][:3] == pytest.approx([5000, -20000, 0], abs=2)
    assert shifts[1][5] == pytest.approx(100, abs=1)
    assert shifts[2][:3] == pytest.approx([0, 0, -5000], abs=8)  # Its z axis points down, by 1 mrad.


@pytest.mark.parametrize("command", [{"command": "movej", "joint": FRONT}, {"command": "movel", "pose": [9000000] * 6}])
def test_an_event_never_comes_together_with_the_answer(bench, command):
    """A client in single-thread mode that receives both at once misses the event."""
    assert bench.ask(**command, v=50)["receive_state"] is True
    bench.run(9)
    assert bench.events == []
    bench.run(3)
    assert [event["trajectory_state"] for event in bench.events] == [command["command"] == "movej"]


def test_a_motion_ends_teaching(bench):
    bench.ask("set_joint_teach", teach_joint=1, direction="pos", v=20)
    bench.run(300)
    assert bench.ask("movej", joint=FRONT, v=100)["receive_state"] is True
    assert has_reached(bench)
    assert bench.q == FRONT


@pytest.mark.parametrize("command", ["movel", "moves"])
@pytest.mark.parametrize("stop", ["set_arm_stop", "set_arm_slow_stop", "fault"])
def test_an_unfinished_chain_has_an_event_for_each_command_when_it_is_discarded(bench, command, stop):
    pose = bench.pose
    for up in (-20000, -40000):
        bench.ask(command, pose=[*pose[:2], pose[2] + up, *pose[3:]], v=50, trajectory_connect=1)
    if stop == "fault":
        bench.ask("set_joint_teach", teach_joint=1, direction="pos", v=20)
        bench.run(100)
        bench.ask("set_joint_en_state", joint_en_state=[2, 0])
    else:
        bench.ask(stop)
    bench.run(11)
    assert [event["trajectory_state"] for event in bench.events] == [False, False]
    assert bench.pose[2] == pose[2]


def test_a_stream_sets_no_further_error_while_one_is_set(bench):
    for angle in range(1250, 120000, 1250):  # 250 deg/s.
        bench.send("movej_canfd", joint=turned(angle), follow=True, trajectory_mode=1)
        bench.run(5)
    assert bench.err == [0x1007]
    assert not any(bench.controller.joint_errors)


def test_a_getter_without_its_field_is_answered(bench):
    assert bench.ask("get_IO_state") == {"command": "get_IO_state", "get_state": False}
