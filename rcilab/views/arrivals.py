"""Limits connections without a request: idle ones must not displace others.

websockets waits 10 s for a request, and each connection that it waits for is an open file. Without a bound a stranger
who opens some hundred, on a page that he has no token for, leaves none for pages and recordings.
"""

from __future__ import annotations

import asyncio
import logging
import resource
import time
from typing import Any

MOST_WAITING = 64  # Connections without a request yet; a browser that loads the page opens some 6.
BACKLOG = 16  # Connections that asyncio takes at a time, of which it complains one by one where it can take none.
_AGAIN = 60.0  # [s] That no connection can be taken is said so often.

_log = logging.getLogger("rcilab.arrivals")


class Arrivals:
    """The connections that have not sent their request yet, oldest first; of too many the oldest ends.

    Owned by the server's loop.
    """

    def __init__(self) -> None:
        limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        self._most = MOST_WAITING if limit == resource.RLIM_INFINITY else max(4, min(MOST_WAITING, limit // 4))
        self._waiting: dict[Any, None] = {}

    def build_connection(self, *args: Any, **options: Any) -> Any:
        """Returns a connection of websockets that is counted here; for its option `create_connection`."""
        from websockets.asyncio.server import ServerConnection

        arrivals = self

        class Counted(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                arrivals.come(self)

            def connection_lost(self, exc: Exception | None) -> None:
                arrivals.served(self)
                super().connection_lost(exc)

        return Counted(*args, **options)

    def come(self, connection: Any) -> None:
        """Takes note of a new connection; the oldest that says nothing ends when there are too many."""
        self._waiting[connection] = None
        if len(self._waiting) > self._most:
            oldest = next(iter(self._waiting))
            del self._waiting[oldest]
            oldest.transport.abort()

    def served(self, connection: Any) -> None:
        """Takes note that a connection has said what it wants, or has gone."""
        self._waiting.pop(connection, None)


def watch_loop(loop: asyncio.AbstractEventLoop) -> None:
    """Has a loop say in one sentence that it can take no connection, once a minute, and not in tracebacks."""
    said = -_AGAIN

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        nonlocal said
        error = context.get("exception")
        if not (isinstance(error, OSError) and "accept" in str(context.get("message"))):
            loop.default_exception_handler(context)
        elif time.monotonic() - said >= _AGAIN:
            said = time.monotonic()
            _log.error(
                "no page can be connected just now: %s; those that are open go on. Close programs, or allow more "
                "open files (ulimit -n)",
                error.strerror,
            )

    loop.set_exception_handler(handle)
