"""A second websocket beside viser's: status to the page's bar, Stop and seeking back from it.

It does not depend on which tab or panel is shown, so Stop stays reachable whatever the page looks like.
"""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Callable
from typing import Any

LIVE_PATH = "/rcilab/live"

_LARGEST_MESSAGE = 4096  # [bytes] A page sends a few words; anything longer is not ours.


class LiveChannel:
    """Sends one JSON object to every page when it changes, and hears the few things the bar can say.

    Args:
        on_stop: Called when somebody presses Stop or Esc. It must return at once.
        on_seek: Called with the place in the motion that was clicked in a plot, 0 to 1.
        on_here: Called when a page has answered a beat: somebody who could press Stop is connected.
        on_size: Called with the height of a page's window, [px], when it opens and when it changes.
    """

    def __init__(
        self,
        on_stop: Callable[[], None],
        on_here: Callable[[], None],
        on_seek: Callable[[float], None],
        on_size: Callable[[float], None],
    ) -> None:
        self._on_stop, self._on_here, self._on_seek, self._on_size = on_stop, on_here, on_seek, on_size
        self._pages: set[Any] = set()  # Owned by the event loop.
        self._loop: asyncio.AbstractEventLoop | None = None
        self._latest: dict[str, Any] = {}

    async def serve(self, page: Any) -> None:
        """Serves one page until it goes; runs on the server's event loop."""
        self._loop = asyncio.get_running_loop()
        self._pages.add(page)
        try:
            await page.send(json.dumps(self._latest))
            async for message in page:
                self.hear(message)
        except Exception as error:
            from websockets.exceptions import ConnectionClosed

            if not isinstance(error, ConnectionClosed):
                raise
        finally:
            self._pages.discard(page)

    def hear(self, message: str | bytes) -> None:
        """Acts on one message of a page; anything that is not one of ours is ignored."""
        if len(message) > _LARGEST_MESSAGE:
            return
        try:
            said = json.loads(message)
        except ValueError:
            return
        if not isinstance(said, dict):
            return
        if said.get("kind") == "stop":
            self._on_stop()
        elif said.get("kind") == "here":
            self._on_here()
        elif said.get("kind") == "seek":
            self._pass_on(said.get("place"), 0.0, 1.0, self._on_seek)
        elif said.get("kind") == "size":
            self._pass_on(said.get("height"), 200.0, 4000.0, self._on_size)

    @staticmethod
    def _pass_on(number: object, low: float, high: float, act: Callable[[float], None]) -> None:
        if isinstance(number, int | float) and not isinstance(number, bool) and math.isfinite(number):
            act(min(max(float(number), low), high))

    def publish(self, **values: Any) -> None:
        """Shows new values; only those that changed travel. For one thread, the presenter's."""
        changed = {name: value for name, value in values.items() if self._latest.get(name) != value}
        if not changed:
            return
        self._latest = {**self._latest, **changed}
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._send, json.dumps(changed))

    def beat(self) -> None:
        """Asks every page whether it is still there. A page answers even while its timers are throttled in the back."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._send, '{"beat": 1}')

    def _send(self, message: str) -> None:
        from websockets.asyncio.server import broadcast

        broadcast(self._pages, message)
