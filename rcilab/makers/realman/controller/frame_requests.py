"""Requests on work and tool frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import Remark
from rcilab.makers.realman.bounds import FIRST_TOOL_FRAME, FIRST_WORK_FRAME
from rcilab.makers.realman.controller.handler import Getter, Setter, setter
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.settings import ToolFrame
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.wire.line import Request
from rcilab.makers.realman.wire.units import microns_from_lengths, pose_from_wire, wire_from_pose

_LONGEST_NAME = 10
"""Characters of a name; the client's limit."""
_GRAMS, _MICRO = 1e-3, 1e-6  # [kg], [m]


def _name(request: Request, field: str) -> str:
    name = request.text(field)
    if not 0 < len(name) <= _LONGEST_NAME:
        raise InvalidValueError(field, name, f"must have 1 to {_LONGEST_NAME} characters")
    return name


def _require_new(name: str, frames: Mapping[str, object]) -> None:
    if name in frames:
        raise InvalidValueError("frame", name, "exists; update it")


def _missing(controller: RealManController, error: RealManError, name: str) -> InvalidValueError:
    problem = InvalidValueError("frame", name, "does not exist")
    controller.set_error(error, Remark(str(problem), "no_frame", name=name))
    return problem


def _require_known(controller: RealManController, request: Request, field: str) -> str:
    name = request.text(field)
    is_work = field == "frame_name"
    frames = controller.settings.work_frames if is_work else controller.settings.tool_frames
    if name not in frames:
        raise _missing(controller, RealManError.NO_WORK_FRAME if is_work else RealManError.NO_TOOL_FRAME, name)
    return name


def _add_work_frame(controller: RealManController, request: Request) -> None:
    name = _name(request, "frame_name")
    _require_new(name, controller.settings.work_frames)
    pose = pose_from_wire(request.integers("frame_pose", 6))
    controller.change(controller.settings.with_work_frame(name, pose))


def _update_work_frame(controller: RealManController, request: Request) -> None:
    name = _require_known(controller, request, "frame_name")
    _require_changeable(name, FIRST_WORK_FRAME)
    pose = pose_from_wire(request.integers("frame_pose", 6))
    controller.change(controller.settings.with_work_frame(name, pose))


def _change_work_frame(controller: RealManController, request: Request) -> None:
    name = _require_known(controller, request, "frame_name")
    controller.change(replace(controller.settings, work_frame=name))


def _delete_work_frame(controller: RealManController, request: Request) -> None:
    name = _require_known(controller, request, "frame_name")
    _require_changeable(name, FIRST_WORK_FRAME)
    settings = controller.settings
    frames = {key: pose for key, pose in settings.work_frames.items() if key != name}
    current = FIRST_WORK_FRAME if settings.work_frame == name else settings.work_frame
    controller.change(replace(settings, work_frames=MappingProxyType(frames), work_frame=current))


def _read_tool(controller: RealManController, request: Request) -> ToolFrame:
    x, y, z = (_MICRO * value for value in request.integers("position", 3))
    return ToolFrame(
        T_flange_tool=pose_from_wire(request.integers("tool_pose", 6)),
        mass=_GRAMS * request.integer("payload", 0),
        center=(x, y, z),
    ).require(controller.model.description.rated_payload)


def _add_tool(controller: RealManController, request: Request) -> None:
    name = _name(request, "tool_name")
    _require_new(name, controller.settings.tool_frames)
    controller.change(controller.settings.with_tool(name, _read_tool(controller, request)))


def _update_tool(controller: RealManController, request: Request) -> None:
    name = _require_known(controller, request, "tool_name")
    _require_changeable(name, FIRST_TOOL_FRAME)
    controller.change(controller.settings.with_tool(name, _read_tool(controller, request)))


def _change_tool(controller: RealManController, request: Request) -> None:
    name = _require_known(controller, request, "tool_name")
    if controller.is_moving:
        raise InvalidValueError("tool_name", name, "cannot be changed to while the arm moves")
    controller.change(replace(controller.settings, tool_frame=name))


def _delete_tool(controller: RealManController, request: Request) -> None:
    name = _require_known(controller, request, "tool_name")
    _require_changeable(name, FIRST_TOOL_FRAME)
    settings = controller.settings
    frames = {key: tool for key, tool in settings.tool_frames.items() if key != name}
    current = FIRST_TOOL_FRAME if settings.tool_frame == name else settings.tool_frame
    controller.change(replace(settings, tool_frames=MappingProxyType(frames), tool_frame=current))


def _require_changeable(name: str, own: str) -> None:
    if name == own:
        raise InvalidValueError("frame", name, "is the controller's own")


def _work_frame(controller: RealManController, name: str, state: str) -> dict[str, Any]:
    return {"state": state, "frame_name": name, "pose": wire_from_pose(controller.settings.work_frames[name])}


def _tool_frame(controller: RealManController, name: str, state: str) -> dict[str, Any]:
    tool = controller.settings.tool_frames[name]
    return {
        "state": state,
        "tool_name": name,
        "pose": wire_from_pose(tool.T_flange_tool),
        "payload": round(tool.mass / _GRAMS),
        "position": microns_from_lengths(tool.center),
    }


def _given_work_frame(controller: RealManController, request: Request) -> dict[str, Any]:
    name = request.text("frame_name")
    if name not in controller.settings.work_frames:
        return {"command": "get_work_frame", "get_state": False}
    return _work_frame(controller, name, "given_work_frame")


def _given_tool_frame(controller: RealManController, request: Request) -> dict[str, Any]:
    name = request.text("tool_name")
    if name not in controller.settings.tool_frames:
        return {"command": "get_tool_frame", "get_state": False}
    return _tool_frame(controller, name, "given_tool_frame")


SETTERS: dict[str, Setter] = {
    "set_manual_work_frame": setter("manual_work_frame", _add_work_frame),
    "update_work_frame": setter("update_state", _update_work_frame),
    "set_change_work_frame": setter("change_work_frame", _change_work_frame),
    "set_delete_work_frame": setter("delete_work_frame", _delete_work_frame),
    "set_manual_tool_frame": setter("manual_tool_frame", _add_tool),
    "update_tool_frame": setter("update_state", _update_tool),
    "set_change_tool_frame": setter("change_tool_frame", _change_tool),
    "set_delete_tool_frame": setter("delete_tool_frame", _delete_tool),
}
GETTERS: dict[str, Getter] = {
    "get_current_work_frame": lambda controller, request: _work_frame(
        controller, controller.settings.work_frame, "current_work_frame"
    ),
    "get_current_tool_frame": lambda controller, request: _tool_frame(
        controller, controller.settings.tool_frame, "current_tool_frame"
    ),
    "get_total_work_frame": lambda controller, request: {
        "state": "total_work_frame",
        "frame_names": list(controller.settings.work_frames),
    },
    "get_total_tool_frame": lambda controller, request: {
        "state": "total_tool_frame",
        "tool_names": list(controller.settings.tool_frames),
    },
    "get_work_frame": _given_work_frame,
    "get_tool_frame": _given_tool_frame,
}
