"""Requests on everything else: speeds of the tool, collision stage, power, run mode, signals, push of states."""

from __future__ import annotations

import ipaddress
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeVar

from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.makers.realman.bounds import FASTEST_TOOL, MOST_SENSITIVE, STRONGEST_TOOL
from rcilab.makers.realman.controller.handler import Getter, Setter, setter
from rcilab.makers.realman.controller.identity import dh_data
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.settings import (
    OUTPUT_MODE,
    SIGNALS,
    TOOL_SIGNALS,
    PushSettings,
    TipSpeeds,
)
from rcilab.makers.realman.wire.line import Request

T = TypeVar("T")

_MILLI = 1e-3
_LONGEST_CYCLE = 1000  # [5 ms]
_LONGEST_PERIOD = 1000  # [ms]
_LAST_MODE = 14
_SPEED_MODE = 14
_VOLTAGES = (0, 2, 3)  # 0 V, 12 V, 24 V.
_TOOL_VOLTAGES = (0, 1, 2, 3)  # And 5 V.


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
        raise UsageError("the mode cannot be changed while the arm moves")
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


def _within(request: Request, name: str, first: int, last: int) -> int:
    value = request.integer(name)
    if not first <= value <= last:
        raise InvalidValueError(name, value, f"must be {first} to {last}")
    return value


def _signal(request: Request, count: int = SIGNALS) -> int:
    return _within(request, "IO_Num", 1, count) - 1


def _with(values: tuple[T, ...], index: int, value: T) -> tuple[T, ...]:
    return (*values[:index], value, *values[index + 1 :])


def _set_signal_mode(controller: RealManController, request: Request) -> None:
    index, mode = _signal(request), _within(request, "IO_mode", 0, _LAST_MODE)
    speed = (-1, -1)
    if mode == _SPEED_MODE:
        inner = request.inner("realtime_speed")
        speed = _within(inner, "speed", 0, 100), _within(inner, "mode", 1, 2)
    settings = controller.settings
    modes, speeds = _with(settings.signal_modes, index, mode), _with(settings.signal_speeds, index, speed)
    controller.change(replace(settings, signal_modes=modes, signal_speeds=speeds))


def _set_output(controller: RealManController, request: Request) -> None:
    index, state, settings = _signal(request), int(request.flag("state")), controller.settings
    if settings.signal_modes[index] != OUTPUT_MODE:
        raise InvalidValueError("IO_Num", index + 1, f"is an input; set_IO_mode {OUTPUT_MODE} makes it an output")
    controller.change(replace(settings, outputs=_with(settings.outputs, index, state)))


def _set_tool_signal_mode(controller: RealManController, request: Request) -> None:
    index, mode, settings = _signal(request, TOOL_SIGNALS), _within(request, "state", 0, 1), controller.settings
    controller.change(replace(settings, tool_signal_modes=_with(settings.tool_signal_modes, index, mode)))


def _set_tool_output(controller: RealManController, request: Request) -> None:
    index, state, settings = _signal(request, TOOL_SIGNALS), int(request.flag("state")), controller.settings
    if settings.tool_signal_modes[index] != OUTPUT_MODE:
        raise InvalidValueError("IO_Num", index + 1, f"is an input; set_tool_IO_mode {OUTPUT_MODE} makes it an output")
    controller.change(replace(settings, tool_outputs=_with(settings.tool_outputs, index, state)))


def _tool_signals(controller: RealManController, request: Request) -> dict[str, Any]:
    modes, outputs = controller.settings.tool_signal_modes, controller.settings.tool_outputs
    levels = [level if mode == OUTPUT_MODE else 0 for mode, level in zip(modes, outputs, strict=True)]
    return {"state": "tool_IO_state", "IO_Mode": modes, "IO_State": levels}


def _voltage_setter(name: str, types: tuple[int, ...]) -> Setter:
    def run(controller: RealManController, request: Request) -> None:
        value = request.integer("voltage_type")
        if value not in types:
            raise InvalidValueError("voltage_type", value, f"must be one of {', '.join(map(str, types))}")
        controller.change(replace(controller.settings, **{name: value}))

    return setter("state", run)


def _input_levels(controller: RealManController) -> list[int]:
    high = controller.inputs
    return [int(number in high) for number in range(SIGNALS)]


def _io_state(controller: RealManController, request: Request) -> dict[str, Any]:
    index, settings = _signal(request), controller.settings
    mode, (speed, trigger) = settings.signal_modes[index], settings.signal_speeds[index]
    level = settings.outputs[index] if mode == OUTPUT_MODE else _input_levels(controller)[index]
    answer = {"state": "IO_state", "IO_Num": index + 1, "IO_Mode": mode, "IO_state": level}
    return answer | ({"realtime_speed": {"speed": speed, "mode": trigger}} if mode == _SPEED_MODE else {})


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


def _set_velocity_stream(controller: RealManController, request: Request) -> None:
    _within(request, "avoid_singularity_flag", 0, 1)  # The arm always slows down near a singularity.
    _within(request, "dt", 1, _LONGEST_PERIOD)  # Velocities may come at any time.
    in_tool = _within(request, "frame_type", 0, 1) == 0
    controller.change(replace(controller.settings, velocity_in_tool=in_tool))


def _set_geometry(controller: RealManController, request: Request) -> None:
    for name, row in dh_data(controller.model.description).items():
        if name != "command" and list(request.integers(name, len(row))) != row:
            raise InvalidValueError(name, request.fields[name], f"must be {row}: the virtual arm keeps its geometry")


def _accept(controller: RealManController, request: Request) -> None:
    del controller, request


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
    "set_IO_mode": setter("set_state", _set_signal_mode),
    "set_DO_state": setter("set_state", _set_output),
    "set_voltage": _voltage_setter("voltage", _VOLTAGES),
    "set_tool_IO_mode": setter("set_state", _set_tool_signal_mode),
    "set_tool_DO_state": setter("set_state", _set_tool_output),
    "set_tool_voltage": _voltage_setter("tool_voltage", _TOOL_VOLTAGES),
    "set_realtime_push": setter("state", _set_push),
    "set_movev_canfd_init": setter("movev_canfd_init_state", _set_velocity_stream),
    "set_DH_data": setter("set_state", _set_geometry),
    "set_DH_data_default": setter("set_state", _accept),
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
    "get_voltage": lambda controller, request: {
        "state": "voltage_state",
        "voltage_type": controller.settings.voltage,
    },
    "get_tool_voltage": lambda controller, request: {
        "state": "tool_voltage_state",
        "voltage_type": controller.settings.tool_voltage,
    },
    "get_tool_IO_state": _tool_signals,
    "get_realtime_push": _push,
}
