"""Thread-safe events for viser's message buffers, which wake the event loop only if it waits.

viser 1.1 calls `set()` of an asyncio event in the thread that sends a message. It iterates over the event's waiters
while the loop may change them ("deque mutated during iteration"), and wakes them in the wrong thread. It also wakes the
loop for every message, although the loop sends only 60 times per second: two thirds of the wake-ups find nothing to do,
and a wake-up takes as long as the rest of sending a message.

Unnecessary once viser wakes its event loop with `call_soon_threadsafe`, at most once per pass of its sender.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from viser.infra import Message


class LoopEvent:
    """An `asyncio.Event` of one loop that may be set from any thread.

    Args:
        loop: The loop whose tasks wait for the event.
        is_held: Whether `set` has no effect for now, because another call will follow.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, is_held: Callable[[], bool] = lambda: False) -> None:
        self._loop, self._is_held = loop, is_held
        self._lock = threading.Lock()  # The flag must not be set between its check and the start of a wait.
        self._is_set = False
        self._waiting: list[asyncio.Future[None]] = []

    def is_set(self) -> bool:
        """Returns whether the event is set."""
        return self._is_set

    def clear(self) -> None:
        """Clears the event."""
        self._is_set = False

    def set(self) -> None:
        """Sets the event and wakes the waiting tasks."""
        if self._is_held():
            return
        with self._lock:
            self._is_set = True
            if not self._waiting:
                return
        if _running_loop() is self._loop:
            self._wake()
        else:
            with suppress(RuntimeError):  # The loop is closed.
                self._loop.call_soon_threadsafe(self._wake)

    async def wait(self) -> bool:
        """Waits until the event is set. Must run on the loop."""
        with self._lock:
            if self._is_set:
                return True
            future = self._loop.create_future()
            self._waiting.append(future)
        try:
            await future
        finally:
            self._waiting.remove(future)
        return True

    def _wake(self) -> None:
        for future in self._waiting:
            if not future.done():
                future.set_result(None)


def install() -> None:
    """Patches the message buffers that viser creates from now on. May be called again."""
    from viser.infra import _infra as module
    from viser.infra._async_message_buffer import AsyncMessageBuffer

    infra: Any = module
    if infra.AsyncMessageBuffer is not AsyncMessageBuffer:
        return

    class LoopBuffer(AsyncMessageBuffer):
        message_event: Any
        flush_event: Any

        def __init__(self, event_loop: asyncio.AbstractEventLoop, *args: Any, **options: Any) -> None:
            super().__init__(event_loop, *args, **options)
            self.message_event = LoopEvent(event_loop, lambda: self.atomic_counter > 0)
            self.flush_event = LoopEvent(event_loop)

        def push(self, message: Message) -> None:
            """Adds a message as a batch of one."""
            self.atomic_start()
            try:
                super().push(message)
            finally:
                self.atomic_end()

        def atomic_end(self) -> None:
            """Ends a batch; the end of the last batch wakes the loop."""
            with self.buffer_lock:
                self.atomic_counter -= 1
            self.message_event.set()

    infra.AsyncMessageBuffer = LoopBuffer


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
