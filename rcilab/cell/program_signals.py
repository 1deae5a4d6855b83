"""The signals of a program by the names that a cell gives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rcilab.cell.entries import Signal, SignalKind
from rcilab.cell.tool import Tool
from rcilab.core.errors import InvalidValueError
from rcilab.motion.program import Program
from rcilab.motion.waypoint import Waypoint, named_value


def resolve_signals(program: Program, signals: Sequence[Signal], tool: Tool | None) -> Program:
    """Returns a program with numbers for the names of its signals; see `Cell.resolve`."""
    found = tuple(_resolved(number, waypoint, signals, tool) for number, waypoint in enumerate(program.waypoints, 1))
    return program if found == program.waypoints else replace(program, waypoints=found)


def _resolved(number: int, waypoint: Waypoint, signals: Sequence[Signal], tool: Tool | None) -> Waypoint:
    try:
        name = waypoint.signal
        if waypoint.type == "tool" and name is None:
            name = _jaws_signal(tool)
        if isinstance(name, str):
            kind: SignalKind = "output" if waypoint.type in ("output", "tool") else "input"
            return replace(waypoint, signal=_channel(name, kind, signals))
    except InvalidValueError as error:
        raise named_value(number, waypoint.type, error) from error
    return waypoint


def _jaws_signal(tool: Tool | None) -> str:
    if tool is None or tool.jaws is None:
        raise InvalidValueError("jaws", None, "are missing: the cell's tool has no jaws").coded("no_jaws")
    if not tool.jaws.signal:
        problem = "have no signal: name the output that closes them, in the cell's file as signal of the jaws"
        raise InvalidValueError("jaws", tool.name, problem).coded("jaws_signal", tool=tool.name)
    return tool.jaws.signal


def _channel(name: str, kind: SignalKind, signals: Sequence[Signal]) -> int:
    for signal in signals:
        if signal.name == name and signal.kind == kind:
            return signal.channel
    known = ", ".join(signal.name for signal in signals if signal.kind == kind)
    problem = f"is no {kind} of the cell; there are: {known or 'none'}"
    raise InvalidValueError("signal", name, problem).coded("no_signal", name=name, known=known or "–")
