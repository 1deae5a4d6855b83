"""Requests on drag teaching and programs: record, store, run."""

from __future__ import annotations

from typing import Any

from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.makers.realman.controller.handler import Getter, Setter, setter
from rcilab.makers.realman.controller.motion_requests import joint_speed, read_angles
from rcilab.makers.realman.controller.programs import (
    MOST_RECORDED,
    POINT_CYCLES,
    Program,
    RunningProgram,
    describe_run,
    read_points,
)
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.stream_requests import STREAMS
from rcilab.makers.realman.controller.trajectories import Trajectory
from rcilab.makers.realman.wire.line import Request
from rcilab.makers.realman.wire.units import millidegrees_from_angles
from rcilab.sim.channels import Peer
from rcilab.sim.planner import JointTarget

LAST_PROGRAM = 100
_ON_CURVE = 1  # Trajectory mode of a stream.


def receive_program(controller: RealManController, request: Request, data: bytes, peer: Peer) -> dict[str, Any]:
    """Stores and runs a program, as its request says; returns the answer.

    Args:
        controller: The controller.
        request: The one that announced the file.
        data: The file.
        peer: The client.
    """
    answer: dict[str, Any] = {"command": "download_project", "project_state": False, "err_line": 0}
    points, answer["err_line"] = read_points(data, controller.model.n)
    if answer["err_line"]:
        return answer
    try:
        speed, number = _percent(request, "plan_speed"), _number(request, "save_id", 0, 0)
        program = Program(name=request.text("project_name"), size=len(data), speed=speed, points=points)
        if number:
            controller.programs[number] = program
        if not request.flag("only_save", False):
            _run(controller, number, program, speed, peer)
    except UsageError as error:
        controller.on_log("refused", f"the program was refused: {error}")
        return answer
    return {"command": "download_project", "project_state": True}


def recorded_lines(controller: RealManController) -> list[dict[str, Any]]:
    """Returns the answer to save_trajectory: a line per point, and the end."""
    points = controller.recorded
    return [*({"point": point} for point in points), {"command": "save_trajectory", "save_state": bool(points)}]


def advance_program(controller: RealManController) -> dict[str, Any] | None:
    """Advances recording and program by one cycle; returns the event of a program that has reached its end."""
    if controller.is_dragging:
        _record(controller)
    running = controller.program
    if running is None or running.is_paused:
        return None
    if not running.follows:
        if controller.trajectories.find(running.approach) is not None:
            return None
        running.follows = True
    if running.count < len(running.program.points):
        _stream(controller, running)
        return None
    if not controller.drive.is_still:
        return None
    controller.program = None
    return {"state": "program_run_finish", "finish_id": running.number}


def _stream(controller: RealManController, running: RunningProgram) -> None:
    running.wait -= 1.0
    if running.wait > 0.0:
        return
    running.wait += running.period
    point = running.program.points[running.count]
    running.count += 1
    try:
        STREAMS["movej_canfd"](controller, Request("movej_canfd", {"joint": list(point), "trajectory_mode": _ON_CURVE}))
    except UsageError as error:
        controller.on_log("refused", f"the program ended at point {running.count}: {error}")
        controller.stop_at_once()


def _run(controller: RealManController, number: int, program: Program, speed: int, peer: Peer) -> None:
    q = read_angles(controller, Request("movej", {"joint": list(program.points[0])}))
    controller.begin_command()
    approach = controller.trajectories.next_id()
    target = JointTarget(id=approach, q=q, speed=joint_speed(controller, speed / 100.0))
    controller.add(target, Trajectory(kind="movej", peer=None))
    controller.program = RunningProgram(number=number, program=program, speed=speed, peer=peer, approach=approach)


def _start(controller: RealManController, request: Request, peer: Peer) -> None:
    number = _stored(controller, request)
    program = controller.programs[number]
    speed = _percent(request, "speed") if request.fields.get("speed") else program.speed
    _run(controller, number, program, speed, peer)


def _delete(controller: RealManController, request: Request) -> None:
    del controller.programs[_stored(controller, request)]


def _set_default(controller: RealManController, request: Request) -> None:
    controller.default_program = _number(request, "id", 0)


def _start_drag(controller: RealManController, request: Request) -> None:
    controller.begin_command()
    if controller.is_moving:
        raise UsageError("the drag teaching cannot begin while the arm moves")
    controller.is_dragging, controller.records = True, request.flag("trajectory_record", False)
    controller.recorded = [millidegrees_from_angles(controller.q)] if controller.records else []


def _stop_drag(controller: RealManController, request: Request) -> None:
    controller.is_dragging = False


def _record(controller: RealManController) -> None:
    if controller.records and not controller.cycle_number % POINT_CYCLES and len(controller.recorded) < MOST_RECORDED:
        controller.recorded.append(millidegrees_from_angles(controller.q))


def _list(controller: RealManController, request: Request) -> dict[str, Any]:
    search = request.text("vague_search") if "vague_search" in request.fields else ""
    found = [
        {"id": number, "size": program.size, "speed": program.speed, "trajectory_name": program.name}
        for number, program in sorted(controller.programs.items())
        if search in program.name
    ]
    page, size = (request.integer(name, default) for name, default in (("page_num", 1), ("page_size", LAST_PROGRAM)))
    if page < 1 or size < 1:
        raise InvalidValueError("page_num", page, "and page_size must be 1 or more")
    shown = found[(page - 1) * size : page * size]
    answer = {"command": request.command, "page_num": page, "page_size": size, "total_size": len(found)}
    return {**answer, "vague_search": search, "list": shown}


def _percent(request: Request, name: str) -> int:
    percent = request.integer(name)
    if not 1 <= percent <= 100:
        raise InvalidValueError(name, percent, "must be 1 to 100")
    return percent


def _number(request: Request, name: str, first: int, default: int | None = None) -> int:
    number = request.integer(name, default)
    if not first <= number <= LAST_PROGRAM:
        raise InvalidValueError(name, number, f"must be {first} to {LAST_PROGRAM}")
    return number


def _stored(controller: RealManController, request: Request) -> int:
    number = _number(request, "id", 1)
    if number not in controller.programs:
        stored = ", ".join(map(str, sorted(controller.programs))) or "none"
        raise InvalidValueError("id", number, f"is not stored; stored: {stored}")
    return number


SETTERS: dict[str, Setter] = {
    "start_drag_teach": setter("drag_teach", _start_drag),
    "stop_drag_teach": setter("drag_teach", _stop_drag),
    "set_program_id_start": Setter("start_state", _start),
    "delete_program_trajectory": setter("delete_state", _delete),
    "set_default_run_program": setter("set_state", _set_default),
}
GETTERS: dict[str, Getter] = {
    "get_program_run_state": lambda controller, request: describe_run(controller.program),
    "get_program_trajectory_list": _list,
    "get_default_run_program": lambda controller, request: {
        "command": "get_default_run_program",
        "id": controller.default_program,
    },
}
