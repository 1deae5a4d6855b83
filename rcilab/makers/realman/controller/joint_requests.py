"""The 22 requests on parameters of joints. Plain getters answer with "state", those of drives with "command"."""

from __future__ import annotations

from rcilab.core.errors import InvalidValueError
from rcilab.makers.realman.controller.handler import Getter, Setter, setter
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.wire.line import Request

_FORMAL_MODE = 1

_VALUES = {  # Name of the value on the wire -> field of `JointSet`, and the list in the answer of a getter.
    "max_speed": ("max_speed", "joint_speed"),
    "max_acc": ("max_acc", "joint_acc"),
    "min_pos": ("min_pos", "min_pos"),
    "max_pos": ("max_pos", "max_pos"),
}


def _value_setter(name: str, *, is_drive: bool) -> Setter:
    field = f"joint_{name}"

    def run(controller: RealManController, request: Request) -> None:
        joint, value = request.integers(field, 2)
        controller.set_joint_value(_VALUES[name][0], joint, value, is_drive=is_drive)

    return setter(field, run)


def _value_getter(name: str, *, is_drive: bool) -> Getter:
    field, key = _VALUES[name]

    def run(controller: RealManController, request: Request) -> dict[str, object]:
        if is_drive:
            return {"command": f"get_joint_drive_{name}", key: getattr(controller.parameters.drive, field)}
        return {"state": f"joint_{name}", key: getattr(controller.parameters.controller, field)}

    return run


def _enable(controller: RealManController, request: Request) -> None:
    joint, state = request.integers("joint_en_state", 2)
    if state not in (0, 1):
        raise InvalidValueError("joint_en_state", state, "must be 0 or 1")
    controller.enable_joint(joint, bool(state))


def _auto_limit(controller: RealManController, request: Request) -> None:
    mode = request.integer("limit_mode")
    if mode != _FORMAL_MODE:
        raise InvalidValueError("limit_mode", mode, "must be 1")
    controller.restore_ranges()


def _errors(controller: RealManController, request: Request) -> dict[str, object]:
    is_held = [int(not (on and controller.is_powered)) for on in controller.enabled]
    return {"state": "joint_err_flag", "err_flag": controller.joint_errors, "brake_state": is_held}


SETTERS: dict[str, Setter] = {
    **{f"set_joint_{name}": _value_setter(name, is_drive=False) for name in _VALUES},
    **{f"set_joint_drive_{name}": _value_setter(name, is_drive=True) for name in _VALUES},
    "set_joint_en_state": setter("joint_en_state", _enable),
    "set_joint_zero_pos": setter(
        "joint_zero_pos", lambda controller, request: controller.set_zero(request.integer("joint_zero_pos"))
    ),
    "set_joint_clear_err": setter(
        "joint_clear_err",
        lambda controller, request: controller.clear_joint_error(request.integer("joint_clear_err")),
    ),
    "auto_set_joint_limit": setter("limit_mode", _auto_limit),
}
GETTERS: dict[str, Getter] = {
    **{f"get_joint_{name}": _value_getter(name, is_drive=False) for name in _VALUES},
    **{f"get_joint_drive_{name}": _value_getter(name, is_drive=True) for name in _VALUES},
    "get_joint_en_state": lambda controller, request: {
        "state": "joint_en_state",
        "en_state": [int(on) for on in controller.enabled],
    },
    "get_joint_err_flag": _errors,
}
