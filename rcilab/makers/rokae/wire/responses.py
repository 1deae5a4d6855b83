"""The answers of the controller, each a frozen value with its layout table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from rcilab.core.message_layout import Field, Layout
from rcilab.makers.rokae.wire.statuses import (
    CommandCode,
    GuideStatus,
    RecoveryStatus,
    SafetyStop,
    SettingStatus,
    StartStatus,
    Status,
    StopStatus,
)

STATUS_TYPES: dict[CommandCode, type[Status]] = dict.fromkeys(CommandCode, SettingStatus) | {
    CommandCode.START_MOVE: StartStatus,
    CommandCode.STOP_MOVE: StopStatus,
    CommandCode.AUTOMATIC_ERROR_RECOVERY: RecoveryStatus,
    CommandCode.LOAD_ROBOT_MODEL: GuideStatus,
    CommandCode.ENABLE_VIRTUAL_GUIDE: GuideStatus,
}
"""The enumeration of each command's status byte."""

STATUS = Layout("status response", (Field("status", "u8"),))
MOTOR_STATE = Layout("motor state response", (Field("power", "u8"),))
DIGITAL_INPUT = Layout("digital input response", (Field("status", "u8"), Field("level", "flag")))
SAFETY_STOP = Layout("safety stop response", (Field("state", "u8"),))
MODEL = Layout(
    "robot model response",
    (
        Field("status", "u8"),
        Field("dh", "f64", 28, "rows of a mm, alpha rad, d mm, theta rad"),
        Field("dimensions", "f64", 21, "unused"),
        Field("dynamics_with_friction", "f64", 66, "base parameters, kg m^2, kg m, N m"),
        Field("dynamics", "f64", 45, "base parameters, kg m^2, kg m"),
    ),
)


@dataclass(frozen=True, slots=True)
class StatusResponse:
    """The answer to most commands: one status."""

    status: Status


@dataclass(frozen=True, slots=True)
class MotorStateResponse:
    """The answer to GetMotorState: 1 when the motors are on, 0 when they are off."""

    power: int


@dataclass(frozen=True, slots=True)
class DigitalInputResponse:
    """The answer to GetDIState."""

    status: SettingStatus
    level: bool


@dataclass(frozen=True, slots=True)
class SafetyStopResponse:
    """The answer to GetSafetyStopState."""

    state: SafetyStop


@dataclass(frozen=True, slots=True)
class ModelResponse:
    """The answer to LoadRobotModel: the figures for the vendor's model library."""

    dh: tuple[float, ...]
    """28 numbers: 7 rows of a [mm], alpha [rad], d [mm], theta [rad]."""
    dynamics_with_friction: tuple[float, ...]
    """66 base dynamic parameters, with friction."""
    dynamics: tuple[float, ...]
    """45 base dynamic parameters, without friction."""
    dimensions: tuple[float, ...] = (0.0,) * 21
    """Ignored by the vendor's library."""
    status: GuideStatus = GuideStatus.SUCCESS


Response: TypeAlias = StatusResponse | MotorStateResponse | DigitalInputResponse | SafetyStopResponse | ModelResponse
