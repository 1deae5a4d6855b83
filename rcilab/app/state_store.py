"""The store of an application's state: each change replaces the whole value."""

from __future__ import annotations

import threading
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from rcilab.app.app_state import AppState, Toast
from rcilab.app.edit_order import EditOrder
from rcilab.app.goal.goal import Goal, Tone
from rcilab.i18n.translator import Message

ROBOT_NOT_READY = "robot"
"""Cause of the notices that the robot cannot move."""

UNDO_DEPTH = 100
_NOTICES = 4  # For each page, and for all pages together: more would cover the scene.

S = TypeVar("S", bound=AppState, covariant=True)


class StateStore(Generic[S]):
    """Holds the state. One thread at a time writes, any thread may read a snapshot."""

    def __init__(self, state: S) -> None:
        self._lock = threading.Lock()
        self._state = state
        self._past: list[Goal] = []
        self._future: list[Goal] = []
        self.order = EditOrder()
        """The order of the edits of all features."""
        self._notices = 0
        self.changed = threading.Event()
        """Set when a request has been carried out, cleared by the view that shows it."""

    @property
    def state(self) -> S:
        """The newest snapshot."""
        return self._state

    def update(self, **changes: Any) -> S:
        """Replaces the state by one with these fields changed, and returns it."""
        with self._lock:
            self._state = replace(self._state, **changes)
            return self._state

    def notify(self, tone: Tone, text: Message, *, page: int | None = None, cause: str = "") -> None:
        """Shows a notice, on one page or on every page.

        Args:
            tone: Its style.
            text: Its message.
            page: Client id of the only page that shows it; None: all pages.
            cause: Key of the cause; `clear_notices` withdraws all notices with it.
        """
        with self._lock:
            self._notices += 1
            new = Toast(self._notices, tone, text, page, cause)
            same = [notice for notice in self._state.notices if notice.page == page]
            gone = same[: -(_NOTICES - 1)]
            kept = (notice for notice in self._state.notices if notice not in gone)
            self._state = replace(self._state, notices=(*kept, new))

    def forget_page(self, page: int) -> None:
        """Drops the notices of a page that has closed."""
        with self._lock:
            self._state = replace(self._state, notices=tuple(n for n in self._state.notices if n.page != page))

    def clear_notices(self, cause: str) -> None:
        """Withdraws the notices of a cause that is over."""
        with self._lock:
            notices = self._state.notices
            if any(notice.cause == cause for notice in notices):
                self._state = replace(self._state, notices=tuple(n for n in notices if n.cause != cause))

    def set_problem(self, field: str, problem: Message) -> None:
        """Shows a problem of a typed value next to its field."""
        self.update(problems=MappingProxyType({**self._state.problems, field: problem}))

    def clear_problems(self, *beginnings: str) -> None:
        """Clears the problems of all fields whose names begin so."""
        problems = self._state.problems
        kept = {field: sentence for field, sentence in problems.items() if not field.startswith(beginnings)}
        if len(kept) < len(problems):
            self.update(problems=MappingProxyType(kept))

    def push_undo(self) -> None:
        """Stores the current goal for `undo`."""
        self._past, self._future = [*self._past[-UNDO_DEPTH:], self._state.goal], []
        self.order.add("goal", self._state.model.name)

    def undo(self) -> Goal | None:
        """Returns the goal that was stored last, or None; `redo` returns the current one."""
        if not self._past:
            return None
        self._future.append(self._state.goal)
        self.order.undone("goal", self._state.model.name)
        return self._past.pop()

    def redo(self) -> Goal | None:
        """Returns the goal before the last `undo`, or None."""
        if not self._future:
            return None
        self._past.append(self._state.goal)
        self.order.repeated("goal", self._state.model.name)
        return self._future.pop()

    def clear_undo(self) -> None:
        """Clears the undo history: it belongs to another arm."""
        self._past, self._future = [], []
        self.order.forget("goal", self._state.model.name)
