"""What a cell has by name: work frames, obstacles, signals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from rcilab.cell.shapes import Shape, require_shape
from rcilab.cell.tool import require_name
from rcilab.core.arrays import as_number, described
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose, as_pose

WORLD = "world"
"""Name of the frame that everything in a cell is placed in."""
SignalKind = Literal["input", "output"]
Carried = Literal["tool", "part"]
"""What may touch an obstacle: the tool, or the part that it holds."""

_LAST_CHANNEL = 1023


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """A named work frame.

    Raises:
        InvalidValueError: The name or the pose is not valid.
    """

    name: str
    parent: str = WORLD
    """Name of the frame that it moves with."""
    T_parent_frame: Pose = IDENTITY

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", require_name(self.name, "frame"))
        object.__setattr__(self, "T_parent_frame", as_pose(self.T_parent_frame, f"pose of {self.name}"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A solid that stands in the cell.

    Raises:
        InvalidValueError: The name, the shape or the pose is not valid.
    """

    name: str
    shape: Shape
    pose: Pose = IDENTITY
    """Of the shape, in `frame`."""
    frame: str = WORLD
    """Name of the frame that it moves with."""
    may_touch: tuple[Carried, ...] = ()
    """What is not checked against it: the tool that works on it, the part that is put on it. Links always are."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", require_name(self.name, "obstacle"))
        object.__setattr__(self, "shape", require_shape(self.shape))
        object.__setattr__(self, "pose", as_pose(self.pose, f"pose of {self.name}"))
        object.__setattr__(self, "may_touch", tuple(self.may_touch))
        for carried in self.may_touch:
            if carried not in get_args(Carried):
                raise InvalidValueError("may_touch", described(carried), f"must be of: {', '.join(get_args(Carried))}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Signal:
    """A digital signal of the controller, by name.

    Raises:
        InvalidValueError: The name, the kind or the channel is not valid.
    """

    name: str
    kind: SignalKind
    channel: int
    """Number of the controller's input or output."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", require_name(self.name, "signal"))
        if self.kind not in get_args(SignalKind):
            raise InvalidValueError("kind", described(self.kind), f"must be {' or '.join(get_args(SignalKind))}")
        channel = as_number(self.channel, "channel")
        if not (0 <= channel <= _LAST_CHANNEL and channel.is_integer()):
            raise InvalidValueError("channel", channel, f"must be a whole number from 0 to {_LAST_CHANNEL}")
        object.__setattr__(self, "channel", int(channel))
