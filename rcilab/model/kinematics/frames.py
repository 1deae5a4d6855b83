"""The named frames of an arm: those after each joint, the flange, the tool, the stiffness frame."""

from __future__ import annotations

from typing import Literal, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose

Frame: TypeAlias = Literal[
    "joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint7", "flange", "tool", "stiffness"
]
"""joint1 to jointn: Denavit-Hartenberg frames after each joint; the last one is the flange. The vendor's library has
the same ones; there the tool is called end effector."""


def locate(frame: str, n: int, T_flange_tool: Pose, T_tool_stiffness: Pose) -> tuple[int, Pose]:
    """Returns how many joints come before a frame, and its pose in the frame after the last of them.

    Args:
        frame: Its name.
        n: How many joints the arm has.
        T_flange_tool: Pose of the tool in the flange.
        T_tool_stiffness: Pose of the stiffness frame in the tool.

    Raises:
        InvalidValueError: The arm has no such frame; the message lists those it has.
    """
    if frame == "tool":
        return n, T_flange_tool
    if frame == "stiffness":
        return n, T_flange_tool @ T_tool_stiffness
    names = [f"joint{number}" for number in range(1, n + 1)]
    if frame == "flange":
        return n, IDENTITY
    if frame in names:
        return names.index(frame) + 1, IDENTITY
    raise InvalidValueError("frame", frame, f"must be one of {', '.join(names)}, flange, tool, stiffness")
