"""The moves and events of a program: its blocks repeated, its instructions made times at standstill and events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rcilab.core.errors import InvalidValueError
from rcilab.motion.motion_event import EventKind
from rcilab.motion.waypoint import Waypoint, named_value
from rcilab.motion.waypoint_types import BLOCKS, MOST_WAYPOINTS

STANDSTILL = 0.01
"""Time at standstill around an instruction that waits for an input, [s]: its row and those before it are alike."""


@dataclass(frozen=True, slots=True)
class Move:
    """One segment of the motion of a program."""

    row: int
    """Number of the waypoint, from 1."""
    waypoint: Waypoint
    offset: float = 0.0
    """Distance of its end from the waypoint's target, against the tool's z axis, [m]."""


@dataclass(frozen=True, slots=True)
class PlacedEvent:
    """An event, placed by the moves before it."""

    kind: EventKind
    move: int
    """Index of the move at whose start it is."""
    delay: float
    """Time after that start, [s]."""
    signal: int
    level: bool
    row: int
    timeout: float = 0.0
    until: int = 0
    """Of leave: index of the move at whose start the motion continues, after the same delay."""


@dataclass(frozen=True, slots=True)
class Expansion:
    """The moves of a program in their order, with its events."""

    moves: tuple[Move, ...]
    events: tuple[PlacedEvent, ...]

    @property
    def rows(self) -> tuple[int, ...]:
        """Number of the waypoint of each move, from 1."""
        return tuple(move.row for move in self.moves)


def expand(waypoints: Sequence[Waypoint]) -> Expansion:
    """Returns the moves and events of waypoints whose frames and signals are resolved.

    Raises:
        InvalidValueError: A block has no end, an end has no block, a signal is a name, nothing moves or waits, or the
            moves are too many.
    """
    builder = _Builder(waypoints)
    builder.add(0, len(waypoints))
    if builder.events and builder.events[-1].move == len(builder.moves):
        builder.stand(builder.events[-1].row)
    if not builder.moves:
        raise InvalidValueError("waypoints", len(waypoints), "have no motion: add a joint move or a line").coded(
            "nothing_moves"
        )
    return Expansion(tuple(builder.moves), tuple(builder.events))


def block_ends(waypoints: Sequence[Waypoint]) -> dict[int, int]:
    """Returns the index of the end of each block by that of its begin.

    Raises:
        InvalidValueError: A block has no end, or an end has no block.
    """
    ends: dict[int, int] = {}
    opened: list[int] = []
    for index, waypoint in enumerate(waypoints):
        if waypoint.type in BLOCKS:
            opened.append(index)
        elif waypoint.type == "end":
            if not opened:
                error = InvalidValueError(
                    "end", None, "is missing a block to end: remove it, or add repeat or group before it"
                )
                raise named_value(index + 1, "end", error.coded("end_alone"))
            ends[opened.pop()] = index
    if opened:
        index = opened[-1]
        error = InvalidValueError("end", None, "is missing: add an end after the last step of the block")
        raise named_value(index + 1, waypoints[index].type, error.coded("end_missing"))
    return ends


class _Builder:
    """Owned by one call of `expand`."""

    def __init__(self, waypoints: Sequence[Waypoint]) -> None:
        self._waypoints, self._ends = waypoints, block_ends(waypoints)
        self.moves: list[Move] = []
        self.events: list[PlacedEvent] = []

    def add(self, begin: int, end: int) -> None:
        """Adds the steps of a range of indices."""
        index = begin
        while index < end:
            waypoint, row = self._waypoints[index], index + 1
            match waypoint.type:
                case "repeat" | "group":
                    self._repeat(index)
                    index = self._ends[index]
                case "comment" | "end":
                    pass
                case "wait":
                    self._move(Move(row, waypoint))
                case "tool":
                    self._use_tool(waypoint, row)
                case "input":
                    self._event("input", waypoint, row, timeout=waypoint.timeout or 0.0)
                    self.stand(row)
                case "output":
                    signal = _number(waypoint, row)
                    self.events.append(PlacedEvent("output", len(self.moves), 0.0, signal, bool(waypoint.level), row))
                case _:
                    self._approach(waypoint, row)
            index += 1

    def stand(self, row: int) -> None:
        """Adds a short time at standstill."""
        self._move(Move(row, Waypoint(type="wait", dwell=STANDSTILL)))

    def _approach(self, waypoint: Waypoint, row: int) -> None:
        if not waypoint.approach:
            self._move(Move(row, replace(waypoint, approach=None)))
            return
        self._move(Move(row, replace(waypoint, approach=None, dwell=0.0), offset=waypoint.approach))
        self._move(Move(row, replace(waypoint, type="line", approach=None, blend=0.0)))

    def _use_tool(self, waypoint: Waypoint, row: int) -> None:
        """Adds the output of the jaws, which are set at standstill, and the time that they need."""
        if waypoint.signal is None:
            problem = "needs a cell: plan cell.resolve(program), or give the number of the output that closes them"
            error = InvalidValueError("jaws", waypoint.jaws, problem).coded("unresolved_jaws")
            raise named_value(row, "tool", error)
        signal = _number(waypoint, row)
        self.events.append(PlacedEvent("output", len(self.moves), 0.0, signal, waypoint.jaws == "close", row))
        self._move(Move(row, Waypoint(type="wait", dwell=max(waypoint.dwell, STANDSTILL))))

    def _repeat(self, index: int) -> None:
        waypoint, end = self._waypoints[index], self._ends[index]
        count, row = waypoint.count or 1, index + 1
        leaves: list[int] = []
        for number in range(count):
            self.add(index + 1, end)
            if waypoint.signal is None:
                continue
            if number + 1 < count:
                leaves.append(len(self.events))
                self._event("leave", waypoint, row)
            else:
                self._event("input", waypoint, row)
            self.stand(row)
        for at in leaves:
            self.events[at] = replace(self.events[at], until=len(self.moves) - 1)

    def _event(self, kind: EventKind, waypoint: Waypoint, row: int, timeout: float = 0.0) -> None:
        """Adds an event in the middle of the standstill that follows."""
        signal, level = _number(waypoint, row), bool(waypoint.level)
        self.events.append(PlacedEvent(kind, len(self.moves), STANDSTILL / 2.0, signal, level, row, timeout))

    def _move(self, move: Move) -> None:
        if len(self.moves) >= MOST_WAYPOINTS:
            raise InvalidValueError(
                "waypoints", len(self.moves) + 1, f"with repetitions must be 1 to {MOST_WAYPOINTS}"
            ).coded("span", low="1", high=str(MOST_WAYPOINTS))
        self.moves.append(move)


def _number(waypoint: Waypoint, row: int) -> int:
    if isinstance(waypoint.signal, int):
        return waypoint.signal
    problem = "is a name: plan cell.resolve(program), with the cell that has this signal, or give its number"
    error = InvalidValueError("signal", waypoint.signal, problem).coded("unresolved_signal", name=waypoint.signal)
    raise named_value(row, waypoint.type, error)
