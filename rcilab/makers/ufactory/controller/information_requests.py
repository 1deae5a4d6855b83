"""Requests for what the controller knows about itself: its geometry, its force sensor, and its last errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import Remark
from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.wire.functions import Function, encode_values
from rcilab.makers.ufactory.wire.poses import MILLIMETRE

_DH_NUMBERS = 28  # Of seven joints.
_JOINTS = 7
_FORCE_CONFIGURATION = 280  # [bytes]


def _geometry(controller: XArmController) -> bytes:
    """Returns angle offset, d, alpha and a of each joint, [mm, rad], by the standard convention."""
    rows = controller.model.description.dh
    numbers = [x for row in rows for x in (row.theta_offset, row.d / MILLIMETRE, row.alpha, row.a / MILLIMETRE)]
    return encode_values("f", *numbers, *(0.0,) * (_DH_NUMBERS - len(numbers)))


def _information(controller: XArmController, number: int) -> bytes:
    handler = _INFORMATION.get(number)
    if handler is None:
        known = ", ".join(map(str, _INFORMATION))
        raise InvalidValueError("information", number, f"is not known; known: {known}")
    return handler(controller)


def _reasons(controller: XArmController, error: UfactoryError) -> tuple[Remark, ...]:
    """Returns the reasons for an error when it last came; () before it."""
    reason = controller.reasons.get(error)
    return () if reason is None else reason.parts


def _joint(controller: XArmController, error: UfactoryError) -> int:
    """Returns the joint of an error; 0 without one."""
    return next((joint for remark in _reasons(controller, error) if (joint := round(_number(remark, "joint")))), 0)


def _collision(controller: XArmController) -> bytes:
    """Returns the joint of the last collision, the torque of its drive without it and the measured one, [N m]."""
    error = UfactoryError.COLLISION
    joint = _joint(controller, error)
    if not joint:
        return bytes(9)
    external = next(_number(remark, "value") for remark in _reasons(controller, error) if "joint" in remark.facts)
    actual = float(controller.measurements[error].tau[joint - 1])
    return bytes([joint]) + encode_values("f", actual + external, actual)


def _guided(controller: XArmController) -> bytes:
    """Returns the joint that moved by itself in mode 2 and its angle, [rad]."""
    error = UfactoryError.MANUAL_MODE
    joint = _joint(controller, error)
    return bytes([joint]) + encode_values("f", controller.measurements[error].q[joint - 1] if joint else 0.0)


def _joint_speed(controller: XArmController) -> bytes:
    """Returns the joint that was too fast and its speed, [rad/s]; zeros where the tool was."""
    for remark in _reasons(controller, UfactoryError.SPEED):
        if remark.facts.get("unit") == "rad/s":
            return bytes([round(_number(remark, "joint"))]) + encode_values("f", _number(remark, "value"))
    return bytes(5)


def _joint_range(controller: XArmController) -> bytes:
    """Returns the joints outside their ranges, a bit each, and their angles, [rad]; others are zero."""
    bits, angles = 0, [0.0] * _JOINTS
    for remark in _reasons(controller, UfactoryError.JOINT_RANGE):
        joint = round(_number(remark, "joint"))
        if joint:
            bits |= 1 << joint - 1
            angles[joint - 1] = _number(remark, "value")
    return bytes([bits]) + encode_values("f", *angles)


def _servo_speed(controller: XArmController) -> bytes:
    """Returns the bound of the tool's speed and the speed that passed it, [mm/s]."""
    for remark in _reasons(controller, UfactoryError.SERVO_LINEAR_SPEED):
        return encode_values("f", *(_number(remark, name) / MILLIMETRE for name in ("bound", "value")))
    return bytes(8)


def _number(remark: Remark, name: str) -> float:
    fact = remark.facts.get(name)
    return float(fact) if isinstance(fact, (int, float)) else 0.0


_INFORMATION: dict[int, Callable[[XArmController], bytes]] = {
    1: lambda c: bytes(1),  # Whether another geometry is used.
    2: lambda c: bytes(1),  # Whether an identification is in progress.
    101: _collision,
    102: _guided,
    103: _joint_range,
    104: _joint_speed,
    105: _servo_speed,
    106: lambda c: bytes(1 + 4 * _JOINTS),  # Joints beyond their mechanical ranges.
    107: lambda c: bytes(9),  # A collision that the force sensor has detected.
}
"""By number of the information; those from 101 on are about an error each."""

InformationHandler: TypeAlias = Callable[[XArmController, tuple[Any, ...]], bytes]
INFORMATION_HANDLERS: dict[Function, InformationHandler] = {
    Function.GET_DH: lambda c, v: _geometry(c),
    Function.GET_FORCE_OF_OLD_FIRMWARE: lambda c, v: bytes(24),
    Function.GET_FORCE: lambda c, v: bytes(24),
    Function.GET_FORCE_MODE: lambda c, v: bytes(1),
    Function.GET_FORCE_CONFIGURATION: lambda c, v: bytes(_FORCE_CONFIGURATION),
    Function.GET_COMMON_INFORMATION: lambda c, v: _information(c, v[0]),
}
"""What each function answers; the force sensor, which is not simulated, has zeros."""
