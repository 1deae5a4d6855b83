"""Writing to a page from any thread: wakes viser's event loop only from inside it, and only when it waits.

viser 1.1 pushes a message by calling `set()` of an asyncio event in whatever thread writes, which walks the event's
waiters while the loop may be changing them ("deque mutated during iteration"), and wakes them in the wrong thread. It
also wakes the loop for every message, though what has come is looked at 60 times a second anyway: two thirds of the
times there is nothing to do, and a wake costs as much as all the rest of a message.

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
    """What `asyncio.Event` is, but it belongs to one loop and may be set from any thread.

    Args:
        loop: The loop whose tasks wait for it.
        is_held: Whether it shall stay as it is now, because it will be set once more.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, is_held: Callable[[], bool] = lambda: False) -> None:
        self._loop, self._is_held = loop, is_held
        self._lock = threading.Lock()  # Between a look at the flag and the beginning of a wait it must not be set.
        self._is_set = False
        self._waiting: list[asyncio.Future[None]] = []

    def is_set(self) -> bool:
        """Returns whether it was set since it was cleared."""
        return self._is_set

    def clear(self) -> None:
        """Lets the next `wait` wait."""
        self._is_set = False

    def set(self) -> None:
        """Wakes who waits: at once on the loop, else as soon as the loop comes to it."""
        if self._is_held():
            return
        with self._lock:
            self._is_set = True
            if not self._waiting:
                return
        if _running_loop() is self._loop:
            self._wake()
        else:
            with suppress(RuntimeError):  # The loop is closed: nothing waits any more.
                self._loop.call_soon_threadsafe(self._wake)

    async def wait(self) -> bool:
        """Returns once it is set; on the loop only."""
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
    """Has every message buffer that viser makes from now on use such events. May be called again."""
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
            """Takes a message as a batch of one."""
            self.atomic_start()
            try:
                super().push(message)
            finally:
                self.atomic_end()

        def atomic_end(self) -> None:
            """Ends a batch; the end of the last one informs the loop that there is something to send."""
            with self.buffer_lock:
                self.atomic_counter -= 1
            self.message_event.set()

    infra.AsyncMessageBuffer = LoopBuffer


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
