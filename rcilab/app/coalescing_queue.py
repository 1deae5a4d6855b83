"""The queue between the page's callbacks and the dispatcher's thread."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class CoalescingQueue(Generic[T]):
    """A queue in which a newer request can replace a waiting older one.

    During a drag, twenty positions per second arrive; only the newest needs a solution.
    """

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._waiting: deque[tuple[str | None, T]] = deque()

    def put(self, request: T, key: str | None = None) -> None:
        """Appends a request and returns at once.

        Args:
            request: The request.
            key: The newest waiting request with the same key is replaced.
        """
        with self._condition:
            if key is not None and self._waiting and self._waiting[-1][0] == key:
                self._waiting[-1] = (key, request)
            else:
                self._waiting.append((key, request))
            self._condition.notify()

    def take(self, timeout: float) -> T | None:
        """Returns the oldest request, or None if none came within `timeout`, [s]."""
        with self._condition:
            if not self._waiting:
                self._condition.wait(timeout)
            return self._waiting.popleft()[1] if self._waiting else None
