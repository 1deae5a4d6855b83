"""The named frames of an arm: after each joint, flange, tool and stiffness frame."""

from __future__ import annotations

from typing import Literal, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose

Frame: TypeAlias = Literal[
    "joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint7", "flange", "tool", "stiffness"
]
"""joint1 to jointn: Denavit-Hartenberg frames after each joint; the last one is the flange. The vendor's library has
the same frames; it calls the tool the end effector."""


def locate(frame: str, n: int, T_flange_tool: Pose, T_tool_stiffness: Pose) -> tuple[int, Pose]:
    """Returns the number of joints before a frame, and its pose in the frame after the last of them.

    Args:
        frame: Name of the frame.
        n: Number of joints of the arm.
        T_flange_tool: Pose of the tool in the flange.
        T_tool_stiffness: Pose of the stiffness frame in the tool.

    Raises:
        InvalidValueError: The arm has no frame of this name; the message lists its frames.
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
