"""Motions: their ends, paths, stops and refusals, and what streams."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rcilab.makers.realman.errors import RealManError
from rcilab.sim.channels import Peer
from tests.makers.realman.controller.bench import Bench

FRONT = {"RM65": [0, -20000, -70000, 0, -90000, 0], "RM75": [0, 20000, 0, 70000, 0, 90000, 0]}
ARMS = pytest.mark.parametrize("model", FRONT)


def moved(pose: list[int], x: int = 0, y: int = 0, z: int = 0) -> list[int]:
    return [pose[0] + x, pose[1] + y, pose[2] + z, *pose[3:]]


@ARMS
@pytest.mark.parametrize("command", ["movel", "movej_p"])
def test_the_tool_arrives_at_its_pose_and_the_client_is_informed_once(model, command):
    bench = Bench(model)
    goal = moved(bench.pose, x=-20000, z=50000)
    assert bench.ask(command, pose=goal, v=50, r=0, trajectory_connect=0) == {"command": command, "receive_state": True}
    kind = {"movel": "movel", "movej_p": "movej"}[command]
    bench.run(50)
    assert bench.ask("get_arm_current_trajectory")["type"] == kind
    assert bench.run_until_event() == {
        "state": "current_trajectory_state",
        "trajectory_state": True,
        "device": 0,
        "trajectory_connect": 0,
    }
    np.testing.assert_allclose(bench.pose[:3], goal[:3], atol=1)
    bench.run(600)
    assert len(bench.events) == 1
    assert bench.ask("get_arm_current_trajectory") == {
        "state": "arm_current_trajectory",
        "type": "none",
        "data": bench.q,
    }


def test_a_pose_is_reached_inside_the_ranges_also_across_the_turn_of_joint_1():
    bench = Bench("RM75")
    assert bench.ask("movej_p", pose=[-300000, 0, 300000, 3142, 0, 0], v=100)["receive_state"] is True
    assert bench.run_until_event()["trajectory_state"] is True
    np.testing.assert_allclose(bench.pose[:3], [-300000, 0, 300000], atol=1)


def test_the_ends_of_a_range_can_be_reached():
    bench = Bench()
    ends = [178000, -130000, 135000, 178000, 128000, 360000]
    assert bench.ask("movej", joint=ends, v=100)["receive_state"] is True
    assert bench.run_until_event()["trajectory_state"] is True
    assert bench.q == ends
    bench.run(600)
    assert not bench.controller.faults


@ARMS
def test_joints_keep_their_limits_and_v_is_their_share(model):
    bench = Bench(model)
    goal = [angle + 30000 for angle in bench.q]
    assert bench.ask("movej", joint=goal, v=20)["receive_state"]
    limits = bench.controller.limits.joint
    dq, ddq = [], []
    while not bench.events:
        bench.run(1)
        dq.append(bench.controller.state.dq_c)
        ddq.append(bench.controller.state.ddq_c)
    assert np.abs(dq).max() <= 0.2 * limits.velocity.min() * (1.0 + 1e-6)
    assert np.abs(dq).max() > 0.19 * limits.velocity.min()
    assert (np.abs(ddq).max(axis=0) <= limits.acceleration).all()
    np.testing.assert_allclose(bench.q, goal, atol=1)


def test_a_line_is_straight_and_as_fast_as_the_share_of_the_tools_speed():
    bench = Bench()
    start = np.array(bench.pose[:3])
    bench.ask("set_arm_max_line_speed", arm_line_speed=100)
    bench.ask("movel", pose=moved(bench.pose, y=100000), v=50)
    points, speeds = [], []
    while not bench.events:
        bench.run(1)
        points.append(bench.controller.state.T_base_tool_c.position)
        speeds.append(np.linalg.norm(bench.controller.state.tool_velocity_c[:3]))
    off = (np.array(points) - 1e-6 * start)[:, [0, 2]]
    assert np.abs(off).max() < 2e-6
    assert max(speeds) == pytest.approx(0.05, rel=1e-3)


def test_an_arc_goes_through_its_middle_and_a_circle_comes_back():
    bench = Bench()
    start = bench.pose
    via, end = moved(start, y=30000, z=30000), moved(start, y=60000)
    bench.ask("movec", pose={"pose_via": via, "pose_to": end}, v=50, loop=0)
    points = []
    while not bench.events:
        bench.run(1)
        points.append(bench.controller.state.T_base_tool_c.position)
    assert np.linalg.norm(np.array(points) - 1e-6 * np.array(via[:3]), axis=1).min() < 1e-4
    np.testing.assert_allclose(bench.pose[:3], end[:3], atol=1)
    bench.ask("movec", pose={"pose_via": via, "pose_to": start}, v=50, loop=1)
    assert bench.run_until_event()["trajectory_state"] is True
    np.testing.assert_allclose(bench.pose[:3], end[:3], atol=1)


def test_a_chain_begins_with_its_last_command_and_its_corner_is_rounded_without_a_stop():
    bench = Bench()
    start = bench.pose
    bench.ask("movel", pose=moved(start, y=50000), v=50, r=50, trajectory_connect=1)
    bench.run(200)
    assert bench.pose == start
    bench.ask("movel", pose=moved(start, y=50000, z=50000), v=50, trajectory_connect=0)
    speeds = []
    while len(bench.events) < 2:
        bench.run(1)
        speeds.append(np.linalg.norm(bench.controller.state.tool_velocity_c[:3]))
    assert [event["trajectory_connect"] for event in bench.events] == [1, 0]
    assert min(speeds[150:-150]) > 0.01


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_spline_has_an_event_for_each_pose_and_fewer_than_three_are_reached_on_lines(count):
    bench = Bench()
    start = bench.pose
    poses = [moved(start, y=20000 * (i + 1), z=10000 * (i % 2)) for i in range(count)]
    for i, pose in enumerate(poses):
        answer = bench.ask("moves", pose=pose, v=50, trajectory_connect=int(i < count - 1))
        assert answer["receive_state"] is True
    bench.run_until_event()
    bench.run(3000)
    np.testing.assert_allclose(bench.pose[:3], poses[-1][:3], atol=1)
    found = [(event["trajectory_state"], event["trajectory_connect"]) for event in bench.events]
    assert found == [(True, 1)] * (count - 1) + [(True, 0)]


@pytest.mark.parametrize("command", ["movel", "moves"])
def test_an_unfinished_chain_is_its_clients_and_ends_with_it(command):
    bench = Bench()
    start = bench.pose
    other = Peer("127.0.0.2", bench.server.channels[0])
    bench.server.connect(other)
    request = {"command": command, "pose": moved(start, y=50000), "v": 50, "trajectory_connect": 1}
    bench.server.receive(other, json.dumps(request).encode())
    bench.frames.clear()
    bench.ask(command, pose=moved(start, z=20000), v=50, trajectory_connect=0)
    assert bench.run_until_event()["trajectory_state"] is True
    np.testing.assert_allclose(bench.pose[:3], moved(start, z=20000)[:3], atol=1)
    bench.server.disconnect(other)
    bench.server.connect(other)
    request |= {"pose": start, "trajectory_connect": 0}
    bench.server.receive(other, json.dumps(request).encode())
    bench.run(5)
    assert bench.controller.drive.planner.queued == 1


def test_offsets_and_steps_go_along_the_axes_of_work_frame_and_tool():
    bench = Bench()
    start = bench.pose
    bench.ask("movel_offset", offset=[0, 0, -30000, 0, 0, 0], frame_type=1, v=50)
    bench.run_until_event()
    np.testing.assert_allclose(bench.pose[:3], moved(start, z=30000)[:3], atol=1)  # The tool looks down.
    bench.ask("set_pos_step", step_type="z_step", step=-30000, v=50)
    bench.run_until_event()
    np.testing.assert_allclose(bench.pose[:3], start[:3], atol=1)
    bench.ask("set_ort_step", step_type="rz_step", step=100, v=50)
    bench.run_until_event()
    assert abs(abs(bench.pose[5] - start[5]) - 100) <= 1
    q = bench.q
    bench.ask("set_joint_step", joint_step=[1, -10000], v=30)
    bench.run_until_event()
    assert bench.q[0] == pytest.approx(q[0] - 10000, abs=1)


def test_a_pause_keeps_the_path_and_a_deleted_trajectory_does_not_continue():
    bench = Bench()
    start = bench.pose
    bench.ask("movel", pose=moved(start, y=100000), v=50)
    bench.run(400)
    assert bench.ask("set_delete_current_trajectory")["delete_current_trajectory"] is False
    bench.ask("set_arm_pause")
    bench.run(1500)
    assert bench.controller.phase_name == "paused"
    assert 10000 < bench.pose[1] < 90000
    bench.ask("set_arm_continue")
    assert bench.run_until_event()["trajectory_state"] is True
    bench.ask("movel", pose=start, v=50)
    bench.run(400)
    bench.ask("set_arm_pause")
    bench.run(1500)
    assert bench.ask("set_arm_delete_trajectory")["arm_delete_trajectory"] is True
    bench.run(10)
    assert bench.events[-1]["trajectory_state"] is False
    bench.ask("set_arm_continue")
    bench.run(1000)
    assert bench.pose[1] > 10000


@pytest.mark.parametrize("command", ["set_arm_stop", "set_arm_slow_stop"])
def test_a_stop_ends_the_trajectory_and_the_next_one_begins_from_there(command):
    bench = Bench()
    start = bench.pose
    bench.ask("movel", pose=moved(start, y=100000), v=50)
    bench.run(400)
    bench.ask(command)
    assert bench.run_until_event()["trajectory_state"] is False
    bench.run(1000)
    assert not bench.controller.is_moving
    assert start[1] < bench.pose[1] < 90000
    bench.ask("movel", pose=start, v=50)
    assert bench.run_until_event()["trajectory_state"] is True


def test_what_cannot_be_reached_is_refused_with_its_error_until_the_next_command():
    bench = Bench()
    start = bench.pose
    assert bench.ask("movej", joint=[179000, *bench.q[1:]], v=50)["receive_state"] is False
    assert bench.err == [RealManError.TARGET_OVER_LIMIT.code]
    bench.ask("movel", pose=moved(start, x=900000), v=50)
    assert bench.run_until_event()["trajectory_state"] is False
    assert bench.err == [RealManError.UNREACHABLE.code]
    assert bench.controller.faults == ()
    bench.ask("movel", pose=moved(start, z=1000), v=50)
    assert bench.err == [0]
    assert bench.run_until_event()["trajectory_state"] is True


def test_a_goal_out_of_reach_is_named_also_where_a_joint_limit_comes_first():
    bench = Bench("RM75")
    bench.ask("movel", pose=[3000000, 0, 0, *bench.pose[3:]], v=50)
    assert bench.run_until_event()["trajectory_state"] is False
    assert bench.err == [RealManError.UNREACHABLE.code]


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_streamed_angles_are_followed_without_an_answer(mode):
    bench = Bench()
    q = bench.q
    for _ in range(100):
        q[0] += 200
        bench.send("movej_canfd", joint=q, follow=True, expand=0, trajectory_mode=mode, radio=20)
        bench.run(10)
    bench.run(500)
    assert bench.q[0] == pytest.approx(20000, abs=2)
    assert bench.controller.streamed == ""
    assert not bench.controller.faults


def test_a_streamed_step_of_more_than_ten_degrees_is_not_followed_and_sets_the_joints_bit():
    bench = Bench()
    q = bench.q
    bench.send("movej_canfd", joint=[q[0] + 10001, *q[1:]], follow=True)
    bench.run(100)
    assert bench.q == q
    assert bench.ask("get_joint_err_flag")["err_flag"][0] == RealManError.JOINT_POSITION_STEP.code
    bench.send("movej_canfd", joint=[q[0] + 9000, *q[1:]], follow=True)
    bench.run(2000)
    assert bench.q[0] == pytest.approx(q[0] + 9000, abs=2)


def test_streamed_poses_velocities_and_goals_move_the_tool():
    bench = Bench()
    start = bench.pose
    for i in range(50):
        bench.send("movep_canfd", pose=moved(start, y=400 * (i + 1)), follow=True)
        bench.run(10)
    bench.run(500)
    np.testing.assert_allclose(bench.pose[:3], moved(start, y=20000)[:3], atol=3)
    for _ in range(50):
        bench.send("movev_canfd", cartesian_velocity=[0, 0, 50000, 0, 0, 0], follow=True)
        bench.run(10)
    bench.run(1000)
    assert 10000 < bench.pose[2] - start[2] < 40000
    q = bench.q
    bench.send("movej_follow", joint=[q[0] + 30000, *q[1:]])
    bench.run(3000)
    assert bench.q[0] == pytest.approx(q[0] + 30000, abs=2)


def test_teaching_moves_until_it_is_stopped():
    bench = Bench()
    q, start = bench.q, bench.pose
    assert bench.ask("set_joint_teach", teach_joint=1, direction="neg", v=10)["joint_teach"] is True
    bench.run(500)
    assert bench.ask("set_stop_teach")["stop_teach"] is True
    bench.run(1000)
    assert q[0] - 12000 < bench.q[0] < q[0] - 2000
    assert bench.ask("set_pos_teach", teach_type="z", direction="pos", v=10)["pos_teach"] is True
    bench.run(500)
    bench.ask("set_stop_teach")
    bench.run(1000)
    assert 3000 < bench.pose[2] - start[2] < 20000
    assert not bench.controller.is_moving


@ARMS
def test_the_tool_stays_on_its_line_while_teaching_stops(model):
    bench = Bench(model)
    bench.ask("movej", joint=FRONT[model], v=100)
    bench.run_until_event()
    start = bench.pose
    bench.ask("set_pos_teach", teach_type="y", direction="pos", v=100)
    bench.run(700)
    bench.ask("set_stop_teach")
    bench.run(1000)
    assert not bench.controller.is_moving
    end = bench.pose
    assert end[1] > start[1] + 50000
    np.testing.assert_allclose([end[0], end[2]], [start[0], start[2]], atol=500)  # [0.001 mm]
    np.testing.assert_allclose(np.abs(end[3:]), np.abs(start[3:]), atol=3)  # [0.001 rad] Half a turn has two signs.


def test_poses_are_in_the_work_frame_and_of_the_tool():
    bench = Bench()
    start = bench.pose
    assert bench.ask("set_manual_work_frame", frame_name="table", frame_pose=[100000, 0, 0, 0, 0, 0])[
        "manual_work_frame"
    ]
    assert bench.ask("set_change_work_frame", frame_name="table")["change_work_frame"]
    np.testing.assert_allclose(bench.pose, moved(start, x=-100000), atol=1)
    tool = {"tool_name": "pen", "tool_pose": [0, 0, 100000, 0, 0, 0], "payload": 500, "position": [0, 0, 50000]}
    assert bench.ask("set_manual_tool_frame", **tool)["manual_tool_frame"]
    assert bench.ask("set_change_tool_frame", tool_name="pen")["change_tool_frame"]
    bench.run(2)
    np.testing.assert_allclose(bench.pose, moved(start, x=-100000, z=-100000), atol=1)
    assert bench.controller.arm.parameters.load.mass == 0.5
    bench.ask("movel", pose=moved(start, x=-100000, z=-50000), v=50)
    assert bench.run_until_event()["trajectory_state"] is True
    np.testing.assert_allclose(bench.pose[:3], moved(start, x=-100000, z=-50000)[:3], atol=1)
    assert bench.ask("set_change_tool_frame", tool_name="none")["change_tool_frame"] is False
    assert bench.err == [RealManError.NO_TOOL_FRAME.code]
    assert bench.ask("get_tool_frame", tool_name="pen") == {
        "state": "given_tool_frame",
        "tool_name": "pen",
        "pose": tool["tool_pose"],
        "payload": 500,
        "position": [0, 0, 50000],
    }
    assert bench.ask("set_delete_work_frame", frame_name="table")["delete_work_frame"]
    assert bench.ask("get_current_work_frame")["frame_name"] == "World"


def test_in_simulation_the_arm_stands_while_its_states_move():
    bench = Bench()
    standing = bench.controller.arm.signals.measured.q.copy()
    assert bench.ask("set_arm_run_mode", mode=0) == {"command": "set_arm_run_mode", "mode": True}
    q = bench.q
    bench.ask("movej", joint=[q[0] + 20000, *q[1:]], v=50)
    assert bench.run_until_event()["trajectory_state"] is True
    assert bench.q[0] == pytest.approx(q[0] + 20000, abs=1)
    np.testing.assert_array_equal(bench.controller.arm.signals.measured.q, standing)
    bench.ask("set_arm_run_mode", mode=1)
    assert bench.q == q


@ARMS
def test_the_arm_stands_when_its_client_is_informed_of_the_end(model):
    bench = Bench(model)
    q = bench.q
    for offset in (5000, -7000, 1234):
        bench.ask("movej", joint=[q[0] + offset, *q[1:]], v=50)
        assert bench.run_until_event()["trajectory_state"] is True
        assert not bench.controller.is_moving
    assert bench.ask("set_joint_en_state", joint_en_state=[1, 0])["joint_en_state"] is True
    assert bench.err == [0]


def test_simulation_can_begin_right_after_a_motion():
    bench = Bench()
    q = bench.q
    bench.ask("movej", joint=[q[0] + 5000, *q[1:]], v=50)
    bench.run_until_event()
    bench.run(10)
    assert bench.ask("set_arm_run_mode", mode=0)["mode"] is True
    bench.run(600)
    assert bench.err == [0]
    assert not bench.controller.faults


def test_the_emergency_stop_ends_a_motion_and_refuses_the_next():
    bench = Bench()
    q = bench.q
    bench.ask("movej", joint=[q[0] + 40000, *q[1:]], v=50)
    bench.run(300)
    bench.controller.press_button("estop")
    assert bench.run_until_event()["trajectory_state"] is False
    bench.run(1000)
    assert bench.ask("movej", joint=q, v=50)["receive_state"] is False
    bench.controller.press_button("none")
    assert bench.ask("movej", joint=q, v=50)["receive_state"] is True
    assert bench.run_until_event()["trajectory_state"] is True


def test_links_that_would_touch_stop_the_arm_until_the_error_is_cleared():
    bench = Bench()
    assert bench.ask("set_self_collision_enable", set_enable=True)["set_state"] is True
    folded = [0, -130000, 135000, 0, 128000, 0]
    assert bench.ask("movej", joint=folded, v=50)["receive_state"] is True
    assert bench.run_until_event()["trajectory_state"] is False
    assert bench.err == [RealManError.SELF_COLLISION.code]
    bench.run(1000)
    assert bench.ask("movej", joint=FRONT["RM65"], v=50)["receive_state"] is False
    assert bench.ask("clear_system_err")["clear_state"] is True
    assert bench.ask("movej", joint=FRONT["RM65"], v=50)["receive_state"] is True
    assert bench.run_until_event()["trajectory_state"] is True


def test_generations_differ_in_what_they_report_about_themselves():
    third, fourth = (Bench(generation=generation).ask("get_arm_software_info") for generation in (3, 4))
    assert "robot_controller_version" not in third
    assert third["plan_info"]
    assert fourth["robot_controller_version"] == "4.0"
    assert fourth["program_info"]
    assert third["Product_version"] == "RM65-B"


def test_the_table_of_the_geometry_is_the_makers():
    table = Bench("RM75").ask("get_DH_data")
    assert table["joint_1"] == [-90000, 0, 240500, 0]
    assert Bench().ask("get_DH_data")["joint_3"] == [0, 256000, 0, 90000]


def test_outputs_are_wired_to_inputs_on_request():
    bench = Bench()
    assert bench.ask("set_DO_state", IO_Num=2, state=1)["set_state"] is True
    assert bench.ask("get_IO_output")["DO"] == [0, 1, 0, 0]
    assert bench.ask("get_IO_input")["DI"] == [0, 0, 0, 0]
    bench.controller.loop_back = True
    assert bench.ask("get_IO_input")["DI"] == [0, 1, 0, 0]
    assert bench.ask("set_DO_state", IO_Num=5, state=1)["set_state"] is False


def test_states_are_pushed_at_their_period():
    bench = Bench()
    assert bench.ask("set_realtime_push", cycle=2, enable=True, port=8090, ip="127.0.0.1") == {
        "command": "set_realtime_push",
        "state": True,
    }
    bench.ask("movej", joint=[10000, *bench.q[1:]], v=50)
    bench.run(100)
    cycles = [cycle for cycle, _ in bench.pushed]
    assert len(cycles) == 10
    assert set(np.diff(cycles)) == {10}
    state = bench.pushed[-1][1]
    assert state["arm_current_status"] == "move_J"
    np.testing.assert_allclose(state["joint_status"]["joint_position"], bench.q, atol=200)
    np.testing.assert_allclose(state["waypoint"]["position"], bench.pose[:3], atol=2000)
    assert max(map(abs, state["joint_status"]["joint_speed"])) > 0
    assert state["err"] == [0]


def test_the_tool_can_be_changed_right_after_a_motion():
    bench = Bench()
    bench.ask(
        "set_manual_tool_frame", tool_name="long", tool_pose=[0, 0, 100000, 0, 0, 0], payload=500, position=[0] * 3
    )
    bench.ask("movej", joint=[5000, -20000, -70000, 0, -90000, 0], v=50)
    assert bench.run_until_event()["trajectory_state"] is True
    bench.run(2)
    before = bench.pose[2]
    assert bench.ask("set_change_tool_frame", tool_name="long")["change_tool_frame"] is True
    bench.run(10)
    assert bench.pose[2] == pytest.approx(before - 100000, abs=10)
    bench.ask("movej", joint=FRONT["RM65"], v=50)
    assert bench.run_until_event()["trajectory_state"] is True


def test_a_plan_at_full_speed_is_followed_and_a_faster_stream_is_an_error():
    bench = Bench()
    joint = bench.controller.limits.joint
    q = bench.q

    def stream(factor: float) -> None:
        top, since = factor * np.degrees(joint.velocity[0]), 0.8 * np.degrees(joint.acceleration[0])
        for step in range(130):
            t = 0.005 * step
            angle = min(0.5 * since * t * t, top * t - 0.5 * top * top / since if t > top / since else np.inf)
            bench.send("movej_canfd", joint=[q[0] + round(1000 * angle), *q[1:]], follow=True, trajectory_mode=1)
            bench.run(4 if step % 2 else 6)

    stream(1.0)
    assert bench.err == [0]
    bench.run(1000)
    assert bench.ask("movej", joint=q, v=100)["receive_state"] is True
    bench.run_until_event()
    bench.run(1000)
    bench.ask("set_joint_en_state", joint_en_state=[1, 0])
    bench.ask("set_joint_max_speed", joint_max_speed=[1, 10000])
    bench.ask("set_joint_en_state", joint_en_state=[1, 1])
    joint = bench.controller.limits.joint
    stream(1.4)
    assert bench.err == [RealManError.JOINT_OVERSPEED.code]


def test_a_stream_leads_a_joint_back_into_its_range():
    bench = Bench()
    q = bench.q
    bench.ask("set_joint_en_state", joint_en_state=[6, 0])
    bench.ask("set_joint_max_pos", joint_max_pos=[6, -1000])
    bench.ask("set_joint_en_state", joint_en_state=[6, 1])
    bench.send("movej_canfd", joint=[*q[:5], 500], follow=True, trajectory_mode=1)
    assert bench.err == [RealManError.TARGET_OVER_LIMIT.code], "farther out"
    for step in range(60):
        bench.send("movej_canfd", joint=[*q[:5], -50 * step], follow=True, trajectory_mode=1)
        bench.run(5)
    bench.run(500)
    assert bench.q[5] == pytest.approx(-2950, abs=2)
    assert bench.err == [0]


def test_a_step_beyond_a_range_is_refused_with_its_error_and_number():
    bench = Bench()
    assert bench.ask("set_joint_step", joint_step=[1, 400000], v=30)["receive_state"] is False
    assert bench.controller.system_errors == (RealManError.TARGET_OVER_LIMIT,)
    (line,) = [text for _, text in bench.logged if "set_joint_step was refused" in text]
    assert "'" not in line
