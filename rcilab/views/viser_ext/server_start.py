"""Starts a viser server with an adapted websocket server, without share tunnel and without printing.

viser 1.1 accepts neither a bound socket nor options for websockets' `serve`, opens a public tunnel when a client
requests it, and prints addresses and a closing message through rich, which in a notebook bypasses stdout.

Unnecessary once `viser.ViserServer` accepts a socket and options for its websocket server, refuses requests for a
tunnel by default, and prints nothing with `verbose=False`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias

from rcilab.views.viser_ext import assignments, icons, loop_event, sendable
from rcilab.views.viser_ext.version_guard import require_known_viser

if TYPE_CHECKING:
    import viser

Adapt: TypeAlias = Callable[[Any, dict[str, Any]], tuple[Any, dict[str, Any]]]
"""Receives the connection handler and the options that viser passes to `serve`, and returns those to use. The options
contain a socket, because viser would take the next port if the requested one is busy."""


def start_server(host: str, port: int, adapt: Adapt) -> viser.ViserServer:
    """Returns a running server with the patches of this package.

    Args:
        host: Address that viser reports as its own.
        port: Port that viser reports as its own.
        adapt: Called on the server's event loop before it listens.

    Raises:
        UsageError: Another version of viser is installed.
    """
    require_known_viser()
    import viser
    from viser import _messages

    for patch in (loop_event, assignments, icons, sendable):
        patch.install()
    with _adapted(adapt), _quiet():
        server = viser.ViserServer(host=host, port=port, verbose=False)
    for request in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(request)
    return server


def stop_server(server: viser.ViserServer) -> None:
    """Stops a server without printing."""
    with _quiet():
        server.stop()


@contextmanager
def _adapted(adapt: Adapt) -> Iterator[None]:
    """Replaces the `serve` that viser's server thread will call."""
    import websockets.asyncio.server as serving

    original = serving.serve

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        handler, options = adapt(handler, options)
        return original(handler, **options)

    serving.serve = serve
    try:
        yield
    finally:
        serving.serve = original


@contextmanager
def _quiet() -> Iterator[None]:
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
