"""Drag teaching and programs: what is sent runs, pauses, ends with an event, and is refused with the line."""

from __future__ import annotations

import json

from tests.makers.realman.controller.bench import Bench


def file_of(points: list[list[int]], n: int = 6) -> bytes:
    lines = [{"file": n}, {"name": "Folder", "num": 1, "type": len(points), "enabled": True, "parent_number": 0}]
    return "".join(json.dumps(line) + "\n" for line in [*lines, *({"point": point} for point in points)]).encode()


def swing(bench: Bench, count: int = 100) -> list[list[int]]:
    first, *rest = bench.q
    return [[first + 100 * k, *rest] for k in range(count)]


def send(bench: Bench, data: bytes, **fields: object) -> dict[str, object]:
    """Returns the answer after the file."""
    announced = {"project_name": "p", "file_size": len(data), "plan_speed": 100, **fields}
    assert bench.ask("run_project", **announced) == {"command": "run_project", "project_state": True}
    bench.server.receive(bench.peer, data)
    (answer,) = [json.loads(frame) for frame in bench.frames]
    bench.frames.clear()
    return answer


def finished(bench: Bench, most: int = 10000) -> int:
    """Advances to the end of the program; returns its number."""
    for _ in range(most):
        bench.server.step()
        for frame in bench.frames:
            message = json.loads(frame)
            if message.get("state") == "program_run_finish":
                bench.frames.clear()
                return message["finish_id"]
        bench.frames.clear()
    raise AssertionError(f"the program did not end within {most} cycles")


def test_a_program_runs_to_its_last_point_and_its_end_is_reported():
    bench = Bench()
    points = swing(bench)
    assert send(bench, file_of(points), save_id=7) == {"command": "download_project", "project_state": True}
    bench.run(500)
    state = bench.ask("get_program_run_state")
    assert (state["run_state"], state["id"], state["plan_speed"]) == (1, 7, 100)
    assert 0 < state["plan_num"] < 100
    assert finished(bench) == 7
    assert abs(bench.q[0] - points[-1][0]) < 20
    assert bench.ask("get_program_run_state")["run_state"] == 0


def test_a_program_pauses_continues_and_is_stopped():
    bench = Bench()
    send(bench, file_of(swing(bench)))
    bench.run(500)
    assert bench.ask("set_arm_pause")["arm_pause"] is True
    bench.run(300)
    before, state = bench.q, bench.ask("get_program_run_state")
    bench.run(300)
    assert bench.q == before
    assert state["run_state"] == 2
    assert bench.ask("set_arm_continue")["arm_continue"] is True
    bench.run(100)
    assert bench.q[0] > before[0]
    bench.ask("set_arm_stop")
    bench.run(300)
    assert bench.ask("get_program_run_state")["run_state"] == 0
    assert bench.q[0] < 9000


def test_a_stored_program_is_listed_started_and_deleted():
    bench = Bench()
    send(bench, data := file_of(swing(bench)), save_id=3, only_save=1)
    assert bench.ask("get_program_run_state")["run_state"] == 0
    assert bench.ask("get_program_trajectory_list")["list"] == [
        {"id": 3, "size": len(data), "speed": 100, "trajectory_name": "p"}
    ]
    assert bench.ask("set_default_run_program", id=3)["set_state"] is True
    assert bench.ask("get_default_run_program")["id"] == 3
    assert bench.ask("set_program_id_start", id=4)["start_state"] is False
    assert bench.ask("set_program_id_start", id=3, speed=0)["start_state"] is True
    assert finished(bench) == 3
    assert bench.ask("delete_program_trajectory", id=3)["delete_state"] is True
    assert bench.ask("get_program_trajectory_list")["total_size"] == 0


def test_a_file_is_refused_with_its_line():
    bench = Bench()
    refused = {"command": "download_project", "project_state": False}
    assert send(bench, file_of(swing(bench), n=7)) == {**refused, "err_line": 1}
    assert send(bench, file_of([[0] * 7])) == {**refused, "err_line": 3}
    assert send(bench, file_of([])) == {**refused, "err_line": 1}
    assert send(bench, file_of([[0] * 6]) + b'{"name":"MoveJ"}', only_save=1)["project_state"] is True
    two = file_of([[0] * 6]).replace(b'"type": 1', b'"type": 2')
    assert send(bench, two + b'{"name":"MoveJ"}') == {**refused, "err_line": 4}
    assert send(bench, file_of([[10**6] * 6]))["project_state"] is False
    assert bench.ask("run_project", project_name="p", file_size=0, plan_speed=1)["project_state"] is False
    bench.ask("get_joint_degree")


def test_a_recording_is_sent_as_lines_of_points_and_takes_no_motion_meanwhile():
    bench = Bench()
    assert bench.ask("start_drag_teach", trajectory_record=1)["drag_teach"] is True
    assert bench.ask("movej", joint=bench.q, v=50)["receive_state"] is False
    bench.run(100)
    assert bench.ask("stop_drag_teach")["drag_teach"] is True
    bench.run(100)
    bench.server.receive(bench.peer, b'{"command":"save_trajectory"}')
    *points, end = [json.loads(frame) for frame in bench.frames]
    assert end == {"command": "save_trajectory", "save_state": True}
    assert [point["point"] for point in points] == [bench.controller.recorded[0]] * 11
    bench.frames.clear()
    assert bench.ask("movej", joint=bench.q, v=50)["receive_state"] is True
