"""Modes and states of the controller, and the effect of every command in every one of them: tables, pure.

`docs/xarm-controller.md` has the table as `mode_table` prints it. State 0 can only be set; 1, 2 and 5 can only be
reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum, IntEnum
from typing import Final


class Mode(IntEnum):
    """The kind of motion commands that are carried out. Mode 3 does not exist."""

    POSITION = 0
    SERVO = 1
    TEACH = 2
    JOINT_VELOCITY = 4
    CARTESIAN_VELOCITY = 5
    JOINT_ONLINE = 6
    CARTESIAN_ONLINE = 7


class State(IntEnum):
    """The state in reports."""

    MOVING = 1
    READY = 2
    PAUSED = 3
    STOPPED = 4
    CHANGED = 5
    """A setting has changed: nothing moves until the state is set to 0."""
    STOPPING = 6
    """Slows down; then STOPPED."""


class Command(Enum):
    """A kind of motion command."""

    JOINTS = "joints"
    LINE = "line"
    CIRCLE = "circle"
    PAUSE = "pause"
    SERVO_JOINTS = "servo joints"
    SERVO_POSE = "servo pose"
    JOINT_VELOCITY = "joint velocity"
    TOOL_VELOCITY = "tool velocity"


class Answer(Enum):
    """What becomes of a motion command."""

    QUEUED = "queued"
    """Carried out after those before it."""
    HELD = "held"
    """Queued, and carried out after the pause."""
    FOLLOWED = "followed"
    """Carried out at once, replacing the current motion."""
    WRONG_MODE = "wrong mode"
    """Refused: of another mode."""
    NOT_READY = "not ready"
    """Refused until the state is set to 0."""

    @property
    def is_taken(self) -> bool:
        """Whether the command is carried out."""
        return self in (Answer.QUEUED, Answer.HELD, Answer.FOLLOWED)


ACCEPTED: Final = {
    Mode.POSITION: (Command.JOINTS, Command.LINE, Command.CIRCLE, Command.PAUSE),
    Mode.SERVO: (Command.SERVO_JOINTS, Command.SERVO_POSE),
    Mode.TEACH: (),
    Mode.JOINT_VELOCITY: (Command.JOINT_VELOCITY,),
    Mode.CARTESIAN_VELOCITY: (Command.TOOL_VELOCITY,),
    Mode.JOINT_ONLINE: (Command.JOINTS,),
    Mode.CARTESIAN_ONLINE: (Command.LINE,),
}
"""The commands of each mode."""

SET_READY, SET_PAUSED, SET_STOPPED, SET_STOPPING = 0, 3, 4, 6
TRANSITIONS: Final = {
    SET_READY: {
        State.MOVING: State.MOVING,
        State.READY: State.READY,
        State.PAUSED: State.READY,
        State.STOPPED: State.READY,
        State.CHANGED: State.READY,
        State.STOPPING: State.STOPPING,
    },
    SET_PAUSED: {
        State.MOVING: State.PAUSED,
        State.READY: State.PAUSED,
        State.PAUSED: State.PAUSED,
        State.STOPPED: State.STOPPED,
        State.CHANGED: State.CHANGED,
        State.STOPPING: State.STOPPING,
    },
    SET_STOPPED: dict.fromkeys(State, State.STOPPED),
    SET_STOPPING: {
        State.MOVING: State.STOPPING,
        State.READY: State.STOPPED,
        State.PAUSED: State.STOPPED,
        State.STOPPED: State.STOPPED,
        State.CHANGED: State.CHANGED,
        State.STOPPING: State.STOPPING,
    },
}
"""The state after a value was set, by the state before. Other values cannot be set.

READY becomes MOVING with a motion. With an error, or without motors, the state stays STOPPED.
"""


def answer(mode: Mode, command: Command, state: State) -> Answer:
    """Returns what becomes of a motion command."""
    if state in (State.STOPPED, State.CHANGED, State.STOPPING):
        return Answer.NOT_READY
    if command not in ACCEPTED[mode]:
        return Answer.WRONG_MODE
    if state is State.PAUSED:
        return Answer.HELD if mode is Mode.POSITION else Answer.NOT_READY
    return Answer.QUEUED if mode is Mode.POSITION else Answer.FOLLOWED


def mode_table() -> Iterator[str]:
    """Yields the lines of both tables, in Markdown."""
    states = tuple(State)
    names = [f"{state.value} {state.name.lower()}" for state in states]
    yield "| mode | command | " + " | ".join(names) + " |"
    yield "| --- " * (len(states) + 2) + "|"
    for mode in Mode:
        for command in Command:
            cells = [answer(mode, command, state).value for state in states]
            name = f"{mode.value} {mode.name.lower().replace('_', ' ')}"
            yield f"| {name} | {command.value} | " + " | ".join(cells) + " |"
    yield ""
    yield "| set | " + " | ".join(names) + " |"
    yield "| --- " * (len(states) + 1) + "|"
    for value, after in TRANSITIONS.items():
        yield f"| {value} | " + " | ".join(f"{after[state].value}" for state in states) + " |"
