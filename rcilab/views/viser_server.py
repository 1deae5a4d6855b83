"""A viser server with access control and validation of messages.

viser 1.1 binds every interface by default, takes the next port if the requested one is busy, accepts websockets from
any Origin (so that any web page in the operator's browser could press the buttons), opens a public tunnel when a client
requests it, and writes all data that a client sends into its handles, including NaN and callback lists. This file,
`access_control`, `viser_ext.server_start` and `viser_ext.message_guard` prevent that.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Mapping
from functools import partial
from http import HTTPStatus
from importlib.metadata import version
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from rcilab.core.closeable import Closeable
from rcilab.views.access_control import AccessPolicy, Refusal, WrongTokenDelay
from rcilab.views.pending_connections import BACKLOG, PendingConnections, log_accept_errors
from rcilab.views.viser_ext.message_guard import MAX_MESSAGE, MessageGuard
from rcilab.views.viser_ext.server_start import start_server, stop_server

if TYPE_CHECKING:
    import viser


def listen(host: str, port: int) -> socket.socket:
    """Returns a listening socket on exactly this address and port; port 0 selects a free port.

    Raises:
        OSError: The host has no address, or the port is in use or not permitted.
    """
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    bound = socket.socket(family, kind, protocol)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen(BACKLOG)
    except OSError:
        bound.close()
        raise
    return bound


class GuardedServer(Closeable):
    """viser on a bound socket, with access control. Owns both.

    Args:
        bound: Socket from `listen`.
        policy: Accepts or refuses requests.
        decorate: Converts viser's `index.html` to the page. Such a page is not cached, and pages of other machines
            cannot show it in a frame.
        routes: Additional websockets: path -> async function of the connection.
        may_act: Whether a page, by its client id, may use the controls; by default any page may.
        refuse: Called with the client id of a page that used a control without permission.

    Attributes:
        viser: The server itself.
        guard: Validates the messages of pages.
    """

    def __init__(
        self,
        bound: socket.socket,
        policy: AccessPolicy,
        *,
        decorate: Callable[[bytes], bytes] | None = None,
        routes: Mapping[str, Callable[[Any], Any]] | None = None,
        may_act: Callable[[int], bool] = lambda page: True,
        refuse: Callable[[int], None] = lambda page: None,
    ) -> None:
        self._policy, self._token_delay = policy, WrongTokenDelay()
        self._protocol = f"viser-v{version('viser')}"
        self._decorate = decorate
        self._routes = dict(routes or {})
        self.viser: viser.ViserServer = start_server(policy.host, policy.port, partial(self._adapt, bound))
        self.guard = MessageGuard(self.viser, may_act, refuse)

    def close(self) -> None:
        """Stops serving."""
        stop_server(self.viser)

    def _adapt(self, bound: socket.socket, handler: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Adds access control, message validation and the additional websockets to viser's connection handler."""
        answer = options["process_request"]
        pending = PendingConnections()
        log_accept_errors(asyncio.get_running_loop())

        async def route(connection: Any) -> None:
            own = self._routes.get(_path_of(connection.request))
            if own is not None:
                await own(connection)
            else:
                self.guard.filter_connection(connection)
                await handler(connection)

        def process(connection: Any, request: Any) -> Any:
            pending.discard(connection)
            return self._answer(answer, connection, request)

        # Browsers open connections in advance and close them unused, which must not be logged as an error.
        quiet = logging.getLogger("rcilab.page")
        quiet.setLevel(logging.CRITICAL)
        ours = {
            "sock": bound,
            "backlog": BACKLOG,
            "process_request": process,
            "create_connection": pending.build_connection,
            "logger": quiet,
            "max_size": MAX_MESSAGE,
        }
        return route, {**options, **ours}

    def _answer(self, answer: Callable[[Any, Any], Any], connection: Any, request: Any) -> Any:
        """Returns the response to a request, or None to open a websocket."""
        from websockets.datastructures import MultipleValuesError

        try:
            return self._answer_valid(answer, connection, request)
        except MultipleValuesError as error:
            return _refusal(f"the header {error.args[0]} occurs more than once", HTTPStatus.BAD_REQUEST)
        except (OSError, ValueError):  # Not a valid file name.
            return _refusal("the path is not valid", HTTPStatus.BAD_REQUEST)

    def _answer_valid(self, answer: Callable[[Any, Any], Any], connection: Any, request: Any) -> Any:
        headers = request.headers
        host, cookie = headers.get("Host"), headers.get("Cookie")
        if headers.get("Upgrade", "").lower() == "websocket":
            reason = self._policy.refuse_socket(host, headers.get("Origin"), cookie)
            if reason is not None:
                return self._refuse(reason)
            protocols = headers.get("Sec-WebSocket-Protocol", "").split(",")
            if _path_of(request) not in self._routes and self._protocol not in map(str.strip, protocols):
                return _refusal("the page has another version; load it again", HTTPStatus.BAD_REQUEST)
            return None
        reason = self._policy.refuse_page(host, request.path, cookie)
        if reason is not None:
            return self._refuse(reason)
        if self._decorate is None or _path_of(request) not in ("/", "/index.html"):
            return answer(connection, request)
        if "Accept-Encoding" in headers:
            del headers["Accept-Encoding"]  # The page is needed uncompressed.
        response = answer(connection, request)
        if response is None or response.status_code != HTTPStatus.OK:
            return response
        return self._page_response(self._decorate(response.body))

    def _refuse(self, refusal: Refusal) -> Any:
        """Returns the response to a refused request; after a wrong token, with a delay."""
        answer = _refusal(refusal.reason)
        return answer if not refusal.has_wrong_token else _delayed(answer, self._token_delay.delay())

    def _page_response(self, body: bytes) -> Any:
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        headers = Headers({
            "Content-Type": "text/html; charset=utf-8",
            "Content-Length": str(len(body)),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            # A page of another site must not show this one in a frame and redirect the operator's clicks.
            "Content-Security-Policy": "frame-ancestors 'self' http://localhost:* http://127.0.0.1:*",
        })  # fmt: skip
        if self._policy.cookie is not None:
            headers["Set-Cookie"] = f"{self._policy.cookie}; Path=/; HttpOnly; SameSite=Strict"
        return Response(HTTPStatus.OK.value, "OK", headers, body)


async def _delayed(answer: Any, delay: float) -> Any:
    await asyncio.sleep(delay)
    return answer


def _path_of(request: Any) -> str:
    return urlsplit(request.path).path


def _refusal(reason: str, status: HTTPStatus = HTTPStatus.FORBIDDEN) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    body = f"{status.value}: {reason}\n".encode()
    headers = Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))})
    return Response(status.value, status.phrase, headers, body)
