"""A viser server behind a gate: who may open the page, who may talk to it, and what they may say.

viser 1.1 binds every interface by default, takes the next port when the wanted one is busy, answers a websocket from
any Origin (so any web page in the operator's browser could press our buttons), opens a public tunnel when a client
asks for it, and writes whatever a client sends into its handles, NaN and callback lists included. What prevents this
is in this file, in `access_control`, `viser_ext.server_start` and `viser_ext.message_guard`.
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
from rcilab.views.access_control import Gate, Guesses, Refusal
from rcilab.views.arrivals import BACKLOG, Arrivals, watch_loop
from rcilab.views.viser_ext.message_guard import LARGEST_MESSAGE, MessageGuard
from rcilab.views.viser_ext.server_start import start_server, stop_server

if TYPE_CHECKING:
    import viser


def listen(host: str, port: int) -> socket.socket:
    """Returns a listening socket on exactly this address and port; port 0 takes any free one.

    Raises:
        OSError: The host has no address, or the port is taken or not ours.
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
    """viser on a socket that is bound already, behind a gate. Owns both.

    Args:
        bound: From `listen`.
        gate: Decides about every request.
        decorate: Makes our page out of viser's `index.html`. Such a page is not cached, and pages of other machines
            may not show it in a frame.
        routes: Other websockets that are served here: path -> async function of the connection.
        may_act: Whether a page, by its client id, may use the controls; any may by default.
        refuse: Called with the client id of a page that has used one and may not.

    Attributes:
        viser: The server itself.
        guard: Looks at what pages send.
    """

    def __init__(
        self,
        bound: socket.socket,
        gate: Gate,
        *,
        decorate: Callable[[bytes], bytes] | None = None,
        routes: Mapping[str, Callable[[Any], Any]] | None = None,
        may_act: Callable[[int], bool] = lambda page: True,
        refuse: Callable[[int], None] = lambda page: None,
    ) -> None:
        self._gate, self._guesses = gate, Guesses()
        self._protocol = f"viser-v{version('viser')}"
        self._decorate = decorate
        self._routes = dict(routes or {})
        self.viser: viser.ViserServer = start_server(gate.host, gate.port, partial(self._adapt, bound))
        self.guard = MessageGuard(self.viser, may_act, refuse)

    def close(self) -> None:
        """Stops serving."""
        stop_server(self.viser)

    def _adapt(self, bound: socket.socket, handler: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        """Puts the gate, the guard and our own websockets in front of viser's handler of connections."""
        answer = options["process_request"]
        arrivals = Arrivals()
        watch_loop(asyncio.get_running_loop())

        async def route(connection: Any) -> None:
            own = self._routes.get(_path_of(connection.request))
            if own is not None:
                await own(connection)
            else:
                self.guard.listen(connection)
                await handler(connection)

        def process(connection: Any, request: Any) -> Any:
            arrivals.served(connection)
            return self._answer(answer, connection, request)

        # A browser opens connections ahead of need and drops them unused; that is no error worth a traceback.
        quiet = logging.getLogger("rcilab.page")
        quiet.setLevel(logging.CRITICAL)
        ours = {
            "sock": bound,
            "backlog": BACKLOG,
            "process_request": process,
            "create_connection": arrivals.build_connection,
            "logger": quiet,
            "max_size": LARGEST_MESSAGE,
        }
        return route, {**options, **ours}

    def _answer(self, answer: Callable[[Any, Any], Any], connection: Any, request: Any) -> Any:
        """Returns the response to a request, or None to go on and open a websocket."""
        from websockets.datastructures import MultipleValuesError

        try:
            return self._answer_sound(answer, connection, request)
        except MultipleValuesError as error:
            return _refusal(f"the header {error.args[0]} is there more than once", HTTPStatus.BAD_REQUEST)
        except (OSError, ValueError):  # No file system has such a name.
            return _refusal("there cannot be such a path", HTTPStatus.BAD_REQUEST)

    def _answer_sound(self, answer: Callable[[Any, Any], Any], connection: Any, request: Any) -> Any:
        headers = request.headers
        host, cookie = headers.get("Host"), headers.get("Cookie")
        if headers.get("Upgrade", "").lower() == "websocket":
            reason = self._gate.refuse_socket(host, headers.get("Origin"), cookie)
            if reason is not None:
                return self._refuse(reason)
            said = headers.get("Sec-WebSocket-Protocol", "").split(",")
            if _path_of(request) not in self._routes and self._protocol not in map(str.strip, said):
                return _refusal("a page of another version; load it again", HTTPStatus.BAD_REQUEST)
            return None
        reason = self._gate.refuse_page(host, request.path, cookie)
        if reason is not None:
            return self._refuse(reason)
        if self._decorate is None or _path_of(request) not in ("/", "/index.html"):
            return answer(connection, request)
        if "Accept-Encoding" in headers:
            del headers["Accept-Encoding"]  # We want to read the page before it is packed.
        response = answer(connection, request)
        if response is None or response.status_code != HTTPStatus.OK:
            return response
        return self._dress(self._decorate(response.body))

    def _refuse(self, refusal: Refusal) -> Any:
        """Returns the answer to a request that is not let in; to one that guesses, only after a while."""
        answer = _refusal(refusal.reason)
        return answer if not refusal.is_guess else _later(answer, self._guesses.delay())

    def _dress(self, body: bytes) -> Any:
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        headers = Headers({
            "Content-Type": "text/html; charset=utf-8",
            "Content-Length": str(len(body)),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            # A page of another site must not show ours in a frame and steer the operator's clicks.
            "Content-Security-Policy": "frame-ancestors 'self' http://localhost:* http://127.0.0.1:*",
        })  # fmt: skip
        if self._gate.cookie is not None:
            headers["Set-Cookie"] = f"{self._gate.cookie}; Path=/; HttpOnly; SameSite=Strict"
        return Response(HTTPStatus.OK.value, "OK", headers, body)


async def _later(answer: Any, delay: float) -> Any:
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
