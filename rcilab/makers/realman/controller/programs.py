"""Programs of a client: files of points, as the recording of a drag teaching is one, and the one that runs.

A program goes to its first point as a planned motion, then follows its points as a stream, `POINT_CYCLES` each at full
speed. Other lines than points are not simulated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import msgspec

from rcilab.sim.channels import Peer

POINT_CYCLES: Final = 10
"""Between two points of a recording; rcilab's own value."""
MOST_RECORDED: Final = 1000
"""Points of a recording; rcilab's own value."""
_FULL_SPEED = 100  # [%]


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A stored program."""

    name: str
    size: int
    """[bytes]."""
    speed: int
    """[%]."""
    points: tuple[tuple[int, ...], ...]
    """Joint angles, [0.001 deg]."""


@dataclass(slots=True, kw_only=True)
class RunningProgram:
    """The program that runs. Owned by the controller."""

    number: int
    """0 for one that is not stored."""
    program: Program
    speed: int
    """[%]."""
    peer: Peer
    """Who is notified of its end."""
    approach: int
    """Number of the target at its first point."""
    is_paused: bool = False
    follows: bool = False
    """Whether the first point is reached."""
    count: int = 0
    """Points that were streamed."""
    wait: float = 0.0
    """Until the next point, [cycles]."""

    @property
    def period(self) -> float:
        """Between two points, [cycles]."""
        return POINT_CYCLES * _FULL_SPEED / self.speed


class _Line(msgspec.Struct):
    file: int | None = None
    name: str | None = None
    type: int | None = None
    point: list[int] | None = None


_decode = msgspec.json.Decoder(_Line).decode


def read_points(data: bytes, n: int) -> tuple[tuple[tuple[int, ...], ...], int]:
    """Returns the points of a file, and 0 or the number of the first line that is not simulated or not valid.

    The line before the points has their number as its type; what is behind them is ignored, as the maker's examples
    leave the end of a longer file there.
    """
    points: list[tuple[int, ...]] = []
    count: int | None = None
    for number, text in enumerate(data.splitlines(), 1):
        try:
            line = _decode(text)
        except msgspec.DecodeError:
            return (), number
        if line.point is not None:
            if len(line.point) != n:
                return (), number
            points.append(tuple(line.point))
            if len(points) == count:
                break
        elif line.file != n if line.name is None else line.name != "Folder":
            return (), number
        else:
            count = line.type
    return tuple(points), 0 if points else 1


def describe_run(running: RunningProgram | None) -> dict[str, Any]:
    """Returns the answer to get_program_run_state."""
    answer: dict[str, Any] = {"command": "get_program_run_state", "run_state": 0}
    if running is not None:
        answer |= {
            "run_state": 2 if running.is_paused else 1,
            "id": running.number,
            "plan_num": running.count,
            "loop_num": [],
            "loop_cont": [],
            "step_mode": 0,
            "plan_speed": running.speed,
        }
    return answer
