"""The one queue between the page's callbacks and the thread that acts on them."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class CoalescingQueue(Generic[T]):
    """A queue in which a newer request can replace an older one that has not been taken yet.

    While a gizmo is dragged, twenty positions a second arrive; only the newest is worth solving.
    """

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._waiting: deque[tuple[str | None, T]] = deque()

    def put(self, request: T, key: str | None = None) -> None:
        """Adds a request at the end and returns at once.

        Args:
            request: What is asked for.
            key: When the newest waiting request has the same key, it is replaced.
        """
        with self._condition:
            if key is not None and self._waiting and self._waiting[-1][0] == key:
                self._waiting[-1] = (key, request)
            else:
                self._waiting.append((key, request))
            self._condition.notify()

    def take(self, timeout: float) -> T | None:
        """Returns the oldest request, or None when none came within `timeout`, [s]."""
        with self._condition:
            if not self._waiting:
                self._condition.wait(timeout)
            return self._waiting.popleft()[1] if self._waiting else None
