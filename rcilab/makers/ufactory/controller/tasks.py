"""Commands whose outcome is reported to the client, and actions that wait for their turn in the queue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rcilab.makers.ufactory.controller.xarm_controller import TaskEvent
from rcilab.makers.ufactory.wire.frame import Feedback, Frame
from rcilab.sim.channels import Peer
from rcilab.sim.planner import EventKind

MOTION_START, MOTION_END, TRIGGER = 1, 2, 4
"""Bits of the feedback that a client asks for, and kinds of a feedback."""
_SUCCESS, _FAILED, _DISCARDED = 0, 1, 2
_RESULTS = {EventKind.REACHED: _SUCCESS, EventKind.REFUSED: _FAILED, EventKind.DISCARDED: _DISCARDED}
_MOST_TASKS = 0x10000


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A command that has not ended."""

    peer: Peer
    request: Frame
    feedback: int
    """Bits that were set when it came."""
    action: Callable[[], None] | None = None
    """What is done when its turn comes; None for a motion."""


class Tasks:
    """All tasks. Owned by the server.

    Args:
        send: Sends a feedback to a client; its status is filled in.
    """

    def __init__(self, send: Callable[[Peer, Feedback], None]) -> None:
        self._send = send
        self._tasks: dict[int, Task] = {}
        self._last = 0

    def add(self, task: Task) -> int:
        """Returns the number of a new task."""
        self._last = (self._last + 1) % _MOST_TASKS
        self._tasks[self._last] = task
        return self._last

    def drop(self, number: int) -> None:
        """Forgets a task that was not carried out."""
        self._tasks.pop(number, None)

    def forget(self, peer: Peer) -> None:
        """Forgets the client of tasks; its motions and actions continue."""
        for number, task in self._tasks.items():
            if task.peer is peer:
                self._tasks[number] = Task(task.peer, task.request, 0, task.action)

    def handle(self, event: TaskEvent, microseconds: int) -> None:
        """Carries out what is due at an event, and informs the client."""
        if event.kind is EventKind.BEGAN:
            task = self._tasks.get(event.task)
            if task is not None and task.action is None and task.feedback & MOTION_START:
                self._inform(event.task, task, MOTION_START, _SUCCESS, microseconds)
            return
        task = self._tasks.pop(event.task, None)
        if task is None:
            return
        kind = MOTION_END
        if task.action is not None:
            kind = TRIGGER
            if event.kind is EventKind.REACHED:
                task.action()
        if task.feedback & kind:
            self._inform(event.task, task, kind, _RESULTS[event.kind], microseconds)

    def _inform(self, number: int, task: Task, kind: int, result: int, microseconds: int) -> None:
        request = task.request
        feedback = Feedback(
            request.transaction, request.protocol, 0, kind, request.function, number, result, microseconds
        )
        self._send(task.peer, feedback)
