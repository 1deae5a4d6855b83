"""Limit on connections without a request.

websockets waits 10 s for the request of a connection, and each such connection is an open file. Without a limit, a
client without a token could open some hundred connections and leave no open files for pages and recordings.
"""

from __future__ import annotations

import asyncio
import logging
import resource
import time
from typing import Any

MAX_PENDING = 64  # Connections without a request; a browser that loads the page opens about 6.
BACKLOG = 16  # Connections that asyncio accepts at a time; it logs an error for each one that it cannot accept.
_LOG_INTERVAL = 60.0  # [s] Between two log messages that no connection can be accepted.

_log = logging.getLogger("rcilab.connections")


class PendingConnections:
    """The connections that have not sent a request yet, oldest first; above the limit the oldest one is closed.

    Owned by the event loop of the server.
    """

    def __init__(self) -> None:
        limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        self._max = MAX_PENDING if limit == resource.RLIM_INFINITY else max(4, min(MAX_PENDING, limit // 4))
        self._pending: dict[Any, None] = {}

    def build_connection(self, *args: Any, **options: Any) -> Any:
        """Returns a connection that adds itself here; for the option `create_connection` of websockets."""
        from websockets.asyncio.server import ServerConnection

        pending = self

        class Counted(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                pending.add(self)

            def connection_lost(self, exc: Exception | None) -> None:
                pending.discard(self)
                super().connection_lost(exc)

        return Counted(*args, **options)

    def add(self, connection: Any) -> None:
        """Adds a new connection; closes the oldest pending one if there are too many."""
        self._pending[connection] = None
        if len(self._pending) > self._max:
            oldest = next(iter(self._pending))
            del self._pending[oldest]
            oldest.transport.abort()

    def discard(self, connection: Any) -> None:
        """Removes a connection that has sent its request or has been closed."""
        self._pending.pop(connection, None)


def log_accept_errors(loop: asyncio.AbstractEventLoop) -> None:
    """Makes a loop log that it cannot accept connections as one line per minute, without tracebacks."""
    logged = -_LOG_INTERVAL

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        nonlocal logged
        error = context.get("exception")
        if not (isinstance(error, OSError) and "accept" in str(context.get("message"))):
            loop.default_exception_handler(context)
        elif time.monotonic() - logged >= _LOG_INTERVAL:
            logged = time.monotonic()
            _log.error(
                "no page can be connected at present: %s; open pages are not affected. Close programs, or allow more "
                "open files (ulimit -n)",
                error.strerror,
            )

    loop.set_exception_handler(handle)
