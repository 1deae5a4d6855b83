"""What a client sets besides the joints' parameters: frames, speeds of the tool, signals, pushed states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import hypot
from types import MappingProxyType
from typing import Final

import numpy as np

from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.makers.realman.bounds import (
    ANGULAR_ACCELERATION,
    ANGULAR_SPEED,
    FIRST_TOOL_FRAME,
    FIRST_WORK_FRAME,
    INPUTS,
    LINE_ACCELERATION,
    LINE_SPEED,
    LONGEST_TOOL,
    PUSH_PORT,
)
from rcilab.makers.realman.controller.fence import Fence, Side
from rcilab.model.dynamics.payload import NO_LOAD, Payload

MOST_FRAMES: Final = 10
"""Of either kind, as of the real controller."""
SIGNALS: Final = len(INPUTS)
"""Digital inputs and outputs of the controller."""
TOOL_SIGNALS: Final = 2
"""Digital ports of the tool's flange, each input or output."""
OUTPUT_MODE: Final = 1
"""Mode of a port that is an output; the others are inputs, most of them with a function."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ToolFrame:
    """A tool."""

    T_flange_tool: Pose = IDENTITY
    mass: float = 0.0
    """[kg]."""
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of mass in the flange frame, [m]."""

    @property
    def load(self) -> Payload:
        """The tool as a point mass."""
        return NO_LOAD if not self.mass else Payload(mass=self.mass, center_of_mass=np.array(self.center))

    def require(self, rated_payload: float) -> ToolFrame:
        """Returns it.

        Args:
            rated_payload: Of the arm, [kg].

        Raises:
            InvalidValueError: It is too long or too heavy.
        """
        if hypot(*self.T_flange_tool.parts[1]) > LONGEST_TOOL or hypot(*self.center) > LONGEST_TOOL:
            raise InvalidValueError("tool frame", self.T_flange_tool, f"must be within {LONGEST_TOOL:g} m")
        if not 0.0 <= self.mass <= rated_payload:
            raise InvalidValueError("payload", self.mass, f"must be 0 to {rated_payload:g} kg, the rated payload")
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class TipSpeeds:
    """Largest speeds and accelerations of the tool."""

    line_speed: float = LINE_SPEED
    """[m/s]."""
    line_acc: float = LINE_ACCELERATION
    """[m/s^2]."""
    angular_speed: float = ANGULAR_SPEED
    """[rad/s]."""
    angular_acc: float = ANGULAR_ACCELERATION
    """[rad/s^2]."""

    def limits(self, limits: Limits) -> Limits:
        """Returns the limits of an arm with these values; jerks keep their ratio to the accelerations."""
        tool = limits.cartesian
        return replace(
            limits,
            cartesian=replace(
                tool,
                translation_velocity=self.line_speed,
                translation_acceleration=self.line_acc,
                translation_jerk=tool.translation_jerk / tool.translation_acceleration * self.line_acc,
                rotation_velocity=self.angular_speed,
                rotation_acceleration=self.angular_acc,
                rotation_jerk=tool.rotation_jerk / tool.rotation_acceleration * self.angular_acc,
            ),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PushSettings:
    """The push of states over UDP."""

    enable: bool = False
    cycle: int = 1
    """Period, [5 ms]."""
    port: int = PUSH_PORT
    ip: str = "127.0.0.1"
    force_coordinate: int = 0
    custom: Mapping[str, bool] = field(default_factory=lambda: MappingProxyType({}))
    """Which further members are sent."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Settings:
    """All settings of a client that are gone after a restart."""

    work_frames: Mapping[str, Pose] = field(default_factory=lambda: MappingProxyType({FIRST_WORK_FRAME: IDENTITY}))
    work_frame: str = FIRST_WORK_FRAME
    tool_frames: Mapping[str, ToolFrame] = field(
        default_factory=lambda: MappingProxyType({FIRST_TOOL_FRAME: ToolFrame()})
    )
    tool_frame: str = FIRST_TOOL_FRAME
    tip: TipSpeeds = TipSpeeds()
    collision_stage: int = 0
    teach_in_tool: bool = False
    velocity_in_tool: bool = False
    """Axes of streamed velocities."""
    avoids_self_collision: bool = False
    fence: Fence | None = None
    is_fenced: bool = False
    fence_side: Side = "inside"
    """Of the fence, where the arm has to be."""
    signal_modes: tuple[int, ...] = (OUTPUT_MODE,) * SIGNALS
    signal_speeds: tuple[tuple[int, int], ...] = ((-1, -1),) * SIGNALS
    """Speed and trigger of a port that changes the speed; -1 where it does not."""
    outputs: tuple[int, ...] = (0,) * SIGNALS
    tool_signal_modes: tuple[int, ...] = (0,) * TOOL_SIGNALS
    tool_outputs: tuple[int, ...] = (0,) * TOOL_SIGNALS
    voltage: int = 0
    """Type of the power output of the controller, see `set_voltage`."""
    tool_voltage: int = 0
    init_pose: tuple[int, ...] = ()
    """[0.001 deg]."""
    install_pose: tuple[int, ...] = (0, 0, 0)
    push: PushSettings = field(default_factory=PushSettings)

    @property
    def T_base_work(self) -> Pose:
        """The current work frame in base."""
        return self.work_frames[self.work_frame]

    @property
    def tool(self) -> ToolFrame:
        """The current tool."""
        return self.tool_frames[self.tool_frame]

    def with_tool(self, name: str, tool: ToolFrame) -> Settings:
        """Returns the settings with a tool, new or changed.

        Raises:
            InvalidValueError: There are too many.
        """
        frames = {**self.tool_frames, name: tool}
        if len(frames) > MOST_FRAMES:
            raise InvalidValueError("tool frame", name, f"is one too many: there are {MOST_FRAMES}")
        return replace(self, tool_frames=MappingProxyType(frames))

    def with_work_frame(self, name: str, pose: Pose) -> Settings:
        """Returns the settings with a work frame, new or changed.

        Raises:
            InvalidValueError: There are too many.
        """
        frames = {**self.work_frames, name: pose}
        if len(frames) > MOST_FRAMES:
            raise InvalidValueError("work frame", name, f"is one too many: there are {MOST_FRAMES}")
        return replace(self, work_frames=MappingProxyType(frames))
