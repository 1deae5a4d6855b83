"""Writing to a page from any thread: wakes viser's event loop only from inside it.

viser 1.1 pushes a message by calling `set()` of an asyncio event in whatever thread writes, which walks the event's
waiters while the loop may be changing them ("deque mutated during iteration"), and wakes them in the wrong thread.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any


class LoopEvent(asyncio.Event):
    """An event that belongs to one loop and may be set from any thread.

    Args:
        loop: The loop whose tasks wait for it.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._owner = loop

    def set(self) -> None:
        """Wakes who waits: at once on the loop, else as soon as the loop comes to it."""
        if _running_loop() is self._owner:
            super().set()
        elif not self.is_set():
            with suppress(RuntimeError):  # The loop is closed: nobody waits any more.
                self._owner.call_soon_threadsafe(super().set)


def install() -> None:
    """Has every message buffer that viser makes from now on use such events. May be called again."""
    from viser.infra import _infra as module
    from viser.infra._async_message_buffer import AsyncMessageBuffer

    infra: Any = module
    if infra.AsyncMessageBuffer is not AsyncMessageBuffer:
        return

    class LoopBuffer(AsyncMessageBuffer):
        def __init__(self, event_loop: asyncio.AbstractEventLoop, *args: Any, **options: Any) -> None:
            super().__init__(event_loop, *args, **options)
            self.message_event, self.flush_event = LoopEvent(event_loop), LoopEvent(event_loop)

    infra.AsyncMessageBuffer = LoopBuffer


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
