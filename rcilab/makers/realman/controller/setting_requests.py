"""Requests on everything else: speeds of the tool, collision stage, power, run mode, signals, push of states."""

from __future__ import annotations

import ipaddress
from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from rcilab.core.errors import InvalidValueError
from rcilab.makers.realman.bounds import FASTEST_TOOL, MOST_SENSITIVE, STRONGEST_TOOL
from rcilab.makers.realman.controller.handler import Getter, Setter, setter
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.settings import SIGNALS, PushSettings, TipSpeeds
from rcilab.makers.realman.wire.line import Request

_MILLI = 1e-3
_LONGEST_CYCLE = 1000  # [5 ms]
_OUTPUT_MODE = 1


def _tip_setter(name: str) -> Setter:
    field = f"arm_{name}"

    def run(controller: RealManController, request: Request) -> None:
        value = _MILLI * request.integer(field)
        bound = STRONGEST_TOOL if name.endswith("acc") else FASTEST_TOOL
        if not 0.0 < value <= bound:
            raise InvalidValueError(field, value, f"must be above 0, up to {bound:g}")
        tip = replace(controller.settings.tip, **{name: value})
        controller.change(replace(controller.settings, tip=tip))

    return setter(field, run)


def _tip_getter(name: str) -> Getter:
    def run(controller: RealManController, request: Request) -> dict[str, Any]:
        return {"state": f"arm_max_{name}", f"arm_{name}": round(getattr(controller.settings.tip, name) / _MILLI)}

    return run


def _restore_tip(controller: RealManController, request: Request) -> None:
    controller.change(replace(controller.settings, tip=TipSpeeds()))


def _set_collision_stage(controller: RealManController, request: Request) -> None:
    stage = request.integer("collision_stage")
    if not 0 <= stage <= MOST_SENSITIVE:
        raise InvalidValueError("collision_stage", stage, f"must be 0 to {MOST_SENSITIVE}")
    controller.change(replace(controller.settings, collision_stage=stage))


def _set_run_mode(controller: RealManController, request: Request) -> None:
    if controller.is_moving:
        raise InvalidValueError("mode", "", "cannot be changed while the arm moves")
    controller.drive.simulate(not request.flag("mode"))


def _set_self_collision(controller: RealManController, request: Request) -> None:
    controller.change(replace(controller.settings, avoids_self_collision=request.flag("set_enable")))


def _set_init_pose(controller: RealManController, request: Request) -> None:
    pose = request.integers("init_pose", controller.model.n)
    controller.change(replace(controller.settings, init_pose=pose))


def _set_install_pose(controller: RealManController, request: Request) -> None:
    controller.change(replace(controller.settings, install_pose=request.integers("pose", 3)))


def _emergency_stop(controller: RealManController, request: Request) -> None:
    controller.press_button("estop" if request.flag("state") else "none")


def _signal(request: Request) -> int:
    number = request.integer("IO_Num")
    if not 1 <= number <= SIGNALS:
        raise InvalidValueError("IO_Num", number, f"must be 1 to {SIGNALS}")
    return number - 1


def _set_output(controller: RealManController, request: Request) -> None:
    index, state = _signal(request), int(request.flag("state"))
    outputs = controller.settings.outputs
    controller.change(replace(controller.settings, outputs=(*outputs[:index], state, *outputs[index + 1 :])))


def _input_levels(controller: RealManController) -> list[int]:
    high = controller.inputs
    return [int(number in high) for number in range(SIGNALS)]


def _io_state(controller: RealManController, request: Request) -> dict[str, Any]:
    index = _signal(request)
    state = controller.settings.outputs[index]
    return {"state": "IO_state", "IO_Num": index + 1, "IO_Mode": _OUTPUT_MODE, "IO_state": state}


def _set_push(controller: RealManController, request: Request) -> None:
    old = controller.settings.push
    cycle, port = request.integer("cycle", old.cycle), request.integer("port", old.port)
    if not 1 <= cycle <= _LONGEST_CYCLE:
        raise InvalidValueError("cycle", cycle, f"must be 1 to {_LONGEST_CYCLE}")
    if not 1024 <= port <= 65535:
        raise InvalidValueError("port", port, "must be 1024 to 65535")
    ip = request.text("ip") if "ip" in request.fields else old.ip
    try:
        ipaddress.IPv4Address(ip)
    except ValueError as error:
        raise InvalidValueError("ip", ip, "must be an IPv4 address") from error
    custom = dict(old.custom)
    if "custom" in request.fields:
        inner = request.inner("custom")
        custom |= {name: inner.flag(name) for name in inner.fields}
    push = PushSettings(
        enable=request.flag("enable", old.enable),
        cycle=cycle,
        port=port,
        ip=ip,
        force_coordinate=request.integer("force_coordinate", old.force_coordinate),
        custom=MappingProxyType(custom),
    )
    controller.change(replace(controller.settings, push=push))


def _push(controller: RealManController, request: Request) -> dict[str, Any]:
    push = controller.settings.push
    return {
        "command": "get_realtime_push",
        "cycle": push.cycle,
        "port": push.port,
        "enable": push.enable,
        "force_coordinate": push.force_coordinate,
        "ip": push.ip,
        "custom": dict(push.custom),
    }


def _accept(controller: RealManController, request: Request) -> None:
    del controller, request


def _constant(**answer: object) -> Callable[[RealManController, Request], dict[str, Any]]:
    return lambda controller, request: dict(answer)


_TIPS = ("line_speed", "line_acc", "angular_speed", "angular_acc")

SETTERS: dict[str, Setter] = {
    **{f"set_arm_max_{name}": _tip_setter(name) for name in _TIPS},
    "set_arm_init": setter("arm_init", _restore_tip),
    "set_collision_stage": setter("collision_state", _set_collision_stage),
    "set_self_collision_enable": setter("set_state", _set_self_collision),
    "set_arm_power": setter(
        "arm_power", lambda controller, request: controller.switch_power(request.flag("arm_power"))
    ),
    "set_arm_run_mode": setter("mode", _set_run_mode),
    "set_arm_emergency_stop": setter("state", _emergency_stop),
    "clear_system_err": setter("clear_state", lambda controller, request: controller.clear_system_errors()),
    "clear_system_runtime": setter("clear_state", _accept),
    "clear_joint_odom": setter("clear_state", _accept),
    "set_init_pose": setter("init_pose", _set_init_pose),
    "set_install_pose": setter("set_state", _set_install_pose),
    "set_IO_mode": setter("set_state", lambda controller, request: _signal(request)),
    "set_DO_state": setter("set_state", _set_output),
    "set_voltage": setter("state", _accept),
    "set_tool_voltage": setter("state", _accept),
    "set_realtime_push": setter("state", _set_push),
}
GETTERS: dict[str, Getter] = {
    **{f"get_arm_max_{name}": _tip_getter(name) for name in _TIPS},
    "get_collision_stage": lambda controller, request: {
        "command": "get_collision_stage",
        "collision_stage": controller.settings.collision_stage,
    },
    "get_self_collision_enable": lambda controller, request: {
        "command": "get_self_collision_enable",
        "enable_state": controller.settings.avoids_self_collision,
    },
    "get_init_pose": lambda controller, request: {
        "state": "arm_init_pose",
        "init_pose": controller.settings.init_pose,
    },
    "get_install_pose": lambda controller, request: {
        "state": "install_pose",
        "pose": controller.settings.install_pose,
    },
    "get_IO_state": _io_state,
    "get_IO_input": lambda controller, request: {
        "state": "IO_input_state",
        "DI": _input_levels(controller),
        "AI": [0] * SIGNALS,
    },
    "get_IO_output": lambda controller, request: {
        "state": "IO_output_state",
        "DO": controller.settings.outputs,
        "AO": [0] * SIGNALS,
    },
    "get_voltage": _constant(state="voltage_state", voltage_type=0),
    "get_tool_voltage": _constant(state="tool_voltage_state", voltage_type=0),
    "get_tool_IO_state": _constant(state="tool_IO_state", IO_Mode=[0, 0], IO_State=[0, 0]),
    "get_realtime_push": _push,
}
