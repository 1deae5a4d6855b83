"""The page's front door: who may open it, who may talk to it, and what they may say.

viser 1.1 binds every interface by default, takes the next port when the wanted one is busy, answers a websocket from
any Origin (so any web page in the operator's browser could press our buttons), opens a public tunnel when a client
asks for it, and writes whatever a client sends into its handles, NaN and callback lists included. Everything that
stands against this is in this file, and the tests try each door.
"""

from __future__ import annotations

import errno
import hmac
import io
import logging
import math
import socket
from collections.abc import Callable
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from rcilab.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    import viser

COOKIE = "rcilab_token"
DEFAULT_PORT = 8080
_LOOPBACK = ("127.0.0.1", "::1", "localhost")


@dataclass(frozen=True, kw_only=True)
class Gate:
    """Decides about a request from its headers alone.

    Args:
        host: Address we listen on.
        port: Port we listen on.
        token: Secret that every page must bring, or None on loopback.
    """

    host: str
    port: int
    token: str | None = None

    @property
    def names(self) -> frozenset[str]:
        """What a browser may call us in Host and Origin; empty when any name may lead here (0.0.0.0)."""
        if self.host in ("0.0.0.0", "::"):
            return frozenset()
        hosts = {self.host, *(_LOOPBACK if self.host in _LOOPBACK else ())}
        return frozenset(f"{_bracketed(name)}:{self.port}" for name in hosts)

    def refuse_page(self, host: str | None, path: str, cookie: str | None) -> str | None:
        """Returns why a page may not be served, or None when it may.

        A foreign Host means that somebody's DNS points at this machine (rebinding), so it is refused too.
        """
        if self.names and host not in self.names:
            return f"this workbench answers to {' and '.join(sorted(self.names))} only"
        if self.token is not None and not (self._fits(_token_in(path)) or self._fits(_token_from(cookie))):
            return "this workbench needs its token: open the address that `rcilab --token` printed"
        return None

    def refuse_socket(self, host: str | None, origin: str | None, cookie: str | None) -> str | None:
        """Returns why a websocket may not be opened, or None when it may; a missing Origin is refused."""
        if origin is None:
            return "a websocket needs an Origin"
        scheme, _, name = origin.partition("://")
        if scheme not in ("http", "https") or name != host or (self.names and name not in self.names):
            return f"origin {origin!r} is not this workbench"
        if self.token is not None and not self._fits(_token_from(cookie)):
            return "the token is missing or wrong"
        return None

    def _fits(self, given: str | None) -> bool:
        return given is not None and hmac.compare_digest(given.encode(), (self.token or "").encode())


def check_host(host: str, token: str | None) -> None:
    """Raises UsageError when the address is open to others and no token guards it."""
    if host not in _LOOPBACK and not host.startswith("127.") and not token:
        raise UsageError(
            f"--host {host} opens the workbench to the network, and whoever opens the page can move the robot; "
            "add --token SECRET, or leave --host away to stay on this machine"
        )


def bind(host: str, port: int) -> socket.socket:
    """Returns a listening-ready socket on exactly this port; port 0 takes any free one.

    Raises:
        UsageError: The port is taken or the address is not ours; the message says what to change.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except OSError as error:
        raise UsageError(f"--host {host} is not an address of this machine; leave it away for 127.0.0.1") from error
    bound = socket.socket(family, kind, protocol)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen(100)
    except OSError as error:
        bound.close()
        if error.errno == errno.EADDRINUSE:
            other = port + 1 if port < 65535 else 0
            raise UsageError(
                f"port {port} is in use, perhaps by another workbench: close that one, or start this one with "
                f"`rcilab --port {other}`"
            ) from error
        raise UsageError(
            f"cannot listen on {host} port {port} ({error.strerror}): choose another with --port or --host"
        ) from error
    return bound


def open_server(
    bound: socket.socket,
    gate: Gate,
    *,
    decorate: Callable[[bytes], bytes],
    live: Callable[[Any], Any],
) -> viser.ViserServer:
    """Starts viser on a socket that is bound already, behind the gate.

    Args:
        bound: From `bind`.
        gate: Decides about every request.
        decorate: Makes our page out of viser's `index.html`.
        live: Serves websocket connections to `/rcilab/live`: an async function of the connection.
    """
    import viser
    from viser import _messages

    with _guarded_serve(bound, gate, decorate, live):
        server = viser.ViserServer(host=gate.host, port=gate.port, verbose=False)
    sockets = server._websock_server  # The three calls below have no public spelling in viser 1.1.
    sockets.unregister_handler(_messages.ShareUrlRequest)
    sockets.unregister_handler(_messages.ShareUrlDisconnect)
    _guard_updates(server)
    return server


def close_server(server: viser.ViserServer) -> None:
    """Stops viser without its parting words on our terminal."""
    with redirect_stdout(io.StringIO()):
        server.stop()


@contextmanager
def _guarded_serve(
    bound: socket.socket, gate: Gate, decorate: Callable[[bytes], bytes], live: Callable[[Any], Any]
) -> Iterator[None]:
    """Replaces the `serve` that viser's server thread is about to call."""
    import websockets.asyncio.server as serving
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    original = serving.serve

    def refuse(reason: str) -> Response:
        body = f"403: {reason}\n".encode()
        headers = Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))})
        return Response(HTTPStatus.FORBIDDEN.value, "Forbidden", headers, body)

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        del host, port  # viser would try the next port; the socket is bound to the one we want.
        answer = options.pop("process_request")
        pages: dict[int, bytes] = {}

        def process(connection: Any, request: Any) -> Response | None:
            headers, host_name = request.headers, request.headers.get("Host")
            cookie = headers.get("Cookie")
            if headers.get("Upgrade", "").lower() == "websocket":
                reason = gate.refuse_socket(host_name, headers.get("Origin"), cookie)
                return None if reason is None else refuse(reason)
            reason = gate.refuse_page(host_name, request.path, cookie)
            if reason is not None:
                return refuse(reason)
            if urlsplit(request.path).path not in ("/", "/index.html"):
                return answer(connection, request)
            if "Accept-Encoding" in headers:
                del headers["Accept-Encoding"]  # We want to read the page before it is packed.
            response = answer(connection, request)
            if response is None or response.status_code != HTTPStatus.OK:
                return response
            body = pages.setdefault(len(response.body), decorate(response.body))
            ours = Headers({
                "Content-Type": "text/html; charset=utf-8",
                "Content-Length": str(len(body)),
                "Cache-Control": "no-store",
                "X-Content-Type-Options": "nosniff",
                "Referrer-Policy": "no-referrer",
                # A page of another site must not show ours in a frame and steer the operator's clicks.
                "Content-Security-Policy": "frame-ancestors 'self' http://localhost:* http://127.0.0.1:*",
            })  # fmt: skip
            if gate.token is not None:
                ours["Set-Cookie"] = f"{COOKIE}={gate.token}; Path=/; HttpOnly; SameSite=Strict"
            return Response(HTTPStatus.OK.value, "OK", ours, body)

        async def route(connection: Any) -> None:
            path = urlsplit(connection.request.path).path
            await (live(connection) if path == "/rcilab/live" else handler(connection))

        # A browser opens connections ahead of need and drops them unused; that is no error worth a traceback.
        quiet = logging.getLogger("rcilab.page")
        quiet.setLevel(logging.CRITICAL)
        return original(route, sock=bound, process_request=process, **{**options, "logger": quiet})

    serving.serve = serve
    try:
        with redirect_stdout(io.StringIO()):  # viser prints a box with addresses; we print one line of our own.
            yield
    finally:
        serving.serve = original


def _guard_updates(server: viser.ViserServer) -> None:
    """Lets a client change the value of a control and nothing else about it, and only to finite numbers.

    Without this a client can erase a control's Python callbacks (`updates={"update_cb": []}`) and send NaN.
    """
    from viser import _messages

    handlers = server._websock_server._incoming_handlers.pop(_messages.GuiUpdateMessage)

    async def guarded(client_id: Any, message: Any) -> None:
        if set(message.updates) != {"value"} or not is_finite(message.updates["value"]):
            return
        for handler in handlers:
            outcome = handler(client_id, message)
            if outcome is not None:
                await outcome

    server._websock_server.register_handler(_messages.GuiUpdateMessage, guarded)


def is_finite(value: object) -> bool:
    """Returns whether every number in a value, however nested, is finite."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, list | tuple):
        return all(is_finite(item) for item in value)
    return True


def _token_in(path: str) -> str | None:
    return (parse_qs(urlsplit(path).query).get("token") or [None])[0]


def _token_from(cookie: str | None) -> str | None:
    try:
        morsel = SimpleCookie(cookie or "").get(COOKIE)
    except CookieError:
        return None
    return morsel.value if morsel is not None else None


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
